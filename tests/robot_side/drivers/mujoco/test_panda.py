"""Panda arm (torque motors) with a Robotiq gripper (tendon servo), whose model is from a package unrelated to ours."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from common.roles import Role
from robot_side.drivers.mujoco.camera import MujocoCamera
from robot_side.drivers.mujoco.ground_truth import GroundTruth
from tests.helpers.tool_driver import PERIOD_S, VALID_S, ToolDriver


def asset(name: str) -> Path:
    # The package needs others that are not installed, so it is found and not imported.
    found = importlib.util.find_spec("gym_hil")
    assert found is not None, "the Panda's package is missing: make test installs it"
    assert found.submodule_search_locations is not None
    return Path(found.submodule_search_locations[0]) / "assets" / name


@pytest.fixture(scope="module")
def alone() -> ToolDriver:
    """Scene of the robot's model by itself; each test continues from the state that the last one left."""
    return ToolDriver.load(asset("panda.xml"), "pinch")


def test_the_bare_robot_stands_at_the_built_in_table(alone: ToolDriver) -> None:
    assert alone.arm.joint_count == 7
    drives = alone.scene.robot.drives
    assert not drives.stiffness.any()
    assert not drives.damping.any()
    assert alone.scene.roles["target"] is Role.TARGET
    assert alone.scene.warnings == ()
    tool, target = alone.tool_m(), alone.scene.data.body("table_scene/target").xpos
    np.testing.assert_allclose(target[:2] - tool[:2], [0.23, 0.0], atol=1e-3)
    assert len(MujocoCamera(alone.scene).perceive(0.0).box_object) == 6
    state = alone.arm.state(alone.now_s)
    pose = alone.pose(state)
    assert 100 < len(pose.sphere_radii_m) < 2000
    assert pose.sphere_on_finger.sum() >= 50
    # No sphere is far from the tool.
    assert np.linalg.norm(pose.sphere_centers_m - pose.tool_position_m, axis=1).max() < 0.2


def test_a_face_of_the_target_is_turned_to_the_fingers(alone: ToolDriver) -> None:
    data = alone.scene.data
    closing = data.geom("left_pad1").xpos - data.geom("right_pad1").xpos
    [geom] = (thing.geoms[0] for thing in alone.scene.objects if thing.name == "target")
    along = closing[:2] @ data.geom_xmat[geom].reshape(3, 3)[:2, :2] / np.linalg.norm(closing[:2])
    assert np.abs(along).max() > 0.99


@pytest.mark.parametrize("velocity_m_s", [(0.1, 0.0, 0.0), (0.0, 0.12, 0.0), (-0.06, 0.05, -0.05)])
def test_the_tool_moves_as_asked_and_stops_when_nobody_asks(
    alone: ToolDriver, velocity_m_s: tuple[float, float, float]
) -> None:
    wanted = np.array(velocity_m_s)
    path = alone.move(np.concatenate([wanted, np.zeros(3)]), 0.8)
    steady = (path[-1] - path[100]) / (PERIOD_S * (len(path) - 101))
    assert np.linalg.norm(steady - wanted) < 0.01 * np.linalg.norm(wanted)

    last = path[-1]
    state = alone.wait(1.0)
    travelled = float(np.linalg.norm(alone.tool_m() - last))
    assert np.abs(state.joint_velocities_rad_s).max() < 1e-3
    assert travelled < np.linalg.norm(wanted) * VALID_S + 0.01
    alone.go_to(path[0], 1.5)


def test_it_picks_up_the_block_of_its_own_scene() -> None:
    driver = ToolDriver.load(asset("scene.xml"), "pinch")
    # The marker named target cannot be touched and is no object.
    assert driver.scene.roles == {"floor": Role.SUPPORT, "block": Role.OBSTACLE}
    block = driver.scene.data.body("block")
    driver.go_to(np.array([0.5, 0.0, 0.2]), 2.0)
    driver.go_to(np.array([0.5, 0.0, 0.03]), 2.0)
    state = driver.grip(1.0, 1.2)
    assert state.gripper_holding
    assert 0.02 < state.gripper_opening_m < 0.06
    driver.go_to(np.array([0.5, 0.0, 0.2]), 2.0)
    assert block.xpos[2] > 0.15
    assert {name for _, name in driver.contacts} == {"block"}
    distance_m = GroundTruth(driver.scene).observe().min_distance_m
    assert distance_m is not None
    assert distance_m < 1e-3
