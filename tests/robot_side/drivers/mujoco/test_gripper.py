"""Measurement of a gripper's travel between open and closed, and the gap between the spheres of its fingers."""

from pathlib import Path
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.compiled.kernel import FLOAT64, compiled, output_array, record_array
from robot_side.drivers.mujoco import gripper_cover
from robot_side.drivers.mujoco.gripper_cover import cover_gripper
from robot_side.drivers.mujoco.gripper_drive import GRIPPER, GripperDrive, advance_gripper
from robot_side.drivers.mujoco.gripper_measurement import (
    GripperSweep,
    candidate_ends,
    jaw_pairs,
    measure_gripper,
    open_gap,
    travel_from_sweep,
)
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.gripper.surface_cover import cover_surface
from tests.helpers.arm_models import TENDON_GRIPPER, planar_arm


def sweep(openings_m: FloatArray, lengths: FloatArray) -> GripperSweep:
    """Return a sweep of a gripper with one finger joint. Of its pairs of parts, one has a constant gap."""
    controls = np.arange(len(lengths), dtype=np.float64)[:, None]
    gaps_m = np.column_stack([openings_m, openings_m + 0.02, np.full(len(lengths), 0.01)])
    return GripperSweep(controls, lengths[:, None], lengths, gaps_m)


@pytest.mark.parametrize("low_is_open", [True, False])
def test_the_wider_end_is_the_open_one(low_is_open: bool) -> None:
    openings = np.array([0.08, 0.05, 0.03, 0.0])
    found = travel_from_sweep(sweep(openings if low_is_open else openings[::-1], np.array([0.0, 0.3, 0.5, 0.8])), 0, 0)
    assert found is not None
    assert (found.open_control.item(), found.closed_control.item()) == ((0.0, 3.0) if low_is_open else (3.0, 0.0))
    np.testing.assert_allclose(found.openings_m, openings)


def test_fingers_that_meet_before_the_inputs_end_keep_a_monotone_travel() -> None:
    found = travel_from_sweep(sweep(np.array([0.08, 0.04, 0.0, 0.0]), np.array([0.0, 0.4, 0.8, 0.8])), 0.0, 0.0)
    assert found is not None
    np.testing.assert_allclose(found.references, [0.0, 1.0 / 3.0, 2.0 / 3.0])
    np.testing.assert_allclose(found.openings_m, [0.08, 0.04, 0.0])
    # A pair that is always 20 mm nearer passes through itself, and grips nothing.
    passing = travel_from_sweep(sweep(np.array([0.06, 0.02, -0.02, -0.02]), np.array([0.0, 0.4, 0.8, 0.8])), 0.0, 0.0)
    assert passing is not None
    np.testing.assert_allclose(passing.openings_m, [0.08, 0.04, 0.0])
    assert travel_from_sweep(sweep(np.full(4, 0.05), np.linspace(0.0, 1.0, 4)), 0.0, 0.0) is None


def test_a_servo_leads_by_its_force_and_lags_by_its_damping(tmp_path: Path) -> None:
    travel = measure_gripper(load_scene(planar_arm(tmp_path), "tcp"))
    assert travel is not None
    # Of 100 N at 0.0156863 N for each of 255 steps, the default share of the stroke is less.
    assert travel.force_lead == 0.3
    assert travel.lag_s == pytest.approx(10.0 / 100.0)
    assert (travel.open_control.item(), travel.closed_control.item()) == (255.0, 0.0)
    np.testing.assert_allclose(travel.openings_m[[0, -1]], [0.08, 0.0], atol=1e-3)


@compiled(record_array(GRIPPER), output_array(2), FLOAT64, FLOAT64, FLOAT64, FLOAT64)
def advance_one(
    grippers: Any, samples: FloatArray, moving: float, step_s: float, length: float, length_speed: float
) -> None:
    advance_gripper(grippers[0], samples, moving, step_s, length, length_speed)


