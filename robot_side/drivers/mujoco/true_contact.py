"""True contacts of the gripper and a held object: onset, closing speed and free gap; only for experiments."""

from collections.abc import Callable, Sequence
from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from common.roles import Role
from robot_side.drivers.mujoco.ground_truth import geom_distance, least_distance
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.drivers.mujoco.scene import Scene
from robot_side.tick.truth import ContactOnset

_TOUCHING_M = 1e-5
_MOST_STEPS = 200


class TrueContact:
    """Observer of a scene's contacts from turn to turn; it does not change the simulation."""

    def __init__(self, scene: Scene, *, supports: bool = True) -> None:
        """supports: whether contacts with supports count."""
        self._scene = scene
        self._model, self._data = scene.model, scene.data
        self._object_of = {
            geom: thing.name
            for thing in scene.objects
            if supports or scene.roles[thing.name] is not Role.SUPPORT
            for geom in thing.geoms
        }
        self._gripper = frozenset(int(geom) for geom in scene.robot.gripper_geoms)
        self._ours: tuple[str | None, BoolArray] = None, self._geoms_of(None)
        # These two are not simulated: the state before the last step, and a copy for hypothetical motions.
        self._before = mujoco.MjData(self._model)
        self._thought = mujoco.MjData(self._model)
        self._held: str | None = None
        self._touched = frozenset(self._object_of[theirs] for _, _, theirs, _ in self._touching(None))
        self._remember()

    def update(self, held: str | None) -> ContactOnset | None:
        """Return the new contact with the greatest closing speed since the last call; None without a new contact.

        held: object that the gripper holds, which counts as a part of the gripper.
        """
        if self._data.time == self._seen_s:
            return None
        touching = self._touching(held)
        # Known contacts are not new; neither are those of an object that was just gripped.
        names = frozenset(self._object_of[theirs] for _, _, theirs, _ in touching)
        known = self._touched if held == self._held else names
        new = [pair for pair in touching if self._object_of[pair[2]] not in known]
        found = self._onsets(new) if new else []
        self._touched, self._held = names, held
        self._remember()
        return max(found, key=lambda onset: onset.closing_speed_m_s, default=None)

    def approach(self) -> tuple[FloatArray, float]:
        """Return the tool's approach axis, a unit vector (3,) in the world, and its true speed along it in m/s."""
        site = self._scene.robot.site
        axis: FloatArray = self._data.site_xmat[site].reshape(3, 3)[:, 2].copy()
        twist: FloatArray = np.zeros(6)
        mujoco.mj_objectVelocity(self._model, self._data, mujoco.mjtObj.mjOBJ_SITE, site, twist, 0)
        return axis, float(twist[3:] @ axis)

    @property
    def touched(self) -> frozenset[str]:
        """Objects that the gripper or the held object touched at the last `update`"""
        return self._touched

    def gap_m(self, held: str | None, farthest_m: float = 1.0) -> float:
        """Return the least distance from the gripper to any object that it does not hold, at most `farthest_m`."""
        mine, theirs = self._parts(held)
        return least_distance(self._model, self._data, mine, theirs, farthest_m)

    def way_left_m(self, direction: FloatArray, held: str | None, farthest_m: float = 1.0) -> float:
        """Return the `contact_distance` of the gripper, with the object `held`, along the unit vector `direction`."""
        model, thought = self._model, self._thought
        thought.qpos[:] = self._data.qpos
        mujoco.mj_kinematics(model, thought)
        mine, theirs = self._parts(held)
        return contact_distance(model, thought, mine, theirs, direction, farthest_m)

    def _parts(self, held: str | None) -> tuple[IntArray, IntArray]:
        carried = [geom for geom, name in self._object_of.items() if name == held]
        others = [geom for geom, name in self._object_of.items() if name != held]
        return np.array([*self._gripper, *carried], dtype=np.int64), np.array(others, dtype=np.int64)

    def _geoms_of(self, held: str | None) -> BoolArray:
        """Return whether each geom belongs to the gripper or to the held object."""
        ours = np.zeros(self._model.ngeom, dtype=bool)
        ours[[*self._gripper, *(geom for geom, name in self._object_of.items() if name == held)]] = True
        return ours

    def _touching(self, held: str | None) -> list[tuple[Any, int, int, float]]:
        if self._ours[0] != held:
            self._ours = held, self._geoms_of(held)
        contacts = self._data.contact
        # Checking each contact takes as long as a step of the physics, and most are not the gripper's.
        rows = np.flatnonzero(self._ours[1][contacts.geom].any(axis=1))
        return [pair for row in rows if (pair := self._pair(contacts[row], held)) is not None]

    def _pair(self, contact: Any, held: str | None) -> tuple[Any, int, int, float] | None:
        """Return contact, our geom, other geom, and the sign that turns the normal to the other; None if not ours."""
        first, second = (int(geom) for geom in contact.geom)
        for mine, theirs, sign in ((first, second, 1.0), (second, first, -1.0)):
            thing = self._object_of.get(theirs)
            ours = mine in self._gripper or (held is not None and self._object_of.get(mine) == held)
            if contact.dist <= 0.0 and ours and thing is not None and thing != held:
                return contact, mine, theirs, sign
        return None

    def _onsets(self, touching: list[tuple[Any, int, int, float]]) -> list[ContactOnset]:
        model, before = self._model, self._before
        mujoco.mj_kinematics(model, before)
        mujoco.mj_comPos(model, before)
        mujoco.mj_comVel(model, before)
        onsets = []
        for contact, mine, theirs, sign in touching:
            # A contact's normal points from its first geom to its second.
            normal, point = sign * np.asarray(contact.frame[:3]), np.asarray(contact.pos)
            closing = (self._velocity(mine, point) - self._velocity(theirs, point)) @ normal
            part = model.geom(mine).name or f"geom{mine}"
            onsets.append(ContactOnset(self._object_of[theirs], part, float(closing), mine not in self._gripper))
        return onsets

    def _velocity(self, geom: int, point_m: FloatArray) -> FloatArray:
        """Return the velocity (3,) of a geom's body at `point_m` (3,) before the last step, world frame, in m/s."""
        body = int(self._model.geom_bodyid[geom])
        twist: FloatArray = np.zeros(6)
        mujoco.mj_objectVelocity(self._model, self._before, mujoco.mjtObj.mjOBJ_XBODY, body, twist, 0)
        lever: FloatArray = point_m - self._before.xpos[body]
        velocity: FloatArray = twist[3:] + np.cross(twist[:3], lever)
        return velocity

    def _remember(self) -> None:
        self._seen_s = float(self._data.time)
        self._before.qpos[:] = self._data.qpos
        self._before.qvel[:] = self._data.qvel


