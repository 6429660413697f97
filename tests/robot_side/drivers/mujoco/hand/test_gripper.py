"""Measurement of a gripper's travel between open and closed, and the gap between the spheres of its fingers."""

from pathlib import Path
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.compiled.kernel import FLOAT64, compiled, output_array, record_array
from robot_side.drivers.mujoco.gripper_measurement import (
    candidate_ends,
    closed_from,
    measure_gripper,
    open_gap,
    resistance,
    rising,
)
from robot_side.drivers.mujoco.hand import gripper_cover
from robot_side.drivers.mujoco.hand.gripper_cover import cover_gripper
from robot_side.drivers.mujoco.hand.gripper_drive import GRIPPER, GripperDrive, advance_gripper
from robot_side.drivers.mujoco.hand.gripper_sweep import ClosingRun
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.gripper.surface_cover import cover_surface
from tests.helpers.arm_models import TENDON_GRIPPER, planar_arm


def test_a_gripper_is_measured_anew_when_the_model_or_its_start_changes(tmp_path: Path) -> None:
    scene = load_scene(planar_arm(tmp_path), "tcp")
    travel = measure_gripper(scene)
    assert measure_gripper(load_scene(planar_arm(tmp_path), "tcp")) is travel
    scene.data.qpos[0] += 0.1
    assert measure_gripper(scene) is not travel
    scene.data.qpos[0] -= 0.1
    scene.model.actuator_gainprm[scene.robot.gripper_actuators[0], 0] *= 2.0
    assert measure_gripper(scene) is not travel


def test_where_inputs_move_nothing_the_last_counts_and_at_the_end_the_first() -> None:
    np.testing.assert_array_equal(rising(np.array([0.0, 0.3, 0.3, 0.25, 0.7, 1.0, 1.0])), [0, 3, 4, 5])
    np.testing.assert_array_equal(rising(np.linspace(0.0, 1.0, 4)), [0, 1, 2, 3])


def test_what_slow_fingers_alone_resist_is_told_from_their_lag() -> None:
    """A drive lags by 0.1 s, and hangs halfway until it leads by 0.2 more."""
    times_s = np.arange(0.0, 1.2, 0.001)
    moved = np.clip(times_s, 0.0, 0.45) + np.clip(times_s - 0.65, 0.0, 0.55)
    references = np.where(moved > 0.0, moved + 0.1, 0.0) + np.where(moved == 0.45, times_s - 0.45, 0.0)
    run = ClosingRun(references, moved, np.gradient(moved, 0.001), 0.001)
    samples = np.linspace(0.0, 1.0, 6)
    lag_s, resists = resistance(run, samples, samples, 0.08 * (1.0 - samples))
    assert lag_s == pytest.approx(0.1, abs=1e-3)
    np.testing.assert_allclose(resists, [0.0, 0.0, 0.25, 0.25, 0.0, 0.0], atol=6e-3)


@pytest.mark.parametrize(("gone_m", "closed"), [(1.0, 0.9875), (0.9, 0.95), (0.6, 0.95)])
def test_fingers_that_meet_beside_the_tool_before_they_have_closed_may_hold_on(gone_m: float, closed: float) -> None:
    closures = np.linspace(0.0, 1.0, 11)
    assert closed_from(closures, np.maximum(0.08 * (1.0 - closures / gone_m), 0.0)) == pytest.approx(closed)


def test_a_servo_lags_by_all_damping(tmp_path: Path) -> None:
    travel = measure_gripper(load_scene(planar_arm(tmp_path), "tcp"))
    assert travel is not None
    # The damping of the servo and of both fingers, for each N/m.
    assert travel.lags_s == pytest.approx((10.0 / 100.0, (10.0 + 2.0 * 10.0) / 100.0), rel=0.2)
    # Of 100 N at 0.0156863 N for each of 255 steps, 25 times the stroke: never reached.
    assert travel.force_lead == pytest.approx(25.0, rel=1e-3)
    assert (travel.open_control.item(), travel.closed_control.item()) == (255.0, 0.0)
    np.testing.assert_allclose(travel.openings_m[[0, -1]], [0.08, 0.0], atol=1e-3)


@compiled(record_array(GRIPPER), output_array(2), FLOAT64, FLOAT64, FLOAT64, FLOAT64)
def advance_one(
    grippers: Any, samples: FloatArray, moving: float, step_s: float, closure: float, closure_speed: float
) -> None:
    advance_gripper(grippers[0], samples, moving, step_s, closure, closure_speed)


def test_what_slips_between_the_fingers_is_held_until_they_close_fast_or_open(tmp_path: Path) -> None:
    travel = measure_gripper(load_scene(planar_arm(tmp_path), "tcp"))
    assert travel is not None
    drive, closure = GripperDrive(travel, stroke_time_s=0.6), 0.4

    def move(speed_1_s: float, duration_s: float, moving: float = 1.0) -> bool:
        nonlocal closure
        for _ in range(round(duration_s / 0.001)):
            closure += 0.001 * speed_1_s
            advance_one(drive.drive, drive.samples, moving, 0.001, closure, speed_1_s)
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
