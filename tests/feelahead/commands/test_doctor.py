"""Each check of `feelahead doctor` on facts that a test makes up, and the command on this machine."""

import json
import re
import socket
import tomllib
from pathlib import Path

import pytest
from rich.console import Console

from common.errors import ConfigurationError
from feelahead.commands.doctor import command as doctor_command
from feelahead.commands.doctor import facts
from feelahead.commands.doctor.controller_checks import (
    ControllerSeen,
    HidFacts,
    UhidFacts,
    check_controllers,
    check_hidapi,
    check_permission,
    check_uhid,
    missing_grants,
)
from feelahead.commands.doctor.finding import Finding, Verdict, fit_for_demo
from feelahead.commands.doctor.kernel_checks import COMPILE, KernelFacts, check_kernels
from feelahead.commands.doctor.machine_checks import (
    PORTS,
    RENDERING,
    RENDERING_PACKAGES,
    check_ports,
    check_realtime,
    check_rendering,
)
from feelahead.commands.doctor.python_checks import EXTRAS, OLDEST_PYTHON, check_extra, check_python, modules_of
from feelahead.main import command
from operator_side.dualsense.hid.device import HidBackend
from operator_side.dualsense.hid.udev import RULE_FILE, RULES, installing_command
from robot_side.cameras.off_screen import BACKENDS, REMEDY
from robot_side.compiled import warm_up as warm_up_module
from tests.helpers.fake_hid import ADDRESS, BLUETOOTH, FakeBackend, FakeHandle
from tests.helpers.repository import ROOT
from tests.robot_side.compiled.fresh_kernels import fresh_kernels

OK, NOTE, MISSING = Verdict.OK, Verdict.NOTE, Verdict.MISSING
SEEN = ControllerSeen("DualSense", "/dev/hidraw3", "USB", ADDRESS, "0x0110002a", "about 95%, full")
DENIED = ControllerSeen("DualSense", "/dev/hidraw3", trouble="no permission to open the controller at X: do this")


@pytest.mark.parametrize(("version", "verdict"), [((3, 11, 0), OK), ((3, 14, 2), OK), ((3, 10, 9), MISSING)])
def test_python(version: tuple[int, int, int], verdict: Verdict) -> None:
    finding = check_python(version)
    assert finding.verdict is verdict
    assert finding.for_demo


def test_what_is_checked_is_what_the_package_says() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["requires-python"] == f">={OLDEST_PYTHON[0]}.{OLDEST_PYTHON[1]}"
    for extra, modules in EXTRAS.items():
        assert len(project["optional-dependencies"][extra]) == len(modules)


def test_hidapi_has_another_module_on_linux() -> None:
    assert "hidraw" in modules_of("operator", "linux")
    assert "hid" in modules_of("operator", "darwin")


def test_an_extra_that_is_there() -> None:
    for extra in EXTRAS:
        finding = check_extra(extra, {})
        assert (finding.verdict, finding.remedy) == (OK, None)


@pytest.mark.parametrize(
    ("extra", "verdict"), [("robot", MISSING), ("operator", NOTE), ("record", NOTE), ("experiments", NOTE)]
)
def test_an_extra_that_is_not(extra: str, verdict: Verdict) -> None:
    finding = check_extra(extra, {"some_module": "No module named 'some_module'"})
    assert finding.verdict is verdict
    assert "not installed: some_module" in finding.said
    assert finding.remedy == f"pip install 'feelahead[{extra}]'"
    assert finding.for_demo is (verdict is MISSING)


def test_an_extra_that_is_broken() -> None:
    finding = check_extra("robot", {"numba": "No module named 'numba'", "mujoco": "libGL.so.1: cannot open"})
    assert "not installed: numba; cannot be imported: mujoco (libGL.so.1: cannot open)" in finding.said
    assert finding.remedy == "pip install --force-reinstall numba mujoco-core"


@pytest.mark.parametrize(
    ("platform", "hid", "verdict", "remedy"),
    [
        ("linux", HidFacts("0.15.0", ("hidapi",), None), OK, None),
        ("linux", HidFacts(None, (), "not importable"), NOTE, "pip install 'feelahead[operator]'"),
        ("linux", HidFacts("0.15.0", ("hid", "hidapi"), None), NOTE, "pip uninstall hid && "),
        ("linux", HidFacts("0.15.0", ("hid", "hidapi"), "not hidapi's"), MISSING, "pip uninstall hid && "),
        ("darwin", HidFacts("0.15.0", ("hid", "hidapi"), None), MISSING, "pip uninstall hid && "),
        ("win32", HidFacts("0.15.0", ("hidapi",), "a library is missing"), MISSING, "pip install --force-reinstall"),
    ],
)
def test_hidapi_and_the_package_called_hid(platform: str, hid: HidFacts, verdict: Verdict, remedy: str | None) -> None:
    finding = check_hidapi(platform, hid)
    assert finding.verdict is verdict
    assert (finding.remedy or "").startswith(remedy or "")
    assert (finding.remedy is None) is (remedy is None)


