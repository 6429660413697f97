"""`feelahead controller`: patterns in the hand, and forces, with a simulated or a played controller."""

import contextlib
import os
import pty
import signal
import subprocess
import sys
import termios
from pathlib import Path

import pytest

import feelahead.commands.controller.command
from common.errors import ConfigurationError
from feelahead.commands.controller.command import controller
from feelahead.commands.controller.loop import typing
from feelahead.commands.controller.patterns import STAGES, Stage, Walk
from feelahead.main import command
from operator_side.calibration.force_measurement import ForceMeasurement
from operator_side.calibration.forces import ControllerForces, TriggerForces, forces_path, load_forces, write_forces
from operator_side.controller.feel import FREE_TRIGGER, MAX_STRENGTH, RELEASED
from operator_side.controller.state import ControllerState
from operator_side.dualsense.reports.output_report import parse_output_report
from operator_side.dualsense.simulated.controller import SIMULATED_ADDRESS
from tests.feelahead.commands.conftest import Played
from tests.helpers.fake_hid import ADDRESS
from tests.helpers.repository import ROOT

pytestmark = pytest.mark.usefixtures("own_folder")

REPORT_LENGTH = 48
FORCES = TriggerForces(tuple(2.0 + 0.3 * strength for strength in range(9)))


def test_the_patterns_are_walked_through_and_a_key_stays_in_one() -> None:
    walk = Walk()
    seen: list[Stage] = []
    while walk.rounds == 0:
        walk.advance(len(seen) * 0.5)
        seen.append(walk.stage)
    assert list(dict.fromkeys(seen)) == list(STAGES)
    walk.choose("ramp")
    walk.skip()
    assert walk.stage.strengths == (1,) * 10
    walk.choose("strengths")
    for now_s in range(100):
        walk.advance(float(now_s))
        assert walk.stage.pattern == "strengths"


def test_a_story_tells_what_is_written_and_where_a_pull_met_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["controller", "--device", "simulated"]) == 0
    said = capsys.readouterr().out
    for stage in STAGES:
        assert f"{stage.words}: {' '.join(map(str, stage.strengths))}\n" in said
    # 3.7 N pass a free trigger, and stand where the wall begins.
    assert "R2 was pulled to 1.00: zone 7, strength 0\n" in said
    assert "R2 was pulled to 0.53: zone 4, strength 8\n" in said
    assert command(["controller", "--device", "simulated", "--pattern", "wall", "--duration", "9"]) == 0
    said = capsys.readouterr().out
    assert "a wall at the middle" in said
    assert "free" not in said


def test_measured_forces_are_shown_beside_the_strengths(capsys: pytest.CaptureFixture[str]) -> None:
    write_forces(forces_path(SIMULATED_ADDRESS), SIMULATED_ADDRESS, ControllerForces(r2=FORCES))
    assert command(["controller", "--device", "simulated"]) == 0
    assert "strength 5 of 8 everywhere (R2 2.0 +1.5 N): 5 5" in capsys.readouterr().out
    forces_path(SIMULATED_ADDRESS).write_text("version = 7")
    with pytest.raises(ConfigurationError, match="feelahead controller --measure-forces"):
        command(["controller", "--device", "simulated"])


