"""Robot in the poses of its joints at other times than now: its solids, its surface, and where cameras on it are."""

import copy
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, Self

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from common.errors import ConfigurationError
from robot_side.depth.picture import SOLID_NUMBERS, CameraPose, OwnBody
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.drivers.mujoco.robot_model import RobotModel
from robot_side.surroundings.mount import Mount

WORLD: Final = "world"
_SHOWN_GROUPS, _HIDDEN_GROUP = 3, 5
"""Groups of geoms that pictures show, the first ones, and one that they do not"""
_EXACT: Final = (GeomKind.SPHERE, GeomKind.CAPSULE, GeomKind.ELLIPSOID, GeomKind.CYLINDER, GeomKind.BOX)
"""Kinds of geoms that are taken as they are; a mesh counts as its bounding box"""


@dataclass(frozen=True)
class RobotParts:
    """Where a robot is among the arrays of its model; enough for another process."""

    root_body: int
    arm_positions: IntArray
    """(n,) places of the arm's joints in qpos"""
    finger_positions: IntArray
    """(f,) places of the fingers' joints in qpos"""
    site: int

    @classmethod
    def of(cls, robot: RobotModel) -> Self:
        """Return the parts of a robot that was found in its model."""
        return cls(robot.root_body, robot.arm_positions, robot.finger_positions, robot.site)


class PosedRobot:
    """Kinematics of a robot, apart from its simulation."""

    def __init__(self, model: Any, parts: RobotParts, positions: FloatArray) -> None:
        """positions (nq,): qpos of all that is not the robot's."""
        self._model, self._parts = model, parts
        self._data = mujoco.MjData(model)
        self._data.qpos[:] = positions
        geoms = np.flatnonzero(model.body_rootid[model.geom_bodyid] == parts.root_body)
        seen = [geom for geom in geoms.tolist() if model.geom_type[geom] not in (GeomKind.PLANE, GeomKind.HFIELD)]
        self._geoms = np.array(seen, dtype=np.int64)
        kinds, sizes_m = model.geom_type[self._geoms].astype(np.int64), model.geom_size[self._geoms].copy()
        boxed = ~np.isin(kinds, _EXACT)
        kinds[boxed], sizes_m[boxed] = GeomKind.BOX, model.geom_aabb[self._geoms[boxed], 3:]
        self._kinds, self._sizes_m = kinds, sizes_m
        self.held: FloatArray = np.empty((0, 4))
        """(k, 4) spheres of what the gripper holds, in the tool's frame: centres and radii"""
        self.models: FloatArray = np.empty((0, SOLID_NUMBERS))
        """(k, 16) solids of known models, in the world frame"""
        self._middles_m: FloatArray = np.where(boxed[:, None], model.geom_aabb[self._geoms, :3], 0.0)
        """(g, 3) centres of the solids in their geoms' frames"""
        # Rays are to meet nothing but the robot.
        self._alone = copy.copy(model)
        self._alone.geom_group[np.setdiff1d(np.arange(model.ngeom), self._geoms)] = _HIDDEN_GROUP
        self._groups = (np.arange(6) < _SHOWN_GROUPS).astype(np.uint8)

    def pose(self, arm_positions: FloatArray, finger_positions: FloatArray) -> None:
        """Set the arm's joints (n,) and the fingers' (f,)."""
        self._data.qpos[self._parts.arm_positions] = arm_positions
        self._data.qpos[self._parts.finger_positions] = finger_positions
        mujoco.mj_kinematics(self._model, self._data)

    def body(self) -> OwnBody:
        """Return the solids of the robot and of what it holds, in the present pose, and of known models."""
        rotations = self._data.geom_xmat[self._geoms].reshape(-1, 3, 3)
        middles_m = self._data.geom_xpos[self._geoms] + np.einsum("gij,gj->gi", rotations, self._middles_m)
        tool = self.tool_rotation()
        count, models = len(self.held), self.models
        return OwnBody(
            np.concatenate([self._kinds, np.full(count, GeomKind.SPHERE), models[:, 0].astype(np.int64)]),
            np.concatenate([middles_m, self.tool_m() + self.held[:, :3] @ tool.T, models[:, 1:4]]),
            np.concatenate([rotations, np.tile(np.eye(3), (count, 1, 1)), models[:, 4:13].reshape(-1, 3, 3)]),
            np.concatenate([self._sizes_m, np.tile(self.held[:, 3:], (1, 3)), models[:, 13:]]),
            models=len(models),
            held=count,
        )

    def camera(self, link: str, mount: Mount) -> CameraPose:
        """Return the pose of a camera on a link (a body's name), or in the world, in the present pose."""
        body = self._body(link)
        rotation = self._data.xmat[body].reshape(3, 3)
        place_m = self._data.xpos[body] + rotation @ np.array(mount.position_m)
        return CameraPose(place_m, rotation @ mount.axes())

    def surface(self, pose: CameraPose, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return what a camera sees of the robot alone in the present pose, meshes as they are.

        rays (k, 3): directions in the camera's frame with z = 1. Depths (k,), infinite beside the robot, and unit
        normals (k, 3) in the camera's frame.
        """
        count = len(rays)
        geoms, depths_m, normals = np.empty(count, dtype=np.int32), np.empty(count), np.empty(3 * count)
        ways = np.ascontiguousarray(rays @ pose.rotation.T).ravel()
        mujoco.mj_multiRay(
            *(self._alone, self._data, pose.position_m, ways, self._groups, 1, -1, geoms, depths_m, normals),
            *(count, mujoco.mjMAXVAL),
        )
        return np.where(geoms >= 0, depths_m, np.inf), normals.reshape(-1, 3) @ pose.rotation

    def tool_m(self) -> FloatArray:
        """Return the tool's position (3,) in the present pose."""
        position_m: FloatArray = self._data.site_xpos[self._parts.site].copy()
        return position_m

    def tool_rotation(self) -> FloatArray:
        """Return the tool's rotation (3, 3), tool to world, in the present pose."""
        rotation: FloatArray = self._data.site_xmat[self._parts.site].reshape(3, 3).copy()
        return rotation

    def require_links(self, links: Iterable[str]) -> None:
        """Raise ConfigurationError for a link that the model lacks."""
        for link in links:
            self._body(link)

    def _body(self, link: str) -> int:
        body = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_BODY, link)
        if body < 0:
            names = [self._model.body(number).name for number in range(self._model.nbody)]
            raise ConfigurationError(f"link = {link!r}; valid: {', '.join(filter(None, names))}")
        return int(body)
