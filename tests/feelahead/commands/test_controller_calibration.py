"""`feelahead controller --calibrate`, and how the operator side uses the stored result."""

import math
import os
import signal
from pathlib import Path

import pytest

import operator_side.main
import operator_side.turns
from common.errors import ConfigurationError
from common.loop import process
from feelahead.commands.controller.command import controller
from feelahead.main import command
from operator_side.calibration.forces import ControllerForces, TriggerForces, forces_path, write_forces
from operator_side.calibration.procedure import CalibrationError, Step
from operator_side.calibration.store import calibration_path, load_calibration, read_calibration, write_calibration
from operator_side.controller import connection
from operator_side.controller.feel import RELEASED
from operator_side.controller.state import ControllerState
from operator_side.core import OperatorSide
from operator_side.dualsense.hid.second_writer import SecondWriters
from operator_side.dualsense.reports.output_report import build_output_report
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from tests.feelahead.commands.conftest import Played
from tests.helpers.fake_hid import ADDRESS, FakeBackend, FakeHandle
from tests.helpers.machines.fake_proc import add_process

pytestmark = pytest.mark.usefixtures("own_folder")

MEASURED = TravelCalibration(l2=TriggerTravel(0.1, 0.7))


def willing_hands(now_s: float) -> ControllerState:
    """Return the state of hands that follow a timetable: rest, pull L2 to 0.9, pull R2, turn the sticks, rest."""
    pulled = math.sin(math.pi * now_s) ** 2
    if 2.0 <= now_s < 5.0:
        return ControllerState(l2=0.9 * pulled)
    if 5.0 <= now_s < 8.0:
        return ControllerState(r2=pulled)
    if 8.0 <= now_s < 9.0:
        around = (math.cos(2.0 * math.pi * now_s), math.sin(2.0 * math.pi * now_s))
        return ControllerState(left_stick=around, right_stick=around)
    return ControllerState()


@pytest.fixture
def willing(played: Played) -> Played:
    played.hands = willing_hands
    return played


