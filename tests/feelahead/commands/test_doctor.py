"""Each check of `feelahead doctor` with invented facts, and the whole command on this machine."""

import json
import os
import re
import tomllib
from pathlib import Path

import pytest

from common.errors import ConfigurationError, NoDriverError
from feelahead.commands.doctor import command as doctor_command
from feelahead.commands.doctor import controllers, machine
from feelahead.commands.doctor.controllers import (
    check_permission,
    missing_grants,
)
from feelahead.commands.doctor.finding import Finding, Verdict
from feelahead.commands.doctor.machine import (
    COMPILE,
    EXTRAS,
    KernelFacts,
    check_extra,
    check_kernels,
    check_realtime,
    check_rendering,
)
from feelahead.main import command
from operator_side.dualsense.hid.device import HidBackend
from operator_side.dualsense.hid.udev import RULE_FILE, RULES, installing_command
from robot_side.compiled import warm_up as warm_up_module
from tests.helpers.fake_hid import ADDRESS, BLUETOOTH, FakeBackend, FakeHandle
from tests.helpers.machines.fake_proc import add_process
from tests.helpers.repository import ROOT
from tests.robot_side.compiled.fresh_kernels import fresh_kernels

OK, NOTE, MISSING = Verdict.OK, Verdict.NOTE, Verdict.MISSING
ABSENT = {"some_module": "No module named 'some_module'"}
BROKEN = {"numba": "No module named 'numba'", "mujoco": "libGL.so.1: cannot open"}
SEEN = Finding("controller", OK, "DualSense at /dev/hidraw3 on USB: and more")
DENIED = Finding("controller", MISSING, "DualSense at /dev/hidraw3: no permission to open the controller at X")
NONE = Finding("controller", NOTE, "none is connected")
NO_RIGHT = "--realtime: locking memory is not permitted; to permit it: sudo this; and that"


def permission(*seen: Finding, is_root: bool = False, rules: str = "") -> Finding:
    return check_permission(is_root=is_root, rules={"/etc/x.rules": rules}, controllers=seen or [NONE])


@pytest.mark.parametrize(
    ("findings", "verdict", "said", "remedy"),
    [
        ([check_extra("robot", {})], OK, "mujoco, numba", None),
        ([check_extra("robot", ABSENT)], NOTE, "not installed: some_module", re.escape("'.[robot]'")),
        ([check_extra("record", ABSENT)], NOTE, "not installed: some_module", re.escape("'.[record]'")),
        (
            [check_extra("robot", BROKEN)],
            NOTE,
            "numba; cannot be imported: mujoco (libGL",
            "--force-reinstall .*robot",
        ),
        ([permission()], NOTE, RULE_FILE, "udevadm control --reload && sudo udevadm trigger$"),
        ([permission(DENIED)], MISSING, RULE_FILE, "udevadm"),
        ([permission(SEEN)], OK, "can be opened", None),
        ([permission(rules="\n".join(RULES))], OK, "installed", None),
        ([permission(is_root=True)], OK, "root", "udevadm"),
        (check_realtime([]), OK, "permitted", None),
        (check_realtime([NO_RIGHT]), NOTE, "locking memory is not permitted;", "^sudo this; and that$"),
        ([check_rendering({"egl": "egl: gone", "osmesa": None})], OK, "OSMESA", None),
        ([check_rendering({"egl": "egl: gone", "osmesa": "nor it"})], NOTE, "egl: gone; nor it", "libegl1"),
        (check_kernels(KernelFacts(30, 0, "/there", writable=False)), OK, "30 compiled for this processor", None),
        (check_kernels(KernelFacts(30, 2, "/there", writable=True)), NOTE, "2 of 30 are not compiled", COMPILE),
        (check_kernels(KernelFacts(30, 2, "/x", writable=False)), NOTE, "each start", f"NUMBA_CACHE_DIR.*{COMPILE}"),
    ],
)
def test_a_check(findings: list[Finding], verdict: Verdict, said: str, remedy: str | None) -> None:
    [finding] = findings
    assert finding.verdict is verdict
    assert said in finding.said
    assert (finding.remedy is None) == (remedy is None)
    assert re.search(remedy or "", finding.remedy or "")


def test_what_is_checked_is_what_the_package_brings() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for extra, (_, modules) in EXTRAS.items():
        assert len(project["optional-dependencies"][extra]) == len(modules)


def test_rules_that_others_wrote_count() -> None:
    steam = (
        'KERNEL=="hidraw*", ATTRS{idVendor}=="054c", ATTRS{idProduct}=="0ce6", MODE="0660", TAG+="uaccess"\n'
        'KERNEL=="hidraw*", KERNELS=="*054C:0CE6*", MODE="0660", TAG+="uaccess"\n'
    )
    assert missing_grants({"60-steam.rules": steam}) == ["a DualSense Edge on USB", "a DualSense Edge on Bluetooth"]
    everybody = 'SUBSYSTEM=="hidraw", ATTRS{idProduct}=="0df2", MODE="0666"'
    assert missing_grants({"a": steam, "b": everybody}) == ["a DualSense Edge on Bluetooth"]
    assert len(missing_grants({"a": steam.replace("KERNEL==", "# KERNEL==")})) == 4
    assert len(missing_grants({"a": steam.replace('MODE="0660", TAG+="uaccess"', 'SYMLINK+="pad"')})) == 4


# On this machine


@pytest.mark.processes
def test_what_cannot_be_imported_or_rendered_is_named_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "EXTRAS", {"robot": ("a test", ("json", "no_such_module"))})
    assert machine.failed_imports("robot") == {"no_such_module": "No module named 'no_such_module'"}
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    monkeypatch.setenv("EGL_PLATFORM", "none")
    assert str(machine.rendering_troubles()["egl"]).startswith("egl: ")


