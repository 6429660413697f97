"""The objects of one frame as the compiled pass wants them: a row for each primitive, those of an object together."""

from dataclasses import InitVar, dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.ahead.kinds import box, half_space, sphere, tetrahedron
from robot_side.ahead.kinds.blocks import TOGETHER, Blocks
from robot_side.ahead.kinds.layout import BOX, HALF_SPACE, MESH, SHAPE_NUMBERS, SPHERE, TETRAHEDRON
from robot_side.ahead.kinds.next_frame import given, mesh_volumes, place, room
from robot_side.ahead.way import passes
from robot_side.compiled.bundle import addresses, indices, numbers
from robot_side.compiled.bundle import rows as rows_at
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector
from robot_side.objects.perceived import KINDS, PerceivedObjects, SomeObjects
from robot_side.objects.validity import require_valid


class BlockColumns(NamedTuple):
    """Blocks as kernels read them; the fields are those of Blocks."""

    order: IntArray
    bounds: FloatArray
    blocks: FloatArray
    groups: FloatArray


class SceneColumns(NamedTuple):
    """A scene as kernels read it, from `SceneTable.addresses`; the fields are those of SceneTable."""

    bounds: FloatArray
    shapes: FloatArray
    kinds: IntArray
    first_rows: IntArray
    object_bounds: FloatArray
    object_volumes: FloatArray
    there: BlockColumns


@inlined
def scene_at(bundle: IntArray) -> SceneColumns:
    """A scene by its addresses, in kernels."""
    return SceneColumns(
        rows_at(bundle, 0, 4),
        rows_at(bundle, 1, SHAPE_NUMBERS),
        indices(bundle, 2),
        indices(bundle, 3),
        rows_at(bundle, 4, 4),
        numbers(bundle, 5),
        BlockColumns(indices(bundle, 6), rows_at(bundle, 7, 4), rows_at(bundle, 8, 4), rows_at(bundle, 9, 4)),
    )


@inlined
def next_place(there: BlockColumns, place: int, center: Vector, along: Vector, reach: float, radius: float) -> int:
    """The first place in the order, from `place` on, of an object that a swept sphere may meet (see `passes`)."""
    size = there.order.size
    while place < size:
        block = place // TOGETHER
        if place % (TOGETHER * TOGETHER) == 0 and not passes(
            center, along, reach, there.groups, block // TOGETHER, radius
        ):
            place += TOGETHER * TOGETHER
        elif place % TOGETHER == 0 and not passes(center, along, reach, there.blocks, block, radius):
            place += TOGETHER
        elif passes(center, along, reach, there.bounds, place, radius):
            break
        else:
            place += 1
    return place


class Moving:
    """The movers' part of a table: where it is, and room to work it out before anything there is overwritten."""

    def __init__(self, movers: SomeObjects, table: "SceneTable") -> None:
        self.movers = movers
        self.rows = np.flatnonzero(np.isin(table.object_index, movers.things))
        """(m,) of the table"""
        self.kinds, self.rows_of_kind = table.kinds[self.rows], table.rows_of_kind[self.rows]
        for kind, theirs in enumerate(movers.rows.values()):
            mine = self.kinds == kind
            self.rows_of_kind[mine] = np.searchsorted(theirs, self.rows_of_kind[mine])
        sizes = np.diff(table.first_rows)[movers.things]
        self.first_rows: IntArray = np.concatenate([[0], np.cumsum(sizes)])
        self.filled = room(len(self.rows), len(movers.things))
        self.places = table.blocks.places(movers.things)
        self.solid = sum(map(len, movers.rows.values())) == len(self.rows)
        """Whether none of them was left out."""

    def place(self, moved: PerceivedObjects) -> bool:
        """Work out their part of the table; False if one has no volume."""
        return bool(place(*given(moved), self.kinds, self.rows_of_kind, self.first_rows, *self.filled))


@dataclass(eq=False)
class SceneTable:
    """Primitives (n rows) of k objects, in the order of the objects."""

    objects: PerceivedObjects
    bounds: FloatArray
    """(n, 4) centre and radius of a sphere around each"""
    shapes: FloatArray
    """(n, 15) as the files of `kinds` lay them out; of meshes the boxes around them"""
    kinds: IntArray
    """(n,)"""
    rows_of_kind: IntArray
    """(n,) each primitive's row in the arrays of its kind in `objects`"""
    first_rows: IntArray
    """(k + 1,) where each object's rows begin, and n"""
    object_bounds: FloatArray
    """(k, 4) around each object"""
    object_volumes: FloatArray
    """(k,) in m³"""
    flat: int
    """How many primitives have no volume, and so nothing to overlap: they are left out."""
    order: InitVar[IntArray | None] = None
    moving: Moving | None = None
    """What has been written anew since it was made"""

    def __post_init__(self, order: IntArray | None) -> None:
        self.blocks = Blocks(self.object_bounds, order)

    @cached_property
    def addresses(self) -> IntArray:
        """What kernels read of it: a bundle for `scene_at`."""
        return addresses(
            *(self.bounds, self.shapes, self.kinds, self.first_rows, self.object_bounds, self.object_volumes),
            *(self.blocks.order, self.blocks.bounds, self.blocks.blocks, self.blocks.groups),
        )

    @cached_property
    def still_m(self) -> FloatArray:
        """(k,) 0: by how much things come nearer of which nobody knows that they move."""
        return np.zeros(len(self.first_rows) - 1)

    @cached_property
    def object_index(self) -> IntArray:
        """(n,) into `objects.names`"""
        return np.repeat(np.arange(len(self.first_rows) - 1), np.diff(self.first_rows))

    @property
    def has_meshes(self) -> bool:
        """Whether any primitive is a mesh."""
        return len(self.objects.mesh_object) > 0

    @cached_property
    def placed_meshes(self) -> tuple[np.ndarray, ...]:
        """What kernels read of meshes: which there are, where they are, and the library's tables; () for none."""
        objects = self.objects
        if objects.mesh_library is None:
            return ()
        # Copies, as they follow what moves.
        placed = objects.mesh_positions_m.copy(), objects.mesh_rotations.copy()
        return objects.mesh_index, *placed, *objects.mesh_library.tables


