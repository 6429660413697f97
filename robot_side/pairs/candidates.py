"""Which gripper spheres and perceived primitives can touch at all (the broad phase of eq. 11-12).

Everything is compared by its bounding sphere: first the whole gripper with every primitive, then each of its
spheres with the primitives that are left. What depends on the objects alone is worked out, and checked, once
for each frame of the camera.
"""

import math
import weakref
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray, IntArray, require_finite
from robot_side.compiled.kernel import (
    COUNT,
    compiled,
    inlined,
    input_array,
    input_indices,
    output_array,
    output_indices,
)
from robot_side.compiled.vectors import Vector, add, dot, load, scale, subtract
from robot_side.objects.mesh_bounds import mesh_bounds, placed_middles
from robot_side.objects.perceived import PerceivedObjects
from robot_side.objects.validity import require_valid

_REACH = 1.0 + 1e-9
"""Radii are enlarged by this for the comparison, so that rounding never culls a pair that touches."""

_USUAL_PAIRS = 256
"""Room for so many pairs is made at first; where there are more, they are counted and found again."""


@dataclass(frozen=True)
class CandidatePairs:
    """Pairs of a gripper sphere and a primitive, by kind: spheres, boxes, tetrahedra, meshes, half-spaces.

    The arrays run over the pairs of all kinds; the slices say which are whose.
    """

    sphere_index: IntArray
    """(p,) into the gripper's spheres"""
    primitive_index: IntArray
    """(p,) into the arrays of the pair's kind"""
    object_index: IntArray
    """(p,) into `PerceivedObjects.names`"""
    spheres: slice
    boxes: slice
    tetrahedra: slice
    meshes: slice
    half_spaces: slice
    pairs_skipped: int
    """How many pairs were culled."""

    def __len__(self) -> int:
        return len(self.sphere_index)


@dataclass(frozen=True)
class _Bounds:
    """Bounding spheres of the bounded primitives, in the order spheres, boxes, tetrahedra, meshes."""

    centers_m: FloatArray
    radii_m: FloatArray
    object_index: IntArray
    ends: IntArray
    """(4,) where each kind's rows end"""


_bounds: dict[int, tuple[weakref.ref[PerceivedObjects], _Bounds]] = {}
"""By identity, because arrays have no hash; an entry goes when its objects do."""


def candidate_pairs(centers_m: FloatArray, radii_m: FloatArray, objects: PerceivedObjects) -> CandidatePairs:
    """Pairs whose bounding spheres touch.

    centers_m (m, 3) in the world frame and radii_m (m,), enlarged. ValueError that names the argument for a
    wrong shape, a negative radius or a value that is not finite, in `objects` too: such a number compares as
    far away and would silently give no warning.
    """
    if centers_m.ndim != 2 or centers_m.shape[1] != 3 or radii_m.shape != centers_m.shape[:1]:
        raise ValueError(
            f"centers_m and radii_m have the shapes {centers_m.shape} and {radii_m.shape}; valid: (m, 3) and (m,)"
        )
    bounds = _bounds_of(objects)
    room = max(_USUAL_PAIRS, len(radii_m))
    while True:
        sphere_index, primitive_index, object_index = np.empty((3, room), dtype=np.int64)
        ends = np.zeros(4, dtype=np.int64)
        count = _find_pairs(
            np.ascontiguousarray(centers_m),
            np.ascontiguousarray(radii_m),
            bounds.centers_m,
            bounds.radii_m,
            bounds.object_index,
            bounds.ends,
            objects.half_space_normals,
            objects.half_space_offsets_m,
            objects.half_space_object,
            sphere_index,
            primitive_index,
            object_index,
            ends,
        )
        if count < 0:
            _refuse(centers_m, radii_m)
        if count <= room:
            break
        room = count
    first_box, first_tetrahedron, first_mesh, first_half_space = ends.tolist()
    return CandidatePairs(
        sphere_index[:count],
        primitive_index[:count],
        object_index[:count],
        slice(0, first_box),
        slice(first_box, first_tetrahedron),
        slice(first_tetrahedron, first_mesh),
        slice(first_mesh, first_half_space),
        slice(first_half_space, count),
        len(radii_m) * (len(bounds.radii_m) + len(objects.half_space_offsets_m)) - count,
    )


def _refuse(centers_m: FloatArray, radii_m: FloatArray) -> None:
    """Raise the ValueError that names what is wrong with the gripper's spheres."""
    require_finite("centers_m", centers_m)
    require_finite("radii_m", radii_m)
    raise ValueError(f"radii_m = {radii_m.min()} is negative; valid: 0 or more")


@inlined
def _note(sphere: int, primitive: int, thing: int, pair: int, found: tuple[IntArray, IntArray, IntArray]) -> None:
    """Write one pair, if there is room for it."""
    sphere_index, primitive_index, object_index = found
    if pair < sphere_index.size:
        sphere_index[pair] = sphere
        primitive_index[pair] = primitive
        object_index[pair] = thing