def permission(
    *controllers: ControllerSeen, platform: str = "linux", is_root: bool = False, rules: str = ""
) -> Finding:
    return check_permission(platform, is_root=is_root, rules={"/etc/x.rules": rules}, controllers=controllers)


def test_the_rule_with_its_place_and_what_loads_it() -> None:
    finding = permission()
    assert finding.verdict is NOTE
    assert RULE_FILE in finding.said
    assert finding.remedy is not None
    for line in (*RULES, f"sudo tee {RULE_FILE} << 'END'", "END"):
        assert line in finding.remedy.splitlines()
    assert finding.remedy.endswith("sudo udevadm control --reload && sudo udevadm trigger")


def test_its_file_comes_before_the_one_that_gives_devices_to_people() -> None:
    assert Path(RULE_FILE).name < "73-seat-late.rules"


def test_without_permission_the_rule_is_missing() -> None:
    assert permission(DENIED).verdict is MISSING


def test_no_rule_is_asked_for_where_none_is_needed() -> None:
    assert permission(SEEN).verdict is OK
    assert permission(platform="darwin").verdict is OK
    assert permission(rules="\n".join(RULES)).verdict is OK
    as_root = permission(is_root=True)
    assert as_root.verdict is OK
    assert as_root.remedy == installing_command()


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
    assert missing_grants({"ours": "\n".join(RULES)}) == []


def test_controllers() -> None:
    assert check_controllers(None)[0].verdict is NOTE
    assert "none is connected" in check_controllers([])[0].said
    fine, denied = check_controllers([SEEN, DENIED])
    assert fine.verdict is OK
    assert fine.said == f"DualSense at /dev/hidraw3 on USB: {ADDRESS}, firmware 0x0110002a, battery about 95%, full"
    assert (denied.verdict, denied.remedy) == (MISSING, "do this")


@pytest.mark.parametrize(
    ("platform", "uhid", "verdict", "remedy"),
    [
        ("linux", UhidFacts(exists=True, writable=True), OK, ""),
        ("linux", UhidFacts(exists=False, writable=False), NOTE, "sudo modprobe uhid"),
        ("linux", UhidFacts(exists=True, writable=False), NOTE, "sudo setfacl -m u:"),
        ("darwin", UhidFacts(exists=False, writable=False), NOTE, ""),
    ],
)
def test_virtual_controllers(platform: str, uhid: UhidFacts, verdict: Verdict, remedy: str) -> None:
    finding = check_uhid(platform, uhid)
    assert finding.verdict is verdict
    assert (finding.remedy or "").startswith(remedy)


def test_realtime_rights() -> None:
    assert [finding.verdict for finding in check_realtime("linux", [])] == [OK]
    assert [finding.verdict for finding in check_realtime("darwin", [])] == [NOTE]
    note = "--realtime: locking memory is not permitted; to permit it: sudo this; and that"
    [finding] = check_realtime("linux", [note])
    assert (finding.verdict, finding.remedy) == (NOTE, "sudo this; and that")
    assert finding.said.startswith("locking memory is not permitted")


def test_ports() -> None:
    assert [finding.said for finding in check_ports(dict.fromkeys(PORTS))] == ["5555, 5556, 8080 are free"]
    free, taken = check_ports({5555: "Address already in use", 5556: None, 8080: None})
    assert (free.verdict, taken.verdict) == (OK, NOTE)
    assert "5555, the control port" in taken.said
    assert taken.remedy is not None
    assert "--bind tcp://127.0.0.1:5557" in taken.remedy


def test_only_what_the_demo_needs_decides() -> None:
    assert fit_for_demo([Finding("a", MISSING, ""), Finding("b", OK, "", for_demo=True)])
    assert not fit_for_demo([Finding("a", MISSING, "", for_demo=True)])


# On this machine


def test_a_port_that_is_taken_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        monkeypatch.setattr(facts, "PORTS", {port: "a test"})
        assert facts.port_troubles() == {port: "Address already in use"}


@pytest.mark.processes
def test_what_cannot_be_imported_is_named_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(facts, "EXTRAS", {"robot": ()})
    monkeypatch.setattr(facts, "modules_of", lambda *_: ("json", "no_such_module"))
    assert facts.failed_imports() == {"robot": {"no_such_module": "No module named 'no_such_module'"}}


def test_controllers_are_looked_at_and_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    working, denied = FakeHandle(BLUETOOTH), FakeHandle(opens=False, reason="in use")
    backend: HidBackend = FakeBackend({0x0CE6: {b"/dev/a": working}, 0x0DF2: {b"/dev/b": denied}})
    monkeypatch.setattr(facts, "load_backend", lambda: backend)
    seen = facts.controllers_seen()
    assert seen is not None
    first, second = seen
    assert (first.model, first.transport, first.address, first.trouble) == ("DualSense", "Bluetooth", ADDRESS, None)
    assert first.firmware == "0x0110002a (hardware 0x00000616)"
    assert first.battery is not None
    assert second.model == "DualSense Edge"
    assert "in use" in (second.trouble or "")
    assert (working.closed, working.written) == (working.times_opened, [])