def test_controllers_are_looked_at_and_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    working, denied = FakeHandle(BLUETOOTH), FakeHandle(opens=False, reason="in use")
    dongle = FakeHandle(repeats=True)
    backend: HidBackend = FakeBackend({0x0CE6: {b"/dev/a": working}, 0x0DF2: {b"/dev/b": denied, b"/dev/c": dongle}})
    monkeypatch.setattr(controllers, "load_backend", lambda: backend)
    first, second, third = controllers.controllers_seen()
    about = f"on Bluetooth: {ADDRESS}, firmware 0x0110002a (hardware 0x00000616), battery about "
    assert (first.verdict, second.verdict, third.verdict) == (OK, MISSING, MISSING)
    assert "/dev/c repeats one report" in third.said
    assert first.said.startswith(f"DualSense at /dev/a {about}")
    assert second.said.startswith("DualSense Edge at /dev/b: ")
    assert "in use" in second.said + (second.remedy or "")
    assert (working.closed, working.written) == (working.times_opened, [])
    monkeypatch.setattr(controllers, "load_backend", lambda: FakeBackend({}))
    assert [one.said for one in controllers.controllers_seen()] == ["none is connected (the demo simulates one)"]

    def missing() -> None:
        raise NoDriverError("hidapi cannot be imported (ImportError: libudev.so.1: no)", "pip: install it")

    monkeypatch.setattr(controllers, "load_backend", missing)
    [finding] = controllers.controllers_seen()
    assert (finding.verdict, finding.remedy) == (NOTE, "pip: install it")
    assert finding.said.endswith("(ImportError: libudev.so.1: no)")


def test_a_second_writer_is_a_note_with_its_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    add_process(tmp_path, 11, "steam", {"/dev/a": os.O_RDWR})
    monkeypatch.setattr(controllers, "PROC", tmp_path)
    monkeypatch.setattr(controllers, "load_backend", lambda: FakeBackend({0x0CE6: {b"/dev/a": FakeHandle()}}))
    found = controllers.controllers_seen()
    assert (found[1].verdict, found[1].said) == (NOTE, "steam (11) holds /dev/a open for writing")
    assert "Steam Input" in (found[1].remedy or "")
    assert permission(*found).said == "the controller can be opened"


@pytest.mark.parametrize(
    ("robot", "operator", "last_line"),
    [
        (OK, NOTE, "The demo can run: feelahead demo"),
        (NOTE, OK, "This machine can be the operator side: feelahead-operator. The demo needs the extra robot, too."),
        (NOTE, NOTE, "Neither side can run as it is: see what is missing."),
    ],
)
def test_the_exit_code_says_whether_the_machine_can_be_a_side(
    robot: Verdict,
    operator: Verdict,
    last_line: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    findings = [
        Finding("extra robot", robot, "numba [gone]", "pip install '.[robot]'"),
        Finding("extra operator", operator, "viser"),
        Finding("udev rule", NOTE, "none", installing_command()),
    ]
    monkeypatch.setattr(doctor_command, "examine", lambda: findings)
    code = 0 if OK in (robot, operator) else 1
    assert command(["doctor"]) == code
    lines = capsys.readouterr().out.splitlines()
    # Lines to be copied are not wrapped, and brackets are no markup.
    assert set(installing_command().splitlines()) <= set(lines)
    assert any("numba [gone]" in line for line in lines)
    assert last_line in " ".join(lines)
    assert command(["doctor", "--json"]) == code
    told = json.loads(capsys.readouterr().out)
    assert (told["demo"], told["operator"]) == (robot is OK, operator is OK)
    assert (told["findings"][0]["name"], told["findings"][0]["verdict"]) == ("extra robot", robot.value)


@pytest.mark.processes
def test_here_it_tells_of_everything(capsys: pytest.CaptureFixture[str]) -> None:
    code = command(["doctor", "--json"])
    told = json.loads(capsys.readouterr().out)
    names = [finding["name"] for finding in told["findings"]]
    assert {"kernels", "--realtime", "cameras"} <= set(names)
    expected = ("Python", *(f"extra {extra}" for extra in EXTRAS), "udev rule", "controller")
    assert names[: len(expected)] == list(expected)
    assert code == (0 if told["demo"] else 1)


def test_kernels_are_compiled_beforehand_and_once_and_said_where_they_cannot_be_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    monkeypatch.setattr(warm_up_module, "import_kernels", fresh_kernels)
    assert command(["doctor", "--compile", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["compiled"], told["kernels"], told["missing"]) == (3, 3, 0)
    assert told["folder"] == str(tmp_path / "kernels")
    assert command(["doctor", "--compile"]) == 0
    assert capsys.readouterr().out.startswith("0 kernels compiled")
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "kernels"))
    assert command(["doctor", "--compile"]) == 1
    assert "3 of 3 kernels were compiled, but not kept" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["--arm"], "--arm: has no address; valid: tcp://HOST:PORT"),
        (["--arm", "tcp://127.0.0.1:0", "--block-mm", "0"], "block-mm = 0"),
        (["--arm", "nowhere"], "nowhere"),
        (["--arm", "tcp://127.0.0.1:0", "--model", "arm.xml"], "--model is given without --site"),
    ],
)
def test_a_checklist_that_cannot_begin_says_why(flags: list[str], said: str) -> None:
    with pytest.raises(ConfigurationError, match=re.escape(said)):
        command(["doctor", *flags])
