"""Where encoder readings put the gripper (eq. 4)."""

from collections.abc import Callable

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.ahead.tables import BLOCK
from robot_side.arm.port import ArmState, GripperPose
from robot_side.gripper.near_order import near_order
from robot_side.simulation.gripper_cover import cover_gripper
from robot_side.simulation.scene import Scene


class MujocoKinematics:
    """GripperKinematics: the gripper where the encoders say it is, in a copy of the state that nobody simulates."""

    def __init__(self, scene: Scene, stand_out_m: float = 0.003, searching: Callable[[], None] | None = None) -> None:
        """Cover the gripper's geoms with spheres that stand out of them by `stand_out_m` at most.

        searching: called before each search for these, but not for what was found before.
        ConfigurationError when the robot has nothing at the tool that could touch anything.
        """
        self._model, self._robot = scene.model, scene.robot
        model, geoms = scene.model, scene.robot.gripper_geoms
        if geoms.size == 0:
            raise ConfigurationError("model: nothing at the tool can touch anything; valid: 1 or more colliding geoms")
        self._data = mujoco.MjData(model)
        self._data.qpos[:] = scene.data.qpos
        # The gripper is covered in the frames of its links, in which its geoms do not move.
        self.cover = cover_gripper(model, geoms, stand_out_m, searching)
        order = self._near_order(self.cover.bodies, self.cover.centers_m)
        self._bodies = self.cover.bodies[order]
        self._local_centers_m = self.cover.centers_m[order, :, None]
        self._radii_m = self.cover.radii_m[order]
        fingers = model.geom_bodyid[geoms[scene.robot.geom_on_finger]]
        self._on_finger = np.isin(self._bodies, fingers)
        # Every pose shares these two.
        self._radii_m.setflags(write=False)
        self._on_finger.setflags(write=False)
        self._jacobian: FloatArray = np.zeros((6, model.nv))

    def _near_order(self, bodies: IntArray, local_centers_m: FloatArray) -> IntArray:
        """Let spheres that are near each other follow each other: the search looks at several at once."""
        mujoco.mj_kinematics(self._model, self._data)
        rotations = self._data.xmat[bodies].reshape(-1, 3, 3)
        return near_order(self._data.xpos[bodies] + np.einsum("mij,mj->mi", rotations, local_centers_m), BLOCK)

    def body_poses(self, bodies: IntArray) -> FloatArray:
        """Where the newest `pose` put `bodies` (n,) of the robot: positions and quaternions (n, 7), w first."""
        return np.concatenate([self._data.xpos[bodies], self._data.xquat[bodies]], axis=1)

    def pose(self, state: ArmState) -> GripperPose:
        """The gripper at the encoder readings of `state` (eq. 4); the fingers' own motion is not in its Jacobians."""
        model, data, robot = self._model, self._data, self._robot
        data.qpos[robot.arm_positions] = state.joint_positions_rad
        data.qpos[robot.finger_positions] = state.finger_positions
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, self._jacobian[:3], self._jacobian[3:], robot.site)
        jacobian = self._jacobian.take(robot.arm_velocities, axis=1)
        tool = data.site_xpos[robot.site].copy()
        body_rotations = data.xmat[self._bodies].reshape(-1, 3, 3)
        centers = data.xpos[self._bodies] + (body_rotations @ self._local_centers_m)[:, :, 0]
        return GripperPose(
            tool_position_m=tool,
            tool_rotation=data.site_xmat[robot.site].reshape(3, 3).copy(),
            tool_jacobian=jacobian,
            sphere_centers_m=centers,
            sphere_radii_m=self._radii_m,
            sphere_on_finger=self._on_finger,
        )
