"""True gripper among true objects, in any pose: for experiments that analyse a motion afterwards."""

import math
from typing import Any, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from robot_side.drivers.mujoco.ground_truth import least_distance
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.true_contact import contact_distance
from robot_side.surroundings.perceived import PerceivedObjects


class ToolPath(NamedTuple):
    """Poses of the tool along a path, so dense that no contact occurs only between two of them."""

    positions_m: FloatArray
    """(k, 3)"""
    rotations: FloatArray
    """(k, 3, 3) tool to world"""


class PosedScene:
    """Geometry of a scene in recorded poses, without simulation."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._data = mujoco.MjData(scene.model)
        self._data.qpos[:] = scene.data.qpos
        self._gripper = scene.robot.gripper_geoms.astype(np.int64)
        self._objects = np.array([geom for thing in scene.objects for geom in thing.geoms], dtype=np.int64)
        bodies = scene.model.geom_bodyid[self._objects]
        self._fixed = self._objects[scene.model.body_weldid[bodies] == 0]
        self._at_rest_m: FloatArray = np.zeros((self._gripper.size, 3))

    def set_pose(self, arm_positions_rad: FloatArray, finger_positions: FloatArray, shift_m: FloatArray) -> None:
        """Set the arm's joints (n,) and the fingers' (f,), and move every object by `shift_m` (3,) from its place."""
        data, robot = self._data, self.scene.robot
        data.qpos[robot.arm_positions] = arm_positions_rad
        data.qpos[robot.finger_positions] = finger_positions
        mujoco.mj_kinematics(self.scene.model, data)
        # With sleeping enabled, MuJoCo does not update the poses of fixed geoms.
        data.geom_xpos[self._fixed] = self.scene.data.geom_xpos[self._fixed]
        data.geom_xpos[self._objects] += shift_m
        self._at_rest_m = data.geom_xpos[self._gripper].copy()

    @property
    def data(self) -> Any:
        """State in the present pose, a mujoco.MjData whose geoms are placed"""
        return self._data

    def tool_pose(self) -> tuple[FloatArray, FloatArray]:
        """Return the tool's position (3,) and rotation (3, 3), tool to world, in the present pose."""
        site = self.scene.robot.site
        return self._data.site_xpos[site].copy(), self._data.site_xmat[site].reshape(3, 3).copy()

    def approach_axis(self) -> FloatArray:
        """Return the tool's approach axis in the present pose: unit vector (3,) in the world frame."""
        return self.tool_pose()[1][:, 2].copy()

    def gap_m(self, farthest_m: float = 1.0) -> float:
        """Return the least distance from the gripper to any object, at most `farthest_m`."""
        return least_distance(self.scene.model, self._data, self._gripper, self._objects, farthest_m)

    def contact_distance_m(self, farthest_m: float) -> float:
        """Return how far the gripper can move along its approach axis until contact, in m; at most `farthest_m`."""
        axis = self.approach_axis()
        contact_distance_m = contact_distance(
            self.scene.model, self._data, self._gripper, self._objects, axis, farthest_m
        )
        self._data.geom_xpos[self._gripper] = self._at_rest_m
        return contact_distance_m

    def stays_clear(self, path: ToolPath, margin_m: float) -> bool:
        """Return whether the gripper stays `margin_m` away from all objects on a path that begins at this pose."""
        data, gripper = self._data, self._gripper
        turns = data.geom_xmat[gripper].reshape(-1, 3, 3).copy()
        turned = path.rotations @ path.rotations[0].T
        lever = self._at_rest_m - path.positions_m[0]
        reach_m = float((np.linalg.norm(lever, axis=1) + self.scene.model.geom_rbound[gripper]).max())
        # Bound of the motion of any part of the gripper from one pose to the next: |ΔR x| <= ‖ΔR‖ |x| / √2.
        steps_m = np.linalg.norm(np.diff(path.positions_m, axis=0), axis=1)
        steps_m += np.linalg.norm(np.diff(turned, axis=0), axis=(1, 2)) * (reach_m / math.sqrt(2.0))
        gone_m = np.concatenate([[0.0], np.cumsum(steps_m)])
        number, clear = 0, True
        while clear and number < len(gone_m):
            data.geom_xpos[gripper] = path.positions_m[number] + lever @ turned[number].T
            data.geom_xmat[gripper] = (turned[number] @ turns).reshape(-1, 9)
            spare_m = self.gap_m(margin_m + float(gone_m[-1] - gone_m[number])) - margin_m
            clear = spare_m >= 0.0
            number = max(number + 1, int(np.searchsorted(gone_m, gone_m[number] + spare_m, side="right")))
        data.geom_xpos[gripper], data.geom_xmat[gripper] = self._at_rest_m, turns.reshape(-1, 9)
        return clear

    def perceived(self, errors_m: FloatArray) -> PerceivedObjects:
        """Return the objects in the present pose, as a camera with errors `errors_m` (k, 3) perceives them (eq. 1)."""
        scene, data = self.scene, self._data
        return scene.primitives.perceived(0.0, scene.roles, errors_m, data.geom_xpos, data.geom_xmat)


def disable_contacts(scene: Scene) -> None:
    """Disable contacts in the simulation: from now on the gripper passes through objects."""
    scene.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
