"""A fixed pool of objects for the map's boxes, of which only the changes are handed on.

The first slots are pieces of one object, `target`; each other one is an object of one box, `surface 1` to `surface n`.
Unused slots are parked far away, with volume: a box
without volume would make a scene's table be built anew. The process of the map calls `update`, that of the law `apply`.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray, require_finite
from common.roles import ROLES, Role
from robot_side.depth.boxes import Boxes
from robot_side.depth.picture import DepthErrors
from robot_side.depth.surface_errors import surface_sds
from robot_side.depth.together import largest_piece, planes_of
from robot_side.surroundings.age import STILL, Since
from robot_side.surroundings.fixed_objects import joined
from robot_side.surroundings.kinds.layout import NUMBERS
from robot_side.surroundings.movers import Movers
from robot_side.surroundings.perceived import PerceivedObjects, UnknownSpace

_PARKED_M: Final = -1000.0
"""Height of unused slots"""
_PARKED_HALF_M: Final = 0.005
_SPECK_HALF_M: Final = 0.0005
TARGET_NAME: Final = "target"
EXACT: Final = DepthErrors(growth_per_m=0.0)
PIECES: Final = 96
"""Number of boxes of which the target consists at most"""
_TARGET, _IGNORED = ROLES.index(Role.TARGET), ROLES.index(Role.IGNORED)
_SIZES: Final = slice(12, 15)
_VELOCITIES: Final = slice(12, 15)
"""Columns of a box's half sizes, and of an object's velocity"""
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
    """(c,) standard deviation of the surface's place by its pixels' errors; 0 for unused slots"""
    velocities_m_s: FloatArray
    """(c, 3) velocity of the box in the world; that of the whole target for each of its pieces"""
    planes: IntArray
    """(c,) number of the plane of which the box is a piece: that of its first object; -1 for a box that stands alone"""
    crowded_out: int
    """Boxes for which there was no slot: those furthest from the gripper"""
    moved_s: float = math.nan
    """Time at which what moves is there: that of the newest picture of any camera; NaN: that of the frame"""


class Slots:
    """Pool of slots."""

    def __init__(self, count: int, fixed: PerceivedObjects | None = None) -> None:
        """count: number of slots that are objects of their own. fixed: objects behind these that are always there."""
        none, rows = np.empty(0, dtype=np.int64), PIECES + count
        self._numbers, self._roles, self.sds_m = _unused(rows)
        """(n,) standard deviation of each slot's place by its pixels' errors; 0 for unused slots"""
        self._velocities_m_s: FloatArray = np.zeros((rows, 3))
        self.moved_s = math.nan
        """As of the newest changes"""
        self._ids: IntArray = np.full(rows, -1)
        self._planes: IntArray = np.full(rows, -1)
        self._barred: BoolArray = np.zeros(rows, dtype=np.bool_)
        self._frame_roles: tuple[Role, ...] = (Role.OBSTACLE,) * (1 + count)
        self._objects = np.concatenate([np.zeros(PIECES, dtype=np.int64), np.arange(1, 1 + count)])
        """(n,) index of each slot's object"""
        placed = self._numbers[PIECES - 1 :]
        first = PerceivedObjects(
            time_s=0.0,
            names=(TARGET_NAME, *(f"surface {number}" for number in range(1, 1 + count))),
            roles=self._frame_roles,
            sphere_centers_m=np.empty((0, 3)),
            sphere_radii_m=np.empty(0),
            sphere_object=none,
            box_centers_m=self._numbers[:, :3].copy(),
            box_rotations=self._numbers[:, 3:12].reshape(-1, 3, 3).copy(),
            box_half_sizes_m=self._numbers[:, _SIZES].copy(),
            box_object=self._objects,
            tetrahedron_vertices_m=np.empty((0, 4, 3)),
            tetrahedron_object=none,
            half_space_normals=np.empty((0, 3)),
            half_space_offsets_m=np.empty(0),
            half_space_object=none,
            positions_m=placed[:, :3].copy(),
            rotations=placed[:, 3:12].reshape(-1, 3, 3).copy(),
            velocities_m_s=np.zeros((1 + count, 3)),
        )
        self._fixed_roles = () if fixed is None else fixed.roles
        if fixed is not None and fixed.names:
            first = joined(first, fixed)
        self._movers = Movers(first, np.arange(1 + count))
        self._frame_numbers = np.zeros((rows + 1 + count, NUMBERS))
        self._write(np.arange(rows))

    @property
    def first(self) -> PerceivedObjects:
        """Frame with all slots unused: the complete frame that each later one changes"""
        return self._movers.first

    def box_of(self, name: str) -> int | None:
        """Return the number of a box of the object `name`; None if it has none."""
        held = self._ids[self._objects == self.first.names.index(name)] if name in self.first.names else self._ids[:0]
        held = held[held >= 0]
        return int(held[0]) if held.size else None

    def update(
        self,
        boxes: Boxes,
        near_m: FloatArray,
        errors: DepthErrors = EXACT,
        velocities_m_s: FloatArray | None = None,
        moved_s: float = math.nan,
        *,
        holds: bool = False,
    ) -> SlotChanges:
        """Give each box a slot, which it keeps as long as it is there, and return what changed.

        errors: of the cameras. velocities_m_s (n, 3): of the boxes; None: all are at rest. moved_s: as in
        `SlotChanges`.

        holds: whether the gripper holds something. Slots that become free meanwhile stay free: one may be that of the
        held object, and nobody would feel another box in it.

        near_m (3,): the gripper's place; if there are too many boxes, those nearest to it get slots. A box without a
        role is an obstacle; boxes of the target are its pieces; ignored ones get no slot.
        """
        away_m = _distances(boxes, near_m)
        is_piece, of_target = boxes.roles == _TARGET, np.flatnonzero(boxes.roles == _TARGET)
        is_piece[of_target] = largest_piece(boxes, of_target)
        groups = (np.flatnonzero(is_piece), np.flatnonzero(~is_piece & (boxes.roles != _IGNORED)))
        of_planes = planes_of(boxes)
        of_pixels_m = surface_sds(boxes, of_planes, errors)
        numbers, roles, sds_m = _unused(len(self._ids))
        of_boxes_m_s = np.zeros((len(boxes.ids), 3)) if velocities_m_s is None else velocities_m_s
        moving_m_s, planes = np.zeros((len(self._ids), 3)), np.full(len(self._ids), -1)
        left: IntArray = np.empty(0, dtype=np.int64)
        for rows, of_group in zip((slice(0, PIECES), slice(PIECES, None)), groups, strict=True):
            ids, barred = self._ids[rows], self._barred[rows]
            barred &= holds
            room = len(ids) - np.count_nonzero(barred)
            those = np.sort(np.concatenate([of_group, left]))
            chosen = those if len(those) <= room else np.sort(those[np.argsort(away_m[those])[:room]])
            # Pieces for which there is no room are obstacles.
            left = np.setdiff1d(those, chosen)
            _assign(ids, boxes.ids[chosen], barred, holds=holds)
            used = np.flatnonzero(ids >= 0)
            order = np.argsort(boxes.ids[chosen], kind="stable")
            of = chosen[order[np.searchsorted(boxes.ids[chosen][order], ids[used])]]
            rotations = boxes.rotations[of].reshape(len(of), 9)
            numbers[rows][used] = np.concatenate([boxes.centers_m[of], rotations, boxes.half_sizes_m[of]], axis=1)
            given = boxes.roles[of]
            is_none = (given < 0) | ((rows.start == PIECES) & (given == _TARGET))
            roles[rows][used] = np.where(is_none, roles[rows][used], given)
            sds_m[rows][used], moving_m_s[rows][used] = of_pixels_m[of], of_boxes_m_s[of]
            if rows.stop is None:
                planes[rows][used] = _by_first(of_planes[of], self._objects[rows][used])
        pieces = self._ids[:PIECES] >= 0
        _fill_pieces(numbers[:PIECES], pieces)
        # The target moves as one, if most of it does.
        most = np.median(moving_m_s[:PIECES][pieces], axis=0) if pieces.any() else np.zeros(3)
        moving_m_s[:PIECES] = most
        same = (numbers == self._numbers).all(axis=1) & (roles == self._roles) & (sds_m == self.sds_m)
        changed = np.flatnonzero(~same | (planes != self._planes) | (moving_m_s != self._velocities_m_s).any(axis=1))
        self._numbers, self._roles, self.sds_m, self._planes = numbers, roles, sds_m, planes
        self._velocities_m_s, self.moved_s = moving_m_s, moved_s
        return self._changes(changed, len(left))

    def whole(self) -> SlotChanges:
        """Return all slots as changes, for a process that has just started."""
        return self._changes(np.arange(len(self._ids)), 0)

    def _changes(self, slots: IntArray, crowded_out: int) -> SlotChanges:
        return SlotChanges(
            slots,
            self._numbers[slots],
            self._roles[slots],
            self.sds_m[slots],
            self._velocities_m_s[slots],
            self._planes[slots],
            crowded_out,
            self.moved_s,
        )

    def apply(self, changes: SlotChanges) -> None:
        """Take over these changes.

        ValueError for numbers of slots or roles that do not exist, for numbers of another shape, and for NaN.
        """
        count, slots = len(self._ids), changes.slots
        if slots.size and (slots.min() < 0 or slots.max() >= count):
            raise ValueError(f"slots = {slots.min()} to {slots.max()}; valid: 0 to {count - 1}")
        if changes.roles.size and (changes.roles.min() < 0 or changes.roles.max() >= len(ROLES)):
            raise ValueError(f"roles = {changes.roles.min()} to {changes.roles.max()}; valid: 0 to {len(ROLES) - 1}")
        if changes.numbers.shape != (len(slots), BOX_NUMBERS):
            raise ValueError(f"numbers has the shape {changes.numbers.shape}; valid: {(len(slots), BOX_NUMBERS)}")
        if changes.velocities_m_s.shape != (len(slots), 3):
            raise ValueError(f"velocities_m_s has the shape {changes.velocities_m_s.shape}; valid: {(len(slots), 3)}")
        require_finite("numbers", changes.numbers)
        require_finite("velocities_m_s", changes.velocities_m_s)
        if changes.planes.size and not -1 <= changes.planes.min() <= changes.planes.max() <= self._objects[-1]:
            valid = f"valid: -1 to {self._objects[-1]}"
            raise ValueError(f"planes = {changes.planes.min()} to {changes.planes.max()}; {valid}")
        self._numbers[slots], self.sds_m[slots], self._planes[slots] = changes.numbers, changes.sds_m, changes.planes
        self._velocities_m_s[slots], self.moved_s = changes.velocities_m_s, changes.moved_s
        if (self._roles[slots] != changes.roles).any():
            self._roles[slots] = changes.roles
            of_target = Role.TARGET if (self._roles[:PIECES] == _TARGET).any() else Role.OBSTACLE
            self._frame_roles = (of_target, *(ROLES[role] for role in self._roles[PIECES:].tolist()))
        # Frames hold their numbers, so that an older one stays as it was.
        self._frame_numbers = self._frame_numbers.copy()
        self._write(slots)

    @property
    def moves(self) -> bool:
        """Whether anything moves"""
        return bool(self._velocities_m_s.any())

    def frame(
        self, time_s: float, of_slots_m: FloatArray, known: Since = STILL, unknown: UnknownSpace | None = None
    ) -> PerceivedObjects:
        """Return the frame of all changes so far. of_slots_m (n,): σ_c of each slot.

        known: what is known of the motion since the pictures; what moves is carried on by its velocity. unknown: as in
        a frame.
        """
        fixed = len(self._fixed_roles)
        sds_m = np.concatenate([[of_slots_m[:PIECES].max()], of_slots_m[PIECES:], np.zeros(fixed)])
        # The target is an object by itself.
        surfaces = np.concatenate([[-1], self._planes[PIECES:], np.full(fixed, -1)])
        numbers, late_s = self._frame_numbers, 0.0
        if self.moves:
            moving = np.flatnonzero(self._velocities_m_s.any(axis=1))
            own = moving[(moving == 0) | (moving >= PIECES)]
            numbers, late_s = numbers.copy(), known.late_s
            for rows, of in ((moving, moving), (len(self._ids) + self._objects[own], own)):
                numbers[rows, :3] += known.carried_s * self._velocities_m_s[of]
        roles = self._frame_roles + self._fixed_roles
        return self._movers.frame(time_s, numbers, roles, known.unseen_m, late_s, sds_m, surfaces, unknown)

    def _write(self, slots: IntArray) -> None:
        self._frame_numbers[slots, :BOX_NUMBERS] = self._numbers[slots]
        # An object's own frame is that of its first box.
        own = slots[(slots == 0) | (slots >= PIECES)]
        rows = len(self._ids) + self._objects[own]
        self._frame_numbers[rows, : _SIZES.start] = self._numbers[own, : _SIZES.start]
        self._frame_numbers[rows, _VELOCITIES] = self._velocities_m_s[own]


