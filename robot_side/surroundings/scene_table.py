"""The objects of one frame as the compiled pass wants them: a row for each primitive, those of an object together."""

from dataclasses import InitVar, dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.surroundings.blocks import Blocks
from robot_side.surroundings.kinds.layout import MESH
from robot_side.surroundings.perceived import KINDS, PerceivedObjects, SomeObjects
from robot_side.surroundings.placing import empty_rows, place
from robot_side.surroundings.scene_columns import SCENE
from robot_side.surroundings.validity import require_valid

if TYPE_CHECKING:
    from robot_side.surroundings.placed_meshes import PlacedMeshes


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
        self.filled = empty_rows(len(self.rows), len(movers.things))
        self.places = table.blocks.places(movers.things)
        self.solid = sum(map(len, movers.rows.values())) == len(self.rows)
        """Whether none of them was left out."""

    def place(self, moved: PerceivedObjects) -> bool:
        """Work out their part of the table; False if one has no volume."""
        return place(moved, self.kinds, self.rows_of_kind, self.first_rows, self.filled)


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
    """(n,) the row of each primitive in the arrays of `objects` for that kind"""
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
    """The movers that have been written since the table was made"""

    def __post_init__(self, order: IntArray | None) -> None:
        self.blocks = Blocks(self.object_bounds, order)
        self.object_order, self.ordered_bounds = self.blocks.order, self.blocks.bounds
        self.block_bounds, self.group_bounds = self.blocks.blocks, self.blocks.groups

    @cached_property
    def kernels(self) -> IntArray:
        """Addresses of the kernels of overlaps by kind, then of contacts with meshes; 0 where there are none."""
        found = np.zeros(len(KINDS) + 1, dtype=np.int64)
        for number, kind in enumerate(KINDS):
            if kind.kernel is not None and (self.kinds == number).any():
                found[number] = kind.kernel.address
        if self.placed is not None:
            found[MESH], found[-1] = self.placed.overlap, self.placed.contact
        return found

    @cached_property
    def meshes(self) -> IntArray:
        """A bundle of `placed`."""
        return np.zeros((1, 2), dtype=np.int64) if self.placed is None else self.placed.bundle

    @cached_property
    def bundle(self) -> IntArray:
        """What kernels read of it."""
        return SCENE.bundle(self)

    @cached_property
    def object_index(self) -> IntArray:
        """(n,) into `objects.names`"""
        return np.repeat(np.arange(len(self.first_rows) - 1), np.diff(self.first_rows))

    @property
    def has_meshes(self) -> bool:
        """Whether any primitive is a mesh."""
        return len(self.objects.mesh_object) > 0

    @cached_property
    def placed(self) -> "PlacedMeshes | None":
        """The meshes; None where there are none."""
        if self.objects.mesh_library is None:
            return None
        # A scene without meshes does not load the kernels for them.
        from robot_side.surroundings.placed_meshes import PlacedMeshes  # noqa: PLC0415

        return PlacedMeshes(self.objects, self.rows_of_kind)


def scene_table(objects: PerceivedObjects) -> SceneTable:
    """The table of one frame alone; ValueError for what `require_valid` refuses."""
    require_valid(objects)
    return make(objects)


def go_to(table: SceneTable, objects: PerceivedObjects) -> bool:
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
    filled, things = moving.filled, moving.movers.things
    table.bounds[moving.rows], table.shapes[moving.rows] = filled.bounds, filled.shapes
    table.object_bounds[things], table.object_volumes[things] = filled.object_bounds, filled.object_volumes
    table.blocks.follow(moving.places)
    if table.placed is not None:
        rows = moving.movers.rows["mesh_object"]
        table.placed.positions[rows], table.placed.rotations[rows] = moved.mesh_positions_m, moved.mesh_rotations


def _owners(objects: PerceivedObjects) -> tuple[IntArray, ...]:
    return tuple(getattr(objects, kind.owner) for kind in KINDS)


def moved_table(last: SceneTable, objects: PerceivedObjects) -> SceneTable | None:
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
    filled = empty_rows(len(kinds), len(first_rows) - 1)
    solid = place(objects, kinds, rows_of_kind, first_rows, filled)
    return SceneTable(
        objects=objects,
        bounds=filled.bounds,
        shapes=filled.shapes,
        kinds=kinds,
        rows_of_kind=rows_of_kind,
        first_rows=first_rows,
        object_bounds=filled.object_bounds,
        object_volumes=filled.object_volumes,
        flat=flat,
        order=order,
    ), solid


def make(objects: PerceivedObjects) -> SceneTable:
    """The table of a valid frame, primitives ordered by object, those without volume left out."""
    owners = _owners(objects)
    counts = [len(owner) for owner in owners]
    owner = np.concatenate(owners)
    kinds = np.repeat(np.arange(len(KINDS)), counts)
    rows_of_kind = np.concatenate([np.arange(count) for count in counts])
    primitives = empty_rows(len(owner), 0)
    place(objects, kinds, rows_of_kind, np.zeros(1, dtype=np.int64), primitives)
    order = np.argsort(owner, kind="stable")
    order = order[primitives.volumes[order] > 0.0]
    first_rows = np.searchsorted(owner[order], np.arange(len(objects.names) + 1))
    return _placed(objects, kinds[order], rows_of_kind[order], first_rows, len(owner) - len(order))[0]
