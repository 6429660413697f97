"""Table of one frame's objects for the compiled law: a row for each primitive, grouped by object."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.surroundings.blocks import Blocks, places_on_curve
from robot_side.surroundings.kinds.kind import Placed
from robot_side.surroundings.kinds.layout import MESH, VELOCITY
from robot_side.surroundings.perceived import KINDS, PerceivedObjects, SomeObjects
from robot_side.surroundings.placing import grouped, numbers_of, of_objects, placed_rows, primitives_of
from robot_side.surroundings.scene_columns import SCENE
from robot_side.surroundings.validity import NumberChecks, require_valid

if TYPE_CHECKING:
    from robot_side.surroundings.placed_meshes import PlacedMeshes


class MoverRows:
    """Movers' primitives in a table, and the movers' places in the order of blocks."""

    def __init__(self, movers: SomeObjects, table: "SceneTable") -> None:
        self.movers = movers
        self.rows = np.flatnonzero(np.isin(table.object_index, movers.things))
        """(n,) rows of the movers' primitives"""
        self.kinds = table.kinds[self.rows]
        self.places = table.blocks.places(movers.things)
        """(m,) positions of the movers in the table's order of blocks; -1 for a mover without bounds"""
        self.sizes = np.diff(movers.first_rows)
        """(m,) number of each mover's primitives"""
        self.solid = bool((self.sizes == np.diff(table.first_rows)[movers.things]).all())
        """Whether the table has all of the movers' primitives: none was left out for want of volume"""
        self.owners = np.repeat(np.arange(len(self.sizes)), self.sizes)
        self.written = movers.at_first
        """Numbers of the movers that are in the table"""


@dataclass(eq=False)
class SceneTable:
    """Table of the primitives (n rows) of k objects, in the order of the objects."""

    objects: PerceivedObjects
    bounds: FloatArray
    """(n, 4) centre and radius of a sphere around each primitive"""
    shapes: FloatArray
    """(n, 15) in the layout of each kind (`kinds`); for meshes, the boxes around them"""
    kinds: IntArray
    """(n,) number of each primitive's kind"""
    rows_of_kind: IntArray
    """(n,) row of each primitive in its kind's arrays of `objects`"""
    first_rows: IntArray
    """(k + 1,) first row of each object, and n"""
    object_bounds: FloatArray
    """(k, 4) centre and radius of a sphere around each object"""
    object_volumes: FloatArray
    """(k,) volume of each object, in m³"""
    flat: int
    """Number of primitives left out because they have no volume, so that nothing can overlap them"""
    moving: MoverRows | None = None
    """Movers whose newest numbers are in the table; None without such"""

    def __post_init__(self) -> None:
        self.blocks = Blocks(self.object_bounds)
        self.object_order, self.ordered_bounds = self.blocks.order, self.blocks.bounds
        self.block_bounds, self.group_bounds = self.blocks.blocks, self.blocks.groups
        self.surfaces: IntArray = np.empty(0, dtype=np.int64)
        """(k,) number of the surface that each object is a piece of, see `PerceivedObjects`; (0,) if all stand alone"""
        self.pieces: IntArray = np.empty(0, dtype=np.int64)
        """(k,) objects that are pieces of surfaces, surface after surface, those of one along a curve; then -1; (0,) as
        above"""
        self.follow_surfaces()

    def follow_surfaces(self) -> None:
        """Take over the surfaces of the frame in `objects`."""
        new = self.objects.surfaces
        if new is None or len(new) == len(self.surfaces):
            self.surfaces[:] = -1 if new is None else new
        else:
            self.surfaces, self.pieces = new.copy(), np.empty(len(new), dtype=np.int64)
            # The bundle holds the arrays' addresses.
            vars(self).pop("bundle", None)
        there = np.flatnonzero(self.surfaces >= 0)
        self.pieces[len(there) :] = -1
        order = np.lexsort((places_on_curve(self.object_bounds[there, :3]), self.surfaces[there]))
        self.pieces[: len(there)] = there[order]

    @cached_property
    def kernels(self) -> IntArray:
        """Address of each kind's overlap kernel, then those of meshes: crossings, contact; 0 for a kernel not needed"""
        found = np.zeros(len(KINDS) + 2, dtype=np.int64)
        for number, kind in enumerate(KINDS):
            if kind.kernel is not None and (self.kinds == number).any():
                found[number] = kind.kernel.address
        if self.placed is not None:
            found[MESH], found[-2:] = self.placed.overlap, (self.placed.crossings, self.placed.contact)
        return found

    @cached_property
    def meshes(self) -> IntArray:
        """Bundle of the columns of `placed`, for kernels; zeros without meshes"""
        return np.zeros((1, 2), dtype=np.int64) if self.placed is None else self.placed.bundle

    @cached_property
    def bundle(self) -> IntArray:
        """Bundle of this table's columns, for kernels"""
        return SCENE.bundle(self)

    @cached_property
    def object_index(self) -> IntArray:
        """(n,) index of each primitive's object in `objects.names`"""
        return np.repeat(np.arange(len(self.first_rows) - 1), np.diff(self.first_rows))

    @cached_property
    def placed(self) -> "PlacedMeshes | None":
        """Placed meshes of the frame; None without meshes"""
        if self.objects.mesh_library is None:
            return None
        # A scene without meshes does not load the kernels for them.
        from robot_side.surroundings.placed_meshes import PlacedMeshes  # noqa: PLC0415

        return PlacedMeshes(self.objects, self.rows_of_kind)