def _assign(held: IntArray, ids: IntArray, barred: BoolArray, *, holds: bool) -> None:
    """Let boxes `ids` have slots, in place: each keeps its own, and new ones get the first that are free.

    barred: slots that nobody gets; with `holds` those that become free are barred, too.
    """
    slots = np.flatnonzero(held >= 0)
    gone = slots[~np.isin(held[slots], ids)]
    held[gone] = -1
    barred[gone] |= holds
    new = np.flatnonzero(~np.isin(ids, held))
    # Boxes of neighbouring numbers are neighbours, and a scene's blocks are of neighbouring slots.
    free = np.flatnonzero((held < 0) & ~barred)[: len(new)]
    held[free] = ids[new[: len(free)]]


def _by_first(planes: IntArray, objects: IntArray) -> IntArray:
    """Return the number of each box's plane (n,) by its first object; -1 for a plane of one box. objects (n,) rise."""
    _, first, of, count = np.unique(planes, return_index=True, return_inverse=True, return_counts=True)
    named: IntArray = np.where(count > 1, objects[first], -1)[of]
    return named


def _fill_pieces(numbers: FloatArray, used: BoolArray) -> None:
    """Put unused pieces, far smaller, into those in use: elsewhere they would be elsewhere for the whole target."""
    if used.any():
        of = np.flatnonzero(used)
        spare = np.flatnonzero(~used)
        numbers[spare] = numbers[of[np.arange(len(spare)) % len(of)]]
        numbers[spare, _SIZES] = _SPECK_HALF_M


def _unused(count: int) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return numbers (n, 15), roles (n,) and errors (n,) of slots without a box."""
    parked = np.array([0.0, 0.0, _PARKED_M, *np.eye(3).ravel(), *(_PARKED_HALF_M,) * 3])
    return np.tile(parked, (count, 1)), np.full(count, ROLES.index(Role.OBSTACLE)), np.zeros(count)


def _distances(boxes: Boxes, near_m: FloatArray) -> FloatArray:
    """Return the distance (n,) of each box from a point; 0 inside."""
    local = np.einsum("nij,ni->nj", boxes.rotations, near_m - boxes.centers_m)
    away: FloatArray = np.linalg.norm(np.maximum(np.abs(local) - boxes.half_sizes_m, 0.0), axis=1)
    return away