@inlined
def _middle(centers: FloatArray) -> Vector:
    x = y = z = 0.0
    for sphere in range(centers.shape[0]):
        x, y, z = add((x, y, z), load(centers, sphere))
    return scale(1.0 / max(centers.shape[0], 1), (x, y, z))


@inlined
def _apart(a: Vector, b: Vector) -> float:
    """The squared distance between two points."""
    offset = subtract(a, b)
    return dot(offset, offset)


@inlined
def _are_spheres(centers: FloatArray, radii: FloatArray) -> bool:
    """Whether all is finite and no radius negative."""
    valid = True
    for sphere in range(radii.size):
        valid &= 0.0 <= radii[sphere] < math.inf
        for axis in range(3):
            valid &= math.isfinite(centers[sphere, axis])
    return valid


@compiled(
    *(input_array(2), input_array(1)),
    *(input_array(2), input_array(1), input_indices(), input_indices()),
    *(input_array(2), input_array(1), input_indices()),
    *(output_indices(), output_indices(), output_indices(), output_indices()),
    returns=COUNT,
)
def _find_pairs(
    centers: FloatArray,
    radii: FloatArray,
    bound_centers: FloatArray,
    bound_radii: FloatArray,
    bound_object: IntArray,
    bound_ends: IntArray,
    normals: FloatArray,
    offsets: FloatArray,
    half_space_object: IntArray,
    sphere_index: IntArray,
    primitive_index: IntArray,
    object_index: IntArray,
    ends: IntArray,
) -> int:
    """Write the pairs that touch by kind, primitive and sphere, and in `ends` (4,) where each bounded kind's end.

    The number of pairs; those for which there is no room are only counted. -1 for spheres that cannot be.
    """
    if not _are_spheres(centers, radii):
        return -1
    found = sphere_index, primitive_index, object_index
    middle = _middle(centers)
    reach = 0.0
    for sphere in range(radii.size):
        reach = max(reach, math.sqrt(_apart(load(centers, sphere), middle)) + radii[sphere])
    count = 0
    for kind in range(4):
        first = 0 if kind == 0 else bound_ends[kind - 1]
        for bound in range(first, bound_ends[kind]):
            center = load(bound_centers, bound)
            if _apart(center, middle) > ((bound_radii[bound] + reach) * _REACH) ** 2:
                continue
            for sphere in range(radii.size):
                if _apart(center, load(centers, sphere)) <= ((bound_radii[bound] + radii[sphere]) * _REACH) ** 2:
                    _note(sphere, bound - first, bound_object[bound], count, found)
                    count += 1
        ends[kind] = count
    for plane in range(offsets.size):
        for sphere in range(radii.size):
            if dot(load(normals, plane), load(centers, sphere)) - offsets[plane] <= radii[sphere] * _REACH:
                _note(sphere, plane, half_space_object[plane], count, found)
                count += 1
    return count


def bounding_spheres(objects: PerceivedObjects, index: int) -> tuple[FloatArray, FloatArray]:
    """Spheres around the bounded primitives of the object `index`: centres (b, 3) and radii (b,) in metres.

    A half-space has none.
    """
    bounds = _bounds_of(objects)
    rows = np.flatnonzero(bounds.object_index == index)
    return bounds.centers_m.take(rows, axis=0), bounds.radii_m.take(rows)


def _bounds_of(objects: PerceivedObjects) -> _Bounds:
    """The bounding spheres of `objects`, worked out when they are first seen."""
    key = id(objects)
    known = _bounds.get(key)
    if known is not None and known[0]() is objects:
        return known[1]
    require_valid(objects)
    tetrahedra = objects.tetrahedron_vertices_m
    middles, radii = np.empty((len(tetrahedra), 3)), np.empty(len(tetrahedra))
    _enclose(tetrahedra, middles, radii)
    half_sizes = objects.box_half_sizes_m
    by_kind = [objects.sphere_radii_m, np.sqrt(np.einsum("bi,bi->b", half_sizes, half_sizes)), radii]
    if objects.mesh_library is None:
        by_kind.append(np.empty(0))
    else:
        by_kind.append(mesh_bounds(objects.mesh_library).radii_m.take(objects.mesh_index))
    bounds = _Bounds(
        np.concatenate([objects.sphere_centers_m, objects.box_centers_m, middles, placed_middles(objects)]),
        np.concatenate(by_kind),
        np.concatenate([objects.sphere_object, objects.box_object, objects.tetrahedron_object, objects.mesh_object]),
        np.cumsum([len(part) for part in by_kind]),
    )
    _bounds[key] = weakref.ref(objects, lambda _: _bounds.pop(key, None)), bounds
    return bounds


@compiled(input_array(3), output_array(2), output_array(1))
def _enclose(vertices: FloatArray, middles: FloatArray, radii: FloatArray) -> None:
    """A sphere around each tetrahedron (t, 4, 3), about the middle of its extent along the axes."""
    for row in range(radii.size):
        for axis in range(3):
            middles[row, axis] = 0.5 * (vertices[row, :, axis].min() + vertices[row, :, axis].max())
        radii[row] = 0.0
        for corner in range(4):
            radii[row] = max(radii[row], math.sqrt(_apart(load(vertices[row], corner), load(middles, row))))
