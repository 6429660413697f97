import pytest

from robot_side.simulation.gripper_cover import cover_gripper
from robot_side.simulation.gripper_measurement import open_gap
from robot_side.simulation.scene import load_scene


@pytest.mark.parametrize("stand_out_m", [0.001, 0.003, 0.006])
def test_the_spheres_leave_the_gap_between_the_fingers_free_but_for_what_they_stand_out(stand_out_m: float) -> None:
    scene = load_scene()
    cover = cover_gripper(scene.model, scene.robot.gripper_geoms, stand_out_m)
    gaps = open_gap(scene, cover)
    assert gaps is not None
    gap_m, kept_m = gaps
    assert gap_m == pytest.approx(0.085, abs=1e-4)
    assert gap_m - 2.0 * stand_out_m - 1e-6 <= kept_m < gap_m