_KEPT: Final = 8
_tables: dict[int, SceneTable] = {}
"""Of the newest frames, by identity, and of those since which others say what is new."""


def scene_table(objects: PerceivedObjects) -> SceneTable:
    """The table of `objects`, made when they are first seen; ValueError for what `require_valid` refuses.

    That of a frame which says what is new since an earlier one is the earlier one's, in which only that is written
    anew, so that whoever asks for another of these frames overwrites it. A frame that is refused changes nothing.
    """
    first = objects if objects.since is None else objects.since[0].first
    for kept in (first, objects):
        known = _tables.get(id(kept))
        if known is not None and known.objects is objects:
            return known
    table = _tables.get(id(first))
    if table is None:
        require_valid(first)
        last = next(reversed(_tables.values()), None)
        moved = None if last is None else _moved(last, first)
        table = _keep(first, _make(first) if moved is None else moved)
    if table.objects is not objects and not _go_to(table, objects):
        return _keep(objects, _make(objects))
    return table


def _keep(objects: PerceivedObjects, table: SceneTable) -> SceneTable:
    _tables[id(objects)] = table
    if len(_tables) > _KEPT:
        del _tables[next(iter(_tables))]
    return table


def _go_to(table: SceneTable, objects: PerceivedObjects) -> bool:
    """Write into the table what another frame since the same first one has; False where something lost its volume."""
    before, moving = table.moving, None
    if objects.since is not None:
        movers, moved = objects.since
        require_valid(moved)
        moving = before if before is not None and before.movers is movers else Moving(movers, table)
        if not (moving.solid and moving.place(moved)):
            return False
    if before is not None and before is not moving:
        at_first = before.movers.at_first
        before.place(at_first)
        _take_over(table, before, at_first)
    if moving is not None:
        _take_over(table, moving, moved)
    table.objects, table.moving = objects, moving
    return True


def _take_over(table: SceneTable, moving: Moving, moved: PerceivedObjects) -> None:
    """What was worked out of the movers holds from now on."""
    bounds, shapes, object_bounds, object_volumes = moving.filled
    table.bounds[moving.rows], table.shapes[moving.rows] = bounds, shapes
    things = moving.movers.things
    table.object_bounds[things], table.object_volumes[things] = object_bounds, object_volumes
    table.blocks.follow(moving.places)
    if table.placed_meshes:
        rows = moving.movers.rows["mesh_object"]
        table.placed_meshes[1][rows], table.placed_meshes[2][rows] = moved.mesh_positions_m, moved.mesh_rotations


def _owners(objects: PerceivedObjects) -> tuple[IntArray, ...]:
    return tuple(getattr(objects, kind.owner) for kind in KINDS)


def _moved(last: SceneTable, objects: PerceivedObjects) -> SceneTable | None:
    """The table of the same objects where they are now; None where there are others, or some have no volume."""
    same = last.flat == 0 and len(last.objects.names) == len(objects.names)
    owners = zip(_owners(last.objects), _owners(objects), strict=True)
    if not (same and all(old is new or old.tobytes() == new.tobytes() for old, new in owners)):
        return None
    table, solid = _placed(objects, last.kinds, last.rows_of_kind, last.first_rows, 0, last.blocks.order)
    return table if solid else None


def _placed(
    objects: PerceivedObjects,
    kinds: IntArray,
    rows_of_kind: IntArray,
    first_rows: IntArray,
    flat: int,
    order: IntArray | None = None,
) -> tuple[SceneTable, bool]:
    """The table with these rows, and whether all of them have a volume."""
    filled = room(len(kinds), len(first_rows) - 1)
    solid = place(*given(objects), kinds, rows_of_kind, first_rows, *filled)
    bounds, shapes, object_bounds, object_volumes = filled
    return SceneTable(
        objects=objects,
        bounds=bounds,
        shapes=shapes,
        kinds=kinds,
        rows_of_kind=rows_of_kind,
        first_rows=first_rows,
        object_bounds=object_bounds,
        object_volumes=object_volumes,
        flat=flat,
        order=order,
    ), solid


def _make(objects: PerceivedObjects) -> SceneTable:
    owners = _owners(objects)
    counts = [len(owner) for owner in owners]
    owner = np.concatenate(owners)
    of_kinds = (sphere, box, tetrahedron, half_space)
    volumes = np.concatenate([*(kind.volumes(objects) for kind in of_kinds), mesh_volumes(objects)])
    order = np.argsort(owner, kind="stable")
    order = order[volumes[order] > 0.0]
    kinds = np.repeat(np.array([SPHERE, BOX, TETRAHEDRON, HALF_SPACE, MESH]), counts)
    rows_of_kind = np.concatenate([np.arange(count) for count in counts])
    first_rows = np.searchsorted(owner[order], np.arange(len(objects.names) + 1))
    return _placed(objects, kinds[order], rows_of_kind[order], first_rows, len(owner) - len(order))[0]
