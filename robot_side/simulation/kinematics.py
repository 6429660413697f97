"""Where encoder readings put the gripper (eq. 4)."""

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.arm.port import ArmState, GripperPose
from robot_side.gripper.spheres import cover_boxes
from robot_side.simulation.scene import Scene


class MujocoKinematics:
    """GripperKinematics: the gripper where the encoders say it is, in a copy of the state that nobody simulates."""

    def __init__(self, scene: Scene, sphere_count: int = 16) -> None:
        """Cover the gripper's geoms with `sphere_count` spheres, or one for each geom where there are more.

        ConfigurationError when the robot has nothing at the tool that could touch anything.
        """
        self._model, self._robot = scene.model, scene.robot
        model, geoms = scene.model, scene.robot.gripper_geoms
        if geoms.size == 0:
            raise ConfigurationError("model: nothing at the tool can touch anything; valid: 1 or more colliding geoms")
        self._data = mujoco.MjData(model)
        self._data.qpos[:] = scene.data.qpos
        rotations = np.array([_rotation(model.geom_quat[geom]) for geom in geoms])
        # The gripper is covered in the frames of its links, in which its geoms do not move.
        centers = model.geom_pos[geoms] + np.einsum("kij,kj->ki", rotations, model.geom_aabb[geoms, :3])
        cover = cover_boxes(centers, rotations, model.geom_aabb[geoms, 3:], sphere_count)
        self._bodies: IntArray = model.geom_bodyid[geoms][cover.box].astype(np.int64)
        self._local_centers_m = cover.centers_m[:, :, None]
        self._radii_m = cover.radii_m
        self._on_finger = scene.robot.geom_on_finger[cover.box]
        # Every pose shares these two.
        self._radii_m.setflags(write=False)
        self._on_finger.setflags(write=False)
        self._jacobian: FloatArray = np.zeros((6, model.nv))
        self._cross: FloatArray = np.zeros((len(cover.radii_m), 3, 3))

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
        # v_i = v + ω × r_i, written as a product with the matrix that takes ω to -r_i × ω.
        x, y, z = (centers - tool).T
        cross = self._cross
        cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = z, -y, x
        cross[:, 1, 0], cross[:, 2, 0], cross[:, 2, 1] = -z, y, -x
        return GripperPose(
            tool_position_m=tool,
            tool_rotation=data.site_xmat[robot.site].reshape(3, 3).copy(),
            tool_jacobian=jacobian,
            sphere_centers_m=centers,
            sphere_radii_m=self._radii_m,
            sphere_jacobians=jacobian[:3] + cross @ jacobian[3:],
            sphere_on_finger=self._on_finger,
        )


def _rotation(quaternion: FloatArray) -> FloatArray:
    matrix: FloatArray = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
