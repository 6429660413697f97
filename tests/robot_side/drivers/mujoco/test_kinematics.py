from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.arm.port import ArmState
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.scene import load_scene
from tests.helpers.arm_models import planar_arm
from tests.helpers.tool_driver import PERIOD_S, ToolDriver

# Joints that share a link, slide, stand off its origin and begin elsewhere than at 0; links turned, by hand (a mocap
# body) or by a joint that no motor moves.
ODD_ARM = """
<mujoco>
  <worldbody>
    <body name="carried" mocap="true" pos="0.3 -0.2 0.4" euler="10 20 30">
      <geom size="0.05"/>
      <body name="first" pos="0.1 0 0.2" euler="0 40 0">
        <joint name="a" axis="1 2 3" pos="0.05 -0.1 0.02" ref="20"/>
        <joint name="b" type="slide" axis="0 1 1" ref="0.1"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.03"/>
        <body name="pendulum" pos="0 0.1 0.1">
          <joint type="ball"/><geom pos="0 0 -0.1" size="0.03"/>
          <body name="its_end" pos="0 0 -0.2" euler="0 0 50"><geom size="0.02"/></body>
        </body>
        <body name="bracket" pos="0 0 0.3" euler="90 0 0">
          <geom size="0.02" pos="0.02 0 0"/>
          <body name="second" pos="0 0.1 0">
            <joint name="c" axis="0 0 1" pos="0 -0.05 0"/>
            <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02"/>
            <body name="finger" pos="0.25 0 0" quat="1 2 3 4">
              <joint name="d" type="slide" axis="1 0 0" ref="0.01"/><joint name="e" axis="0 1 0" pos="0.01 0 0"/>
              <geom type="box" size="0.01 0.02 0.03" pos="0 0 0.02"/>
            </body>
            <site name="end" pos="0.3 0.01 0.02" euler="15 25 35"/>
          </body>
        </body>
      </body>
    </body>
    <body name="thing" pos="1 0 0"><freejoint/><geom size="0.1"/></body>
  </worldbody>
  <actuator><motor joint="a"/><motor joint="b"/><motor joint="c"/><motor joint="e"/></actuator>
</mujoco>"""


@pytest.mark.parametrize("robot", ["built-in", "odd", "planar"])
def test_every_link_stands_and_moves_as_in_mujoco(robot: str, tmp_path: Path) -> None:
    (tmp_path / "odd.xml").write_text(ODD_ARM)
    robots: dict[str, tuple[Path | None, str | None]] = {
        "built-in": (None, None),
        "odd": (tmp_path / "odd.xml", "end"),
        "planar": (planar_arm(tmp_path), "tcp"),
    }
    scene = load_scene(*robots[robot])
    own = MujocoKinematics(scene)
    model, parts, random = scene.model, scene.robot, np.random.default_rng(4)
    data, jacobian = mujoco.MjData(model), np.zeros((6, model.nv))
    data.qpos[:] = scene.data.qpos
    bodies = np.flatnonzero(model.body_rootid == parts.root_body)
    for _ in range(100):
        data.qpos[parts.arm_positions] = random.uniform(-4.0, 4.0, len(parts.arm_positions))
        data.qpos[parts.finger_positions] = random.uniform(-1.0, 1.0, len(parts.finger_positions))
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], parts.site)
        arm, fingers = data.qpos[parts.arm_positions], data.qpos[parts.finger_positions]
        pose = own.pose(ArmState(0.0, arm, np.zeros_like(arm), fingers, 0.0, gripper_holding=False))
        np.testing.assert_allclose(pose.tool_position_m, data.site_xpos[parts.site], atol=1e-12)
        np.testing.assert_allclose(pose.tool_rotation.ravel(), data.site_xmat[parts.site], atol=1e-12)
        np.testing.assert_allclose(pose.tool_jacobian, jacobian[:, parts.arm_velocities], atol=1e-12)
        there = np.concatenate([data.xpos[bodies], data.xquat[bodies]], axis=1)
        np.testing.assert_allclose(own.body_poses(bodies), there, atol=1e-12)
        links = data.xmat[own.cover.bodies].reshape(-1, 3, 3)
        centers = data.xpos[own.cover.bodies] + np.einsum("mij,mj->mi", links, own.cover.centers_m)
        np.testing.assert_allclose(in_order(pose.sphere_centers_m), in_order(centers), atol=1e-12)


def in_order(points: FloatArray) -> FloatArray:
    ordered: FloatArray = points[np.lexsort(points.round(9).T)]
    return ordered


def test_a_pose_that_was_handed_out_stays_as_it_is() -> None:
    driver = ToolDriver.load(encoder=Encoder(0.0, 0.0))
    pose = driver.pose(driver.wait(PERIOD_S))
    arrays = pose.tool_position_m, pose.tool_rotation, pose.tool_jacobian, pose.sphere_centers_m
    before = [array.copy() for array in arrays]
    driver.move(np.array([0.1, 0.1, -0.05, 0.2, 0.1, 0.3]), 0.1)
    for array, was in zip(arrays, before, strict=True):
        np.testing.assert_array_equal(array, was)


@pytest.mark.parametrize(("joints", "fingers"), [(5, 2), (7, 2), (6, 1), (6, 0)])
def test_readings_of_other_joints_are_refused(joints: int, fingers: int) -> None:
    state = ArmState(0.0, np.zeros(joints), np.zeros(joints), np.zeros(fingers), 0.0, gripper_holding=False)
    with pytest.raises(ValueError, match=f"{joints} joint readings of the arm and {fingers} of .* valid: 6 and 2"):
        MujocoKinematics(load_scene()).pose(state)


def test_nothing_at_the_tool_is_told(tmp_path: Path) -> None:
    bare = """<mujoco><worldbody><body><joint name="j"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <site name="end"/></body><body name="box"><geom size="0.1"/></body></worldbody>
      <actuator><motor joint="j"/></actuator></mujoco>"""
    (tmp_path / "bare.xml").write_text(bare)
    with pytest.raises(ConfigurationError, match="no geom of the gripper can touch"):
        MujocoKinematics(load_scene(tmp_path / "bare.xml", "end"))
