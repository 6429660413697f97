from pathlib import Path

import pytest

from common.clock import VirtualClock
from operator_side.calibration.force_measurement import ForceMeasurement, TriggerName
from operator_side.calibration.forces import (
    STRENGTHS,
    ControllerForces,
    TriggerForces,
    forces_path,
    load_forces,
    write_forces,
)
from operator_side.calibration.store import calibration_path
from operator_side.controller.feel import FREE_TRIGGER
from operator_side.controller.state import ControllerState
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.people.measuring_hands import MeasuringHands
from tests.helpers.refusal import refusal

ADDRESS = "aa:bb:cc:00:11:22"
FORCES = TriggerForces((2.0, 2.1, 2.05, 2.3, 2.6, 2.9, 3.2, 3.5, 3.9))
RELEASED, PULLED = ControllerState(), ControllerState(l2=0.6, r2=0.6)


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))


@pytest.mark.parametrize("trigger", ["l2", "r2"])
@pytest.mark.parametrize("step_n", [0.0, 0.1, 0.37])
def test_the_forces_of_a_simulated_trigger_are_found(trigger: TriggerName, step_n: float) -> None:
    device, clock = SimulatedDualSense(strength_step_n=step_n), VirtualClock()
    measurement, hands = ForceMeasurement(trigger), MeasuringHands(device)
    while measurement.result is None:
        assert clock.now() < 120.0
        if line := hands.act(measurement, clock.now()):
            assert measurement.enter(line) is None
        device.write(measurement.feel, clock.now())
        if (state := device.read(clock.now())) is not None:
            measurement.feed(state)
        clock.advance_to(clock.now() + 0.004)
    added_n = [measurement.result.added_n(strength) for strength in range(STRENGTHS)]
    assert added_n == pytest.approx([step_n * strength for strength in range(STRENGTHS)], abs=0.03)
    assert measurement.feel.l2 == measurement.feel.r2 == FREE_TRIGGER


def test_only_a_press_that_began_released_and_yielded_takes_grams() -> None:
    measurement = ForceMeasurement("r2")
    measurement.feed(PULLED)  # Pressed before the measurement began.
    assert "has not yielded yet" in (measurement.enter("200") or "")
    for state in (RELEASED, PULLED, RELEASED):
        measurement.feed(state)
    for wrong in ("nothing", "-5", "nan", "1e9", "200 x", ""):
        assert "valid: grams" in (measurement.enter(wrong) or "")
    assert measurement.enter("210 190,5 900") is None
    assert measurement.strength == 1
    assert max(measurement.feel.r2 or ()) == 1
    assert "has not yielded yet" in (measurement.enter("200") or "")
    assert measurement.enter("back") is None
    assert measurement.strength == 0
    for _ in range(STRENGTHS):
        measurement.feed(RELEASED)
        measurement.feed(PULLED)
        assert measurement.enter("210 190,5 900") is None
    assert measurement.result is not None
    assert measurement.result.pulls_n == pytest.approx((2.0594,) * STRENGTHS, abs=1e-4)


@pytest.mark.parametrize(("share", "least"), [(0.07, 3), (0.02, 1), (0.95, 8), (0.96, None)])
def test_a_strength_counts_as_noticed_if_all_stronger_ones_are(share: float, least: int | None) -> None:
    assert FORCES.least_noticed(share) == least


def test_what_was_stored_is_loaded_for_that_controller_alone() -> None:
    assert load_forces(ADDRESS) == ControllerForces()
    write_forces(forces_path(ADDRESS), ADDRESS, ControllerForces(r2=FORCES))
    assert load_forces(ADDRESS) == ControllerForces(r2=FORCES)
    assert load_forces("aa:bb:cc:00:11:23") == ControllerForces()
    assert forces_path(ADDRESS).parent == calibration_path(ADDRESS).parent
    assert not calibration_path(ADDRESS).exists()


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        (ADDRESS, "aa:bb:cc:00:11:23", "address = 'aa:bb:cc:00:11:23'; valid: aa:bb:cc:00:11:22"),
        ("2.0, ", "", "valid: 9 numbers"),
        ("2.0, ", "0.0, ", "valid: 9 numbers above 0"),
        ("2.0, ", "nan, ", "valid: 9 numbers"),
    ],
)
def test_a_broken_file_is_named_in_one_line_with_what_mends_it(old: str, new: str, named: str) -> None:
    path = forces_path(ADDRESS)
    write_forces(path, ADDRESS, ControllerForces(r2=FORCES))
    path.write_text(path.read_text().replace(old, new, 1))
    said = refusal(load_forces, ADDRESS)
    assert named in said
    assert str(path) in said
    assert "feelahead controller --measure-forces" in said
