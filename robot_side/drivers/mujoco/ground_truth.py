"""Ground truth of the simulated world, only for summaries and tests."""

import math
from collections.abc import Iterator
from typing import Any, Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import Role
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.drivers.mujoco.scene import Scene
from robot_side.tick.truth import TargetTruth, Truth

_FARTHEST_SUPPORT_M: Final = 1.0
_FEW: Final = 64
_STILL: Final = 1e-6
"""Largest motion, in rad and m, that hardly changes a truth"""
_HFIELD: Final = int(GeomKind.HFIELD)


class GroundTruth:
    """True distances, contacts and target in a simulation."""

    def __init__(self, scene: Scene, farthest_m: float = 1.0) -> None:
        """farthest_m: distance from the gripper within which objects are looked for."""
        self._scene = scene
        self._farthest_m = farthest_m
        model = scene.model
        self._gripper = {int(geom): model.geom(geom).name or f"geom{geom}" for geom in scene.robot.gripper_geoms}
        self._object_of = {geom: thing.name for thing in scene.objects for geom in thing.geoms}
        self._roles: list[Role] = []
        self._of_roles: dict[tuple[Role, ...], IntArray] = {}
        # Direction that points upwards at the start, in each body's frame.
        self._up: FloatArray = scene.data.xmat[:, 6:].copy()
        self._observed: tuple[list[Role], FloatArray, Truth] | None = None

    def observe(self) -> Truth:
        """Return the true distances and contacts in the simulation's present state; the last one's if nothing moved."""
        data, roles = self._scene.data, list(self._scene.roles.values())
        state = np.concatenate([data.qpos, data.mocap_pos.ravel(), data.mocap_quat.ravel()])
        last = self._observed
        if last is None or last[0] != roles or np.abs(state - last[1]).max(initial=0.0) > _STILL:
            self._observed = last = roles, state, self._observe()
        return last[2]

    def _observe(self) -> Truth:
        to_obstacles = self._distance(self._geoms(Role.OBSTACLE), self._farthest_m)
        to_any = min(to_obstacles, self._distance(self._geoms(Role.TARGET, Role.IGNORED), to_obstacles))
        return Truth(
            min_distance_m=to_any if to_any < self._farthest_m else None,
            min_obstacle_distance_m=to_obstacles if to_obstacles < self._farthest_m else None,
            contacts=self._contacts(),
            target=self.target(),
        )

    def target(self) -> TargetTruth | None:
        """Return the target's true pose and motion in the present state; None without a target."""
        model, data, mine = self._scene.model, self._scene.data, self._geoms(Role.TARGET)
        if not mine.size:
            return None
        gap_m = least_distance(model, data, mine, self._geoms(Role.SUPPORT), _FARTHEST_SUPPORT_M)
        body = int(model.geom_bodyid[mine[0]])
        twist: FloatArray = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
        upright = float(data.xmat[body].reshape(3, 3)[2] @ self._up[body])
        return TargetTruth(
            position_m=data.xpos[body].copy(),
            support_gap_m=gap_m,
            sinking_m_s=-float(twist[5]),
            tilt_rad=math.acos(min(max(upright, -1.0), 1.0)),
        )

    def _geoms(self, *wanted: Role) -> IntArray:
        """Return the geoms of the objects that have these roles now."""
        roles = list(self._scene.roles.values())
        if roles != self._roles:
            # Roles change rarely.
            self._roles, self._of_roles = roles, {}
        if wanted not in self._of_roles:
            geoms = [geom for geom, name in self._object_of.items() if self._scene.roles[name] in wanted]
            self._of_roles[wanted] = np.array(geoms, dtype=np.int64)
        return self._of_roles[wanted]

    def _distance(self, theirs: IntArray, farthest_m: float) -> float:
        """Return the least signed distance, in m, between the gripper and the geoms `theirs`; at most `farthest_m`."""
        mine = np.array(list(self._gripper), dtype=np.int64)
        return least_distance(self._scene.model, self._scene.data, mine, theirs, farthest_m)

    def _contacts(self) -> frozenset[tuple[str, str]]:
        found = set()
        for first, second in self._scene.data.contact.geom:
            for mine, other in ((int(first), int(second)), (int(second), int(first))):
                if mine in self._gripper and other in self._object_of:
                    found.add((self._gripper[mine], self._object_of[other]))
        return frozenset(found)


def least_distance(model: Any, data: Any, mine: IntArray, theirs: IntArray, farthest_m: float) -> float:
    """Return the least signed distance, in m, from any geom of `mine` to any geom of `theirs`; at most `farthest_m`."""
    theirs = _within(model, data, mine, theirs, farthest_m)
    if mine.size == 0 or theirs.size == 0:
        return farthest_m
    apart = np.linalg.norm(data.geom_xpos[mine][:, None] - data.geom_xpos[theirs][None], axis=2)
    # No pair is nearer than its bounding spheres; a plane has none and is always measured.
    bound = np.where(model.geom_rbound[theirs] > 0.0, apart - model.geom_rbound[theirs], -np.inf)
    bound -= model.geom_rbound[mine][:, None]
    nearest = farthest_m
    for pair in _rising(bound.ravel(), farthest_m):
        first, second = np.unravel_index(pair, bound.shape)
        if bound[first, second] >= nearest:
            break
        distance = geom_distance(model, data, int(mine[first]), int(theirs[second]), max(nearest, 0.0))
        nearest = min(nearest, distance)
    return nearest


def _within(model: Any, data: Any, mine: IntArray, theirs: IntArray, farthest_m: float) -> IntArray:
    """Return `theirs` without geoms whose bounding spheres are farther than `farthest_m`; all geoms if they are few."""
    if mine.size == 0 or theirs.size <= _FEW:
        return theirs
    middle = data.geom_xpos[mine].mean(axis=0)
    around_m = (np.linalg.norm(data.geom_xpos[mine] - middle, axis=1) + model.geom_rbound[mine]).max()
    apart = np.linalg.norm(data.geom_xpos[theirs] - middle, axis=1) - model.geom_rbound[theirs]
    near: IntArray = theirs[(apart <= around_m + farthest_m) | (model.geom_rbound[theirs] == 0.0)]
    return near


def _rising(bounds: FloatArray, farthest_m: float) -> Iterator[int]:
    """Yield the indices of the bounds below `farthest_m`, in ascending order of the bounds.

    The least `_FEW` are sorted first, because a caller often needs no more.
    """
    places = np.flatnonzero(bounds < farthest_m)
    if places.size > _FEW:
        first = np.argpartition(bounds[places], _FEW)[:_FEW]
        yield from places[first[np.argsort(bounds[places[first]])]].tolist()
        places = np.delete(places, first)
    yield from places[np.argsort(bounds[places])].tolist()


def geom_distance(
    model: Any, data: Any, mine: int, other: int, farthest_m: float, ends: FloatArray | None = None
) -> float:
    """Return the signed distance of two geoms, at most `farthest_m`.

    ends (6,): filled with the nearest points; not valid for a height field.
    """
    found = mujoco.mj_geomDistance(model, data, mine, other, farthest_m, ends)
    # MuJoCo measures only the first 50 prisms of a height field within the distance, which need not be the nearest.
    while model.geom_type[other] == _HFIELD and 0.0 < found < farthest_m:
        farthest_m, found = found, mujoco.mj_geomDistance(model, data, mine, other, found, ends)
    return float(found)