def test_what_slips_between_the_fingers_is_held_until_they_close_fast_or_open(tmp_path: Path) -> None:
    travel = measure_gripper(load_scene(planar_arm(tmp_path), "tcp"))
    assert travel is not None
    drive, closure = GripperDrive(travel, stroke_time_s=0.6), 0.4

    def move(speed_1_s: float, duration_s: float, moving: float = 1.0) -> bool:
        nonlocal closure
        stroke = float(travel.lengths[-1] - travel.lengths[0])
        for _ in range(round(duration_s / 0.001)):
            closure += 0.001 * speed_1_s
            length = float(travel.lengths[0]) + stroke * closure
            advance_one(drive.drive, drive.samples, moving, 0.001, length, stroke * speed_1_s)
        return drive.holding

    assert move(0.0, 0.5)
    assert move(0.5, 0.2)
    assert move(-0.3, 0.2)
    assert not move(1.0 / 0.6, 0.15)
    # Once lost, only fingers that stand hold something again.
    assert not move(0.5, 0.1)
    assert move(0.0, 0.5)
    assert not move(0.0, 0.001, moving=-1.0)


@pytest.mark.parametrize(("name", "said"), [('name="hand" ', "'hand'"), ("", "2")])
def test_a_gripper_of_unknown_range_is_named(name: str, said: str, tmp_path: Path) -> None:
    unlimited = TENDON_GRIPPER.replace('ctrlrange="0 255"', "").replace('name="hand" ', name)
    with pytest.raises(
        ConfigurationError, match=f"{said} has no ctrlrange; valid: the inputs at which the gripper is open and closed"
    ):
        measure_gripper(load_scene(planar_arm(tmp_path, gripper_actuators=unlimited), "tcp"))


def test_two_actuators_may_run_against_each_other() -> None:
    lower, upper = np.array([0.0, -1.0]), np.array([1.0, 0.0])
    ends = [(first.tolist(), last.tolist()) for first, last in candidate_ends(lower, upper)]
    assert ends == [([0.0, -1.0], [1.0, 0.0]), ([0.0, 0.0], [1.0, -1.0])]
    assert len(candidate_ends(np.zeros(1), np.ones(1))) == 1
    assert len(candidate_ends(np.zeros(4), np.ones(4))) == 1


def test_pairs_have_a_finger_and_two_bodies() -> None:
    pairs = jaw_pairs(np.array([7, 8, 9, 10]), np.array([1, 2, 2, 3]), np.array([False, True, True, False]))
    assert pairs == [(8, 7), (9, 7), (10, 8), (10, 9)]


@pytest.mark.parametrize("stand_out_m", [0.001, 0.003, 0.006])
def test_the_spheres_leave_the_gap_between_the_fingers_free_but_for_what_they_stand_out(stand_out_m: float) -> None:
    scene = load_scene()
    cover = cover_gripper(scene.model, scene.robot.gripper_geoms, stand_out_m)
    gaps = open_gap(scene, cover)
    assert gaps is not None
    gap_m, kept_m = gaps
    assert gap_m == pytest.approx(0.085, abs=1e-4)
    assert gap_m - 2.0 * stand_out_m - 1e-6 <= kept_m < gap_m


TWO_LINKS = """<mujoco><worldbody>
  <body><geom type="cylinder" size="0.01 0.01"/></body>
  <body pos="1 0 0"><geom type="ellipsoid" size="0.01 0.012 0.02"/></body>
</worldbody></mujoco>"""


def test_an_interrupted_search_continues_with_the_link_that_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    searches = []

    def search(*shape: Any, **work: Any) -> tuple[FloatArray, FloatArray, float]:
        searches.append(shape)
        if len(searches) == 2:
            raise InterruptedError
        return cover_surface(*shape, **work)

    monkeypatch.setattr(gripper_cover, "cover_surface", search)
    model = mujoco.MjModel.from_xml_string(TWO_LINKS)
    with pytest.raises(InterruptedError):
        cover_gripper(model, np.arange(2), 0.01)
    assert set(cover_gripper(model, np.arange(2), 0.01).bodies.tolist()) == {1, 2}
    assert len(searches) == 3