def scene_table(objects: PerceivedObjects) -> SceneTable:
    """Return the table of one frame; ValueError if `require_valid` refuses the frame."""
    require_valid(objects)
    return make(objects)


def go_to(table: SceneTable, objects: PerceivedObjects) -> bool:
    """Update the table to another frame with the same first frame. Return False if a primitive has lost its volume.

    ValueError if `require_valid` refuses the frame.
    """
    before = table.moving
    since = objects.since
    if before is not None and (since is None or since[0] is not before.movers):
        _write_movers(table, before, before.movers.at_first)
        table.objects, table.moving = before.movers.first, None
    if since is not None:
        moving = table.moving or MoverRows(since[0], table)
        if not (moving.solid and _write_movers(table, moving, since[1])):
            require_valid(objects)
            return False
        table.moving = moving
    table.objects = objects
    table.follow_surfaces()
    return True


def _write_movers(table: SceneTable, moving: MoverRows, numbers: FloatArray) -> bool:
    """Write the movers' numbers into the table. Return False, and write nothing, if some are invalid or without volume.

    numbers (n + m, 20) as in `movers`.
    """
    movers, count = moving.movers, len(moving.rows)
    velocities_m_s = numbers[count:, VELOCITY : VELOCITY + 3]
    if movers.measured and not np.isfinite(velocities_m_s).all():
        return False
    # Most of a map's surfaces stay where they are. What is not a number differs from itself.
    elsewhere = np.zeros(len(movers.things), dtype=np.bool_)
    elsewhere[moving.owners[(numbers[:count] != moving.written[:count]).any(axis=1)]] = True
    which, these = np.flatnonzero(elsewhere), np.flatnonzero(elsewhere[moving.owners])
    own, rows, kinds = numbers[these], moving.rows[these], moving.kinds[these]
    if not NumberChecks(kinds).valid(own):
        return False
    placed = placed_rows(own, grouped(kinds))
    if not (placed.volumes_m3 > 0.0).all():
        return False
    things, places = movers.things[which], moving.places[which]
    bounds, volumes = of_objects(placed, np.concatenate([[0], moving.sizes[which].cumsum()]))
    table.shapes[rows], table.bounds[rows] = placed.shapes, placed.bounds
    table.object_bounds[things], table.object_volumes[things] = bounds, volumes
    table.ordered_bounds[places[places >= 0]] = bounds[places >= 0]
    table.blocks.bound(places[places >= 0])()
    moving.written = numbers
    if table.placed is not None:
        places, meshes, *_ = movers.parts["mesh_positions_m"]
        table.placed.positions[meshes] = numbers[places, :3]
        table.placed.rotations[meshes] = numbers[places, 3:12].reshape(-1, 3, 3)
    return True


def make(objects: PerceivedObjects) -> SceneTable:
    """Return the table of a valid frame: primitives grouped by object, without primitives that have no volume."""
    owners, kinds, rows_of_kind = primitives_of(objects)
    placed = placed_rows(numbers_of(objects), grouped(kinds))
    order = np.argsort(owners, kind="stable")
    order = order[placed.volumes_m3[order] > 0.0]
    first_rows = np.searchsorted(owners[order], np.arange(len(objects.names) + 1))
    rows = Placed(*(column[order] for column in placed))
    object_bounds, object_volumes = of_objects(rows, first_rows)
    return SceneTable(
        objects=objects,
        bounds=rows.bounds,
        shapes=rows.shapes,
        kinds=kinds[order],
        rows_of_kind=rows_of_kind[order],
        first_rows=first_rows,
        object_bounds=object_bounds,
        object_volumes=object_volumes,
        flat=len(owners) - len(order),
    )
