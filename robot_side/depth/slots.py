"""A fixed pool of objects for the map's boxes, of which only the changes are handed on.

Each slot is an object `surface 0` to `surface n - 1` of one box. Unused slots are parked far away, with volume: a box
without volume would make a scene's table be built anew. The process of the map calls `update`, that of the law `apply`.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from common.roles import ROLES, Role
from robot_side.depth.boxes import Boxes
from robot_side.surroundings.kinds.layout import NUMBERS
from robot_side.surroundings.movers import Movers
from robot_side.surroundings.perceived import PerceivedObjects

_PARKED_M: Final = -1000.0
"""Height of unused slots"""
_PARKED_HALF_M: Final = 0.005
_SIZES: Final = slice(12, 15)
BOX_NUMBERS: Final = 15
"""Centre (3), rotation by rows (9) and half sizes (3)"""


@dataclass(frozen=True, eq=False)
class SlotChanges:
    """Slots that hold another box than before."""

    slots: IntArray
    """(c,) numbers of the slots, rising"""
    numbers: FloatArray
    """(c, 15) centres, rotations by rows, half sizes"""
    roles: IntArray
    """(c,) indices in ROLES"""
    sds_m: FloatArray
    """(c,) standard deviation of a pixel that made the surface; 0 for unused slots"""
    crowded_out: int
    """Boxes for which there was no slot: those furthest from the gripper"""


class Slots:
    """Pool of slots."""

    def __init__(self, count: int) -> None:
        """count: number of slots."""
        none = np.empty(0, dtype=np.int64)
        self._numbers, self._roles, self.sds_m = _unused(count)
        """(n,) standard deviation of a pixel that made each slot's surface; 0 for unused slots"""
        self._ids: IntArray = np.full(count, -1)
        self._frame_roles: tuple[Role, ...] = (Role.OBSTACLE,) * count
        first = PerceivedObjects(
            time_s=0.0,
            names=tuple(f"surface {number}" for number in range(count)),
            roles=self._frame_roles,
            sphere_centers_m=np.empty((0, 3)),
            sphere_radii_m=np.empty(0),
            sphere_object=none,
            box_centers_m=self._numbers[:, :3].copy(),
            box_rotations=self._numbers[:, 3:12].reshape(-1, 3, 3).copy(),
            box_half_sizes_m=self._numbers[:, _SIZES].copy(),
            box_object=np.arange(count),
            tetrahedron_vertices_m=np.empty((0, 4, 3)),
            tetrahedron_object=none,
            half_space_normals=np.empty((0, 3)),
            half_space_offsets_m=np.empty(0),
            half_space_object=none,
            positions_m=self._numbers[:, :3].copy(),
            rotations=self._numbers[:, 3:12].reshape(-1, 3, 3).copy(),
            velocities_m_s=np.zeros((count, 3)),
        )
        self._movers = Movers(first, np.arange(count))
        self._frame_numbers = np.zeros((2 * count, NUMBERS))
        self._write(np.arange(count))

    @property
    def first(self) -> PerceivedObjects:
        """Frame with all slots unused: the complete frame that each later one changes"""
        return self._movers.first

    def update(self, boxes: Boxes, near_m: FloatArray) -> SlotChanges:
        """Give each box a slot, which it keeps as long as it is there, and return what changed.

        near_m (3,): the gripper's place; if there are too many boxes, those nearest to it get slots. A box without a
        role is an obstacle.
        """
        chosen = np.arange(len(boxes.ids))
        if len(chosen) > len(self._ids):
            chosen = np.sort(np.argsort(_distances(boxes, near_m), kind="stable")[: len(self._ids)])
        ids = boxes.ids[chosen]
        slots = np.flatnonzero(self._ids >= 0)
        gone = slots[~np.isin(self._ids[slots], ids)]
        self._ids[gone] = -1
        new = np.flatnonzero(~np.isin(ids, self._ids))
        # Boxes of neighbouring numbers are neighbours, and a scene's blocks are of neighbouring slots.
        self._ids[np.flatnonzero(self._ids < 0)[: len(new)]] = ids[new]
        used = np.flatnonzero(self._ids >= 0)
        order = np.argsort(ids, kind="stable")
        rows = chosen[order[np.searchsorted(ids[order], self._ids[used])]]
        numbers, roles, sds_m = _unused(len(self._ids))
        rotations = boxes.rotations[rows].reshape(len(rows), 9)
        numbers[used] = np.concatenate([boxes.centers_m[rows], rotations, boxes.half_sizes_m[rows]], axis=1)
        given = boxes.roles[rows]
        roles[used] = np.where(given < 0, roles[used], given)
        sds_m[used] = boxes.sds_m[rows]
        same = (numbers == self._numbers).all(axis=1) & (roles == self._roles) & (sds_m == self.sds_m)
        changed = np.flatnonzero(~same)
        self._numbers, self._roles, self.sds_m = numbers, roles, sds_m
        crowded_out = len(boxes.ids) - len(chosen)
        return SlotChanges(changed, numbers[changed], roles[changed], sds_m[changed], crowded_out)

    def whole(self) -> SlotChanges:
        """Return all slots as changes, for a process that has just started."""
        return SlotChanges(np.arange(len(self._ids)), self._numbers, self._roles, self.sds_m, 0)

    def apply(self, changes: SlotChanges, time_s: float) -> PerceivedObjects:
        """Take over these changes and return the frame of that time.

        ValueError for numbers of slots or roles that do not exist, for numbers of another shape, and for NaN.
        """
        count, slots = len(self._ids), changes.slots
        if slots.size and (slots.min() < 0 or slots.max() >= count):
            raise ValueError(f"slots = {slots.min()} to {slots.max()}; valid: 0 to {count - 1}")
        if changes.roles.size and (changes.roles.min() < 0 or changes.roles.max() >= len(ROLES)):
            raise ValueError(f"roles = {changes.roles.min()} to {changes.roles.max()}; valid: 0 to {len(ROLES) - 1}")
        if changes.numbers.shape != (len(slots), BOX_NUMBERS):
            raise ValueError(f"numbers has the shape {changes.numbers.shape}; valid: {(len(slots), BOX_NUMBERS)}")
        require_finite("numbers", changes.numbers)
        self._numbers[slots], self.sds_m[slots] = changes.numbers, changes.sds_m
        if (self._roles[slots] != changes.roles).any():
            self._roles[slots] = changes.roles
            self._frame_roles = tuple(ROLES[role] for role in self._roles)
        # Frames hold their numbers, so that an older one stays as it was.
        self._frame_numbers = self._frame_numbers.copy()
        self._write(slots)
        return self._movers.frame(time_s, self._frame_numbers, self._frame_roles)

    def _write(self, slots: IntArray) -> None:
        self._frame_numbers[slots, :BOX_NUMBERS] = self._numbers[slots]
        self._frame_numbers[len(self._ids) + slots, : _SIZES.start] = self._numbers[slots, : _SIZES.start]


def _unused(count: int) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return numbers (n, 15), roles (n,) and errors (n,) of slots without a box."""
    parked = np.array([0.0, 0.0, _PARKED_M, *np.eye(3).ravel(), *(_PARKED_HALF_M,) * 3])
    return np.tile(parked, (count, 1)), np.full(count, ROLES.index(Role.OBSTACLE)), np.zeros(count)


def _distances(boxes: Boxes, near_m: FloatArray) -> FloatArray:
    """Return the distance (n,) of each box from a point; 0 inside."""
    local = np.einsum("nij,ni->nj", boxes.rotations, near_m - boxes.centers_m)
    away: FloatArray = np.linalg.norm(np.maximum(np.abs(local) - boxes.half_sizes_m, 0.0), axis=1)
    return away