def test_a_folder_that_cannot_be_made_is_said_before_the_person_begins(
    willing: Played, own_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own_folder.write_text("in the way")
    with pytest.raises(ConfigurationError, match="is no folder that this user may write to"):
        controller(["--calibrate"], willing.backend)
    assert Step.REST.value not in capsys.readouterr().out
    assert willing.handle.closed == willing.handle.times_opened


def test_a_real_controller_is_measured_and_kept_by_its_address(
    willing: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    assert controller(["--calibrate"], willing.backend) == 0
    stored = load_calibration(ADDRESS)
    assert stored is not None
    assert stored.l2.saturation == pytest.approx(0.87, abs=0.01)
    assert stored.r2.saturation == pytest.approx(0.97, abs=0.01)
    said = capsys.readouterr().out
    assert "Pull L2 all the way and let go, three times." in said
    assert str(calibration_path(ADDRESS)) in said
    assert "a full pull reaches 7 of 10 zones" in said
    # Nothing pushed against the fingers, and nothing is left on.
    assert set(willing.handle.written) == {build_output_report(RELEASED)}
    assert willing.handle.closed == willing.handle.times_opened > 0


def test_a_simulated_controller_is_kept_only_where_asked_for(
    tmp_path: Path, own_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(["controller", "--calibrate", "--device", "simulated"]) == 0
    assert "nothing was stored" in capsys.readouterr().out
    assert not own_folder.exists()
    out = tmp_path / "mine.toml"
    assert command(["controller", "--calibrate", "--device", "simulated", "--out", str(out)]) == 0
    _, calibration = read_calibration(out)
    assert calibration.r2 == TriggerTravel(0.03, 0.97)
    assert f"stored: {out}" in capsys.readouterr().out


def test_hands_that_do_not_pull_end_it_and_nothing_is_stored(willing: Played, own_folder: Path) -> None:
    willing.hands = lambda _: ControllerState()
    with pytest.raises(CalibrationError, match="Pull L2"):
        controller(["--calibrate"], willing.backend)
    assert not own_folder.exists()
    assert willing.handle.closed == willing.handle.times_opened > 0


def test_a_controller_that_is_lost_for_long_goes_on_where_it_was(
    willing: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    def hands(now_s: float) -> ControllerState | None:
        """Return `willing_hands`, silent for 90 s from the middle of the pulls on."""
        return None if 3.0 <= now_s < 93.0 else willing_hands(now_s if now_s < 3.0 else now_s - 90.0)

    willing.hands = hands
    assert controller(["--calibrate"], willing.backend) == 0
    said = capsys.readouterr().out
    assert "no new report for 0.15 s" in said
    assert said.count("Pull L2 all the way and let go, three times.") == 1
    stored = load_calibration(ADDRESS)
    assert stored is not None
    assert stored.l2.saturation == pytest.approx(0.87, abs=0.01)


def test_ctrl_c_gives_it_up(willing: Played, own_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    willing.at_turn = lambda: signal.raise_signal(signal.SIGINT) if willing.now_s > 3.0 else None
    assert controller(["--calibrate"], willing.backend) == 1
    assert "given up: nothing was stored" in capsys.readouterr().out
    assert not own_folder.exists()


@pytest.mark.parametrize("out", ["new/mine.toml", "."])
def test_a_place_where_nothing_can_be_written_is_refused_before_anything_is_measured(
    out: str, willing: Played, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigurationError, match=f"--out {out}: is a folder, or lies in a folder that does not exist"):
        controller(["--calibrate", "--out", out], willing.backend)
    assert willing.now_s == 0.0
    assert list(tmp_path.iterdir()) == []


def test_the_controller_that_was_asked_for_is_measured(willing: Played) -> None:
    assert controller(["--calibrate", "--controller", ADDRESS], willing.backend) == 0
    assert load_calibration(ADDRESS) is not None
    assert willing.handle.closed == willing.handle.times_opened


# The operator side


def test_the_operator_side_uses_what_is_given_else_what_is_stored_for_its_controller(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    backend = FakeBackend({0x0CE6: {b"/dev/hidraw3": FakeHandle()}})
    # The priority would be this process's, and stay so.
    monkeypatch.setattr(process, "raise_priority", lambda: False)
    taken: list[TravelCalibration] = []
    monkeypatch.setattr(OperatorSide, "calibrate", lambda _, calibration: taken.append(calibration))

    def run(*arguments: str) -> str:
        options = ["--connect", "tcp://127.0.0.1:9", "--duration", "0.5", "--no-haptics", *arguments]
        operator_side.main.command(options, backend)
        return capsys.readouterr().out

    assert "feelahead controller --calibrate" in run()
    assert taken == [TravelCalibration()]
    write_calibration(calibration_path(ADDRESS), ADDRESS, MEASURED)
    assert str(calibration_path(ADDRESS)) in run()
    given = tmp_path / "given.toml"
    given.write_text("[calibration.l2]\nsaturation = 0.9")
    run("--config", str(given))
    assert taken[1:] == [MEASURED]
    calibration_path(ADDRESS).write_text("version = 7")
    with pytest.raises(ConfigurationError, match="feelahead controller --calibrate"):
        run()


def test_the_operator_side_names_a_second_writer_measured_forces_and_the_controllers_it_does_not_take(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    backend = FakeBackend({0x0CE6: {b"/dev/hidraw93": FakeHandle()}})
    monkeypatch.setattr(process, "raise_priority", lambda: False)
    add_process(tmp_path / "proc", 11, "steam", {"/dev/hidraw93": os.O_RDWR})
    monkeypatch.setattr(operator_side.turns, "SecondWriters", lambda: SecondWriters(tmp_path / "proc"))
    forces = ControllerForces(r2=TriggerForces(tuple(2.0 + 0.2 * strength for strength in range(9))))
    write_forces(forces_path(ADDRESS), ADDRESS, forces)

    def run(address: str) -> str:
        options = ["--connect", "tcp://127.0.0.1:9", "--duration", "0.5", "--no-haptics", "--controller", address]
        operator_side.main.command(options, backend)
        return capsys.readouterr().out

    said = run(ADDRESS)
    assert said.count("steam (11) holds the controller open for writing, too: ") == 1
    assert "measured: R2 yields to 2.0 N without an effect; strengths 1 to 8 add 0.2 0.4 0.6 " in said
    assert f"the controller aa:bb:cc:dd:ee:ff is not connected, only: {ADDRESS}; waiting for a controller" in run(
        "aa:bb:cc:dd:ee:ff"
    )
    forces_path(ADDRESS).write_text("version = 7")
    assert "feelahead controller --measure-forces" in run(ADDRESS)


def test_a_file_that_breaks_while_it_runs_is_said_and_the_defaults_hold(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    handle = FakeHandle()
    backend = FakeBackend({0x0CE6: {b"/dev/hidraw3": handle}})
    write_calibration(calibration_path(ADDRESS), ADDRESS, MEASURED)
    taken: list[TravelCalibration] = []

    def calibrate(_: OperatorSide, calibration: TravelCalibration) -> None:
        """At each loading, store another calibration and unplug the controller; the third time ends the test."""
        taken.append(calibration)
        if len(taken) == 1:
            calibration_path(ADDRESS).write_text("version = 7")
        elif len(taken) == 2:
            write_calibration(calibration_path(ADDRESS), ADDRESS, MEASURED)
        else:
            signal.raise_signal(signal.SIGTERM)
        handle.plugged_in = False

    def controller_lost(_: OperatorSide, now_s: float) -> None:
        del now_s
        handle.plugged_in = True

    monkeypatch.setattr(OperatorSide, "calibrate", calibrate)
    monkeypatch.setattr(OperatorSide, "controller_lost", controller_lost)
    monkeypatch.setattr(connection, "LOOK_PERIOD_S", 0.01)
    options = ["--connect", "tcp://127.0.0.1:9", "--duration", "60", "--no-haptics"]
    assert operator_side.main.command(options, backend) == 0
    assert taken == [MEASURED, TravelCalibration(), MEASURED]
    said = capsys.readouterr().out
    assert said.count(f"{calibration_path(ADDRESS)}: ") == 1
    assert "the controller's travel is read with the default calibration" in said
    assert said.count(f"the controller's calibration: {calibration_path(ADDRESS)}") == 2