def test_a_simulated_measurement_is_stored_only_where_asked_for(
    tmp_path: Path, own_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(["controller", "--measure-forces", "--device", "simulated"]) == 0
    said = capsys.readouterr().out
    assert "strengths 1 to 8 add 0.3 0.5 0.8 1.0 1.3 1.5 1.8 2.0 N" in said
    assert "--strongest-effect 2.0" in said
    assert "nothing was stored" in said
    assert not own_folder.exists()
    assert (
        command(["controller", "--measure-forces", "--device", "simulated", "--out", str(tmp_path / "mine.toml")]) == 0
    )
    assert "[r2]" in (tmp_path / "mine.toml").read_text()


def test_a_named_file_keeps_the_other_trigger_and_whatever_is_no_forces(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    measure = ["controller", "--measure-forces", "--device", "simulated", "--out", str(path)]
    for trigger in ("r2", "l2"):
        assert command([*measure, "--trigger", trigger]) == 0
    assert {"[l2]", "[r2]"} <= set(path.read_text().splitlines())
    path.write_text("a letter")
    with pytest.raises(ConfigurationError, match=r"mine\.toml"):
        command(measure)
    assert path.read_text() == "a letter"


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["--controller", "mine"], "--controller = 'mine'; valid: six pairs"),
        (["--controller", ADDRESS, "--device", "simulated"], "--controller with --device simulated; valid"),
        (["--measure-forces", "--pattern", "wall"], "--measure-forces excludes --pattern"),
        (["--calibrate", "--duration", "3"], "--calibrate excludes --pattern and --duration"),
        (["--calibrate", "--measure-forces"], "exclude each other; valid: one after the other"),
        (["--out", "mine.toml"], "--out without --calibrate or --measure-forces; valid: with one of them"),
        (["--duration", "0"], "--duration"),
    ],
)
def test_what_makes_no_sense_is_refused(flags: list[str], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        command(["controller", *flags])


@pytest.mark.parametrize(
    ("former", "now"), [("calibrate", "controller --calibrate"), ("feel", "controller .with --measure-forces")]
)
def test_a_former_name_says_the_present_one(former: str, now: str) -> None:
    with pytest.raises(ConfigurationError, match=f"{former} is part of another command now: feelahead {now}"):
        command([former, "--device", "simulated"])


def test_keys_are_taken_one_by_one_and_the_terminal_is_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    person, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    with os.fdopen(terminal) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        with typing(keys=True) as typed:
            assert typed() == ""
            os.write(person, b"2 ")
            assert typed() == "2 "
            assert not termios.tcgetattr(terminal)[3] & termios.ECHO
        assert termios.tcgetattr(terminal) == before
        os.close(person)
        with typing(keys=False) as typed:
            assert typed() is None


# A real controller to hidapi


@pytest.mark.parametrize("way", ["duration", "signal", "error"])
def test_a_wall_is_written_and_taken_back_however_it_ends(played: Played, way: str) -> None:
    def at_turn() -> None:
        if way != "duration" and played.handle.written:
            if way == "error":
                raise RuntimeError("as no clock should")
            signal.raise_signal(signal.SIGINT)

    played.at_turn = at_turn
    flags = ["--pattern", "wall", *(["--duration", "100"] if way == "duration" else [])]
    if way == "error":
        with pytest.raises(RuntimeError):
            controller(flags, played.backend)
    else:
        assert controller(flags, played.backend) == 0
    wall, released = map(parse_output_report, played.handle.written)
    assert wall.l2 == wall.r2 == (0, 0, 0, 0, *(6 * (MAX_STRENGTH,)))
    assert released == RELEASED
    assert played.handle.closed == played.handle.times_opened


def test_it_waits_for_the_controller_that_was_asked_for_and_names_the_others(
    played: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    # Each look opens and closes it twice; the note of the first two was shown before the third.
    played.at_turn = lambda: signal.raise_signal(signal.SIGINT) if played.handle.closed >= 6 else None
    assert controller(["--controller", "aa:bb:cc:dd:ee:ff"], played.backend) == 0
    assert f"aa:bb:cc:dd:ee:ff is not connected, only: {ADDRESS}; waiting for a controller" in capsys.readouterr().out
    assert played.handle.written == []


def test_a_measurement_is_stored_for_the_controller_beside_the_other_triggers(
    played: Played, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_forces(forces_path(ADDRESS), ADDRESS, ControllerForces(l2=FORCES))
    played.hands = lambda now_s: ControllerState(r2=0.6 * (now_s % 2.0 > 1.0))
    measured = ForceMeasurement("r2")

    def lines() -> str:
        return f"{200 + 30 * measured.strength}\n" if measured.yielded else ""

    monkeypatch.setattr(feelahead.commands.controller.command, "ForceMeasurement", lambda _: measured)
    monkeypatch.setattr(feelahead.commands.controller.command, "typing", lambda **_: contextlib.nullcontext(lines))
    assert controller(["--measure-forces"], played.backend) == 0
    forces = load_forces(ADDRESS)
    assert forces.l2 == FORCES
    assert forces.r2 is not None
    assert forces.r2.pulls_n == pytest.approx([(200 + 30 * strength) * 9.80665e-3 for strength in range(9)], abs=1e-3)
    assert f"stored: {forces_path(ADDRESS)}" in capsys.readouterr().out
    assert parse_output_report(played.handle.written[-1]) == RELEASED


def test_a_measurement_that_is_given_up_stores_nothing(
    played: Played, own_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        feelahead.commands.controller.command, "typing", lambda **_: contextlib.nullcontext(lambda: None)
    )
    assert controller(["--measure-forces"], played.backend) == 1
    assert "given up: nothing was stored" in capsys.readouterr().out
    assert not own_folder.exists()


@pytest.mark.parametrize("fault", ["folder", "file"])
def test_what_cannot_be_stored_is_said_before_the_first_press(
    played: Played, own_folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], fault: str
) -> None:
    typed = contextlib.nullcontext(lambda: "" if played.now_s < 10.0 else None)
    monkeypatch.setattr(feelahead.commands.controller.command, "typing", lambda **_: typed)
    if fault == "folder":
        own_folder.write_text("in the way")
    else:
        forces_path(ADDRESS).parent.mkdir(parents=True)
        forces_path(ADDRESS).write_text("version = 7")
    with pytest.raises(ConfigurationError, match=str(own_folder)):
        controller(["--measure-forces"], played.backend)
    assert "press" not in capsys.readouterr().out
    assert played.handle.closed == played.handle.times_opened


@pytest.mark.processes
def test_the_triggers_are_released_when_its_process_is_killed(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "hidraw3")
    (tmp_path / "plugged").touch()
    controller = os.open(tmp_path / "hidraw3", os.O_RDWR)
    program = [sys.executable, str(ROOT / "tests/helpers/plugged_operator.py"), str(tmp_path)]
    with subprocess.Popen(
        [*program, "controller", "--pattern", "wall"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
    ) as process:
        try:
            assert max(parse_output_report(os.read(controller, REPORT_LENGTH)).r2 or ()) == MAX_STRENGTH
            assert process.stdout is not None
            # This test itself is a second writer.
            expected = f"({os.getpid()}) holds the controller open for writing, too".encode()
            assert any(expected in line for line in process.stdout)
            process.kill()
            # On a busy machine the wall may have been written again; the guard releases.
            while parse_output_report(os.read(controller, 1 << 16)[-REPORT_LENGTH:]).r2 != FREE_TRIGGER:
                pass
        finally:
            process.kill()
            os.close(controller)