def contact_distance(
    model: Any, data: Any, mine: IntArray, theirs: IntArray, direction: FloatArray, farthest_m: float
) -> float:
    """Return the distance that geoms `mine` can move along `direction` (3,) until contact with `theirs`.

    The distance is at most `farthest_m`. This moves `mine` in `data`, so pass a copy; its kinematics must be up to
    date.
    """
    start, ends = data.geom_xpos[mine].copy(), np.zeros(6)

    def measure(first: int, second: int) -> tuple[float, float]:
        gap_m = geom_distance(model, data, first, second, farthest_m, ends)
        convex = model.geom_type[second] != GeomKind.HFIELD
        if not (convex and 0.0 < gap_m < farthest_m):
            return gap_m, 1.0
        return gap_m, float((ends[3:] - ends[:3]) @ direction) / gap_m

    def move(moved_m: float) -> None:
        data.geom_xpos[mine] = start + moved_m * direction

    pairs = [(first, second) for first in mine.tolist() for second in theirs.tolist()]
    return advanced_m(pairs, measure, move, farthest_m)


def advanced_m(
    pairs: Sequence[tuple[int, int]],
    measure: Callable[[int, int], tuple[float, float]],
    move: Callable[[float], None],
    farthest_m: float,
) -> float:
    """Return how far `move` can go, at most `farthest_m`, until a pair touches (conservative advancement).

    measure: returns a pair's gap in m, and the share of the motion that goes across a slab of the gap's width, which
    separates convex solids; 1 for others.
    """
    moved_m = 0.0
    for _ in range(_MOST_STEPS):
        step_m = farthest_m - moved_m
        for first, second in pairs:
            gap_m, towards = measure(first, second)
            if gap_m <= _TOUCHING_M:
                return moved_m
            if towards * step_m > gap_m:
                step_m = gap_m / towards
        moved_m += step_m
        if moved_m >= farthest_m:
            return farthest_m
        move(moved_m)
    return moved_m