def fake_findings(verdict: Verdict) -> list[Finding]:
    return [
        Finding("extra robot", verdict, "numba [gone]", "pip install 'feelahead[robot]'", for_demo=True),
        Finding("udev rule", NOTE, "none", installing_command()),
    ]


@pytest.mark.parametrize(("verdict", "code"), [(OK, 0), (MISSING, 1)])
def test_the_exit_code_says_whether_the_demo_can_run(
    verdict: Verdict, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(facts, "controllers_seen", lambda: [SEEN])
    monkeypatch.setattr(doctor_command, "examine", lambda _: fake_findings(verdict))
    assert command(["doctor", "--json"]) == code
    told = json.loads(capsys.readouterr().out)
    assert told["demo"] is (code == 0)
    assert told["findings"][0] == {
        "name": "extra robot",
        "verdict": verdict.value,
        "said": "numba [gone]",
        "remedy": "pip install 'feelahead[robot]'",
        "for_demo": True,
    }
    assert told["controllers"][0]["address"] == ADDRESS


def test_what_is_to_be_copied_is_not_wrapped() -> None:
    console = Console(width=60, record=True, quiet=False, file=None)
    with console.capture() as captured:
        doctor_command.show(fake_findings(MISSING), console)
    lines = captured.get().splitlines()
    for line in installing_command().splitlines():
        assert line in lines
    assert any("numba [gone]" in line for line in lines)


@pytest.mark.processes
def test_here_it_tells_of_everything(capsys: pytest.CaptureFixture[str]) -> None:
    code = command(["doctor", "--json"])
    told = json.loads(capsys.readouterr().out)
    names = [finding["name"] for finding in told["findings"]]
    assert {"kernels", "--realtime", "ports"} <= set(names)
    expected = ("Python", *(f"extra {extra}" for extra in EXTRAS), "hidapi", "udev rule", "controller", "/dev/uhid")
    assert names[: len(expected)] == list(expected)
    assert code == (0 if told["demo"] else 1)


def test_a_flag_that_it_does_not_have() -> None:
    with pytest.raises(ConfigurationError, match="--colour"):
        command(["doctor", "--colour"])


def test_one_way_to_render_is_enough() -> None:
    found = check_rendering({"egl": "egl: no such library", "osmesa": None})
    assert (found.verdict, found.remedy) == (OK, None)
    assert "OSMESA" in found.said


def test_without_a_way_to_render_the_packages_are_named_and_the_demo_runs_all_the_same() -> None:
    found = check_rendering({"egl": "egl: no such library", "osmesa": "osmesa: nor this one"})
    assert found.verdict is NOTE
    assert "egl: no such library; osmesa: nor this one" in found.said
    assert found.remedy is not None
    assert "libegl1" in found.remedy
    assert fit_for_demo([found])


def test_doctor_tries_what_the_robot_side_tries_and_says_the_same() -> None:
    assert (RENDERING, RENDERING_PACKAGES) == (BACKENDS, REMEDY)


@pytest.mark.processes
def test_a_way_to_render_that_does_not_work_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    monkeypatch.setenv("EGL_PLATFORM", "none")
    assert str(facts.rendering_troubles(["egl"])["egl"]).startswith("egl: ")


@pytest.mark.parametrize(
    ("seen", "verdict", "said", "remedy"),
    [
        (KernelFacts(30, 0, "/there", writable=True), OK, "30 compiled for this processor, in /there", None),
        (KernelFacts(30, 0, "/there", writable=False), OK, "30 compiled for this processor, in /there", None),
        (KernelFacts(30, 2, "/there", writable=True), NOTE, "2 of 30 are not compiled", COMPILE),
        (KernelFacts(30, 2, "/there", writable=False), NOTE, "each start compiles", f"NUMBA_CACHE_DIR.*{COMPILE}"),
    ],
)
def test_kernels(seen: KernelFacts, verdict: Verdict, said: str, remedy: str | None) -> None:
    (found,) = check_kernels(seen)
    assert found.verdict is verdict
    assert said in found.said
    assert fit_for_demo([found])
    assert (found.remedy is None) == (remedy is None)
    assert remedy is None or re.search(remedy, found.remedy or "")


def test_without_numba_nothing_is_said_of_kernels() -> None:
    assert check_kernels(None) == []


def test_kernels_are_compiled_beforehand_and_once(
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


def test_kernels_that_cannot_be_kept_are_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "kernels"))
    monkeypatch.setattr(warm_up_module, "import_kernels", fresh_kernels)
    assert command(["doctor", "--compile"]) == 1
    assert "3 of 3 kernels were compiled, but not kept" in capsys.readouterr().out


def test_compiling_is_of_this_machine_alone() -> None:
    with pytest.raises(ConfigurationError, match="--compile with --connect"):
        command(["doctor", "--compile", "--connect", "tcp://127.0.0.1:5555"])
