"""The objects of one frame as the compiled pass wants them: a row for each primitive, those of an object together."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.ahead.kinds import box, half_space, sphere, tetrahedron
from robot_side.ahead.kinds.layout import BOX, HALF_SPACE, MESH, SHAPE_NUMBERS, SPHERE, TETRAHEDRON, rows
from robot_side.ahead.kinds.next_frame import place, room
from robot_side.compiled.bundle import addresses, indices, numbers
from robot_side.compiled.bundle import rows as rows_at
from robot_side.compiled.kernel import inlined
from robot_side.objects.mesh_bounds import mesh_bounds, placed_middles
from robot_side.objects.perceived import PerceivedObjects
from robot_side.objects.validity import require_valid


class SceneColumns(NamedTuple):
    """A scene as kernels read it, from `SceneTable.addresses`; the fields are those of SceneTable."""

    bounds: FloatArray
    shapes: FloatArray
    kinds: IntArray
    first_rows: IntArray
    object_bounds: FloatArray
    object_volumes: FloatArray


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
    )


@dataclass(frozen=True)
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

    @cached_property
    def addresses(self) -> IntArray:
        """What kernels read of it: a bundle for `scene_at`."""
        return addresses(self.bounds, self.shapes, self.kinds, self.first_rows, self.object_bounds, self.object_volumes)

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
        return objects.mesh_index, objects.mesh_positions_m, objects.mesh_rotations, *objects.mesh_library.tables


_KEPT: Final = 8
_tables: dict[int, SceneTable] = {}
"""Of the newest frames, by identity, because arrays have no hash; a table holds its frame, so that no other has its."""


def scene_table(objects: PerceivedObjects) -> SceneTable:
    """The table of `objects`, made when they are first seen; ValueError for what `require_valid` refuses."""
    known = _tables.get(id(objects))
    if known is not None:
        return known
    require_valid(objects)
    last = next(reversed(_tables.values()), None)
    moved = None if last is None else _moved(last, objects)
    table = _tables[id(objects)] = _make(objects) if moved is None else moved
    if len(_tables) > _KEPT:
        del _tables[next(iter(_tables))]
    return table


def _owners(objects: PerceivedObjects) -> tuple[IntArray, ...]:
    return (
        objects.sphere_object,
        objects.box_object,
        objects.tetrahedron_object,
        objects.half_space_object,
        objects.mesh_object,
    )


def _moved(last: SceneTable, objects: PerceivedObjects) -> SceneTable | None:
    """The table of the same objects where they are now; None where there are others, or some have no volume."""
    same = last.flat == 0 and len(last.objects.names) == len(objects.names)
    owners = zip(_owners(last.objects), _owners(objects), strict=True)
    if not (same and all(old is new or old.tobytes() == new.tobytes() for old, new in owners)):
        return None
    filled = room(len(last.bounds), len(last.object_bounds))
    if not place(
        *(objects.sphere_centers_m, objects.sphere_radii_m),
        *(objects.box_centers_m, objects.box_rotations, objects.box_half_sizes_m, objects.tetrahedron_vertices_m),
        *(objects.half_space_normals, objects.half_space_offsets_m),
        *(_mesh_boxes(objects), _mesh_spheres(objects), _mesh_volumes(objects)),
        *(last.kinds, last.rows_of_kind, last.first_rows, *filled),
    ):
        return None
    bounds, shapes, object_bounds, object_volumes = filled
    return SceneTable(
        objects=objects,
        bounds=bounds,
        shapes=shapes,
        kinds=last.kinds,
        rows_of_kind=last.rows_of_kind,
        first_rows=last.first_rows,
        object_bounds=object_bounds,
        object_volumes=object_volumes,
        flat=0,
    )


def _make(objects: PerceivedObjects) -> SceneTable:
    owners = _owners(objects)
    counts = [len(owner) for owner in owners]
    owner = np.concatenate(owners)
    of_kinds = (sphere, box, tetrahedron, half_space)
    volumes = np.concatenate([*(kind.volumes(objects) for kind in of_kinds), _mesh_volumes(objects)])
    order = np.argsort(owner, kind="stable")
    order = order[volumes[order] > 0.0]
    shapes = np.concatenate([*(kind.shapes(objects) for kind in of_kinds), _mesh_boxes(objects)])
    bounds = np.concatenate([*(kind.bounds(objects) for kind in of_kinds), _mesh_spheres(objects)])[order]
    owner, volumes = owner[order], volumes[order]
    first_rows = np.searchsorted(owner, np.arange(len(objects.names) + 1))
    kinds = np.repeat(np.array([SPHERE, BOX, TETRAHEDRON, HALF_SPACE, MESH]), counts)
    return SceneTable(
        objects=objects,
        bounds=bounds,
        shapes=shapes[order],
        kinds=kinds[order],
        rows_of_kind=np.concatenate([np.arange(count) for count in counts])[order],
        first_rows=first_rows,
        object_bounds=_around(bounds, first_rows),
        object_volumes=np.bincount(owner, weights=volumes, minlength=len(objects.names)).astype(np.float64),
        flat=sum(counts) - len(order),
    )


def _mesh_volumes(objects: PerceivedObjects) -> FloatArray:
    if objects.mesh_library is None:
        return np.empty(0)
    return objects.mesh_library.tables.volumes.take(objects.mesh_index)


def _mesh_boxes(objects: PerceivedObjects) -> FloatArray:
    if objects.mesh_library is None:
        return np.zeros((0, SHAPE_NUMBERS))
    half_sizes_m = mesh_bounds(objects.mesh_library).half_sizes_m.take(objects.mesh_index, axis=0)
    return rows(placed_middles(objects), objects.mesh_rotations, half_sizes_m)


def _mesh_spheres(objects: PerceivedObjects) -> FloatArray:
    if objects.mesh_library is None:
        return np.empty((0, 4))
    radii = mesh_bounds(objects.mesh_library).radii_m.take(objects.mesh_index)
    return np.column_stack([placed_middles(objects), radii])


def _around(bounds: FloatArray, first_rows: IntArray) -> FloatArray:
    """Spheres (k, 4) around each object's bounds (n, 4); of radius -inf where it has none."""
    around = np.full((len(first_rows) - 1, 4), -np.inf)
    around[:, :3] = 0.0
    for thing in np.flatnonzero(np.diff(first_rows)):
        mine = bounds[first_rows[thing] : first_rows[thing + 1]]
        low, high = (mine[:, :3] - mine[:, 3:]).min(axis=0), (mine[:, :3] + mine[:, 3:]).max(axis=0)
        middle = 0.5 * (low + high) if np.isfinite(mine[:, 3]).all() else np.zeros(3)
        around[thing, :3] = middle
        around[thing, 3] = (np.linalg.norm(mine[:, :3] - middle, axis=1) + mine[:, 3]).max()
    return around
