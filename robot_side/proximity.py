"""Which gripper spheres and perceived primitives can touch at all (the broad phase of eq. 11-12).

Everything is compared by its bounding sphere: first the whole gripper with every primitive, then each of its
spheres with the primitives that are left. What depends on the objects alone is worked out once for each
frame of the camera.
"""

import weakref
from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.kinematic_error import require_finite
from robot_side.perceived_objects import PerceivedObjects

_REACH = 1.0 + 1e-9
"""Radii are enlarged by this for the comparison, so that rounding never culls a pair that touches."""

_UNIT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class CandidatePairs:
    """Pairs of a gripper sphere and a primitive, by kind: spheres, boxes, tetrahedra, half-spaces.

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
    half_spaces: slice
    pairs_skipped: int
    """How many pairs were culled."""

    def __len__(self) -> int:
        return len(self.sphere_index)


@dataclass(frozen=True)
class _Bounds:
    """Bounding spheres of the bounded primitives, in the order spheres, boxes, tetrahedra."""

    centers_m: FloatArray
    radii_m: FloatArray
    object_index: IntArray
    counts: tuple[int, int, int]


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
    require_finite("centers_m", centers_m)
    require_finite("radii_m", radii_m)
    if (radii_m < 0.0).any():
        raise ValueError(f"radii_m = {radii_m.min()} is negative; valid: 0 or more")
    bounds = _bounds_of(objects)
    sphere, bounded = _touching(centers_m, radii_m, bounds)
    splits = np.cumsum(bounds.counts)
    first_box, first_tetrahedron = np.searchsorted(bounded, splits[:2])
    plane_sphere, plane = _near_half_spaces(centers_m, radii_m, objects)
    kind = np.searchsorted(splits, bounded, side="right")
    kept, bounded_kept = len(bounded) + len(plane), len(bounded)
    return CandidatePairs(
        np.concatenate([sphere, plane_sphere]),
        np.concatenate([bounded - (splits - bounds.counts)[kind], plane]),
        np.concatenate([bounds.object_index[bounded], objects.half_space_object[plane]]),
        slice(0, int(first_box)),
        slice(int(first_box), int(first_tetrahedron)),
        slice(int(first_tetrahedron), bounded_kept),
        slice(bounded_kept, kept),
        len(centers_m) * (len(bounds.radii_m) + len(objects.half_space_offsets_m)) - kept,
    )


def _touching(centers_m: FloatArray, radii_m: FloatArray, bounds: _Bounds) -> tuple[IntArray, IntArray]:
    """Indices of gripper spheres and bounded primitives that touch, ordered by primitive."""
    none = np.empty(0, dtype=np.int64)
    if len(centers_m) == 0 or len(bounds.radii_m) == 0:
        return none, none
    middle = centers_m.mean(axis=0)
    reach = float((np.sqrt(_squared(centers_m - middle)) + radii_m).max())
    near = np.flatnonzero(_squared(bounds.centers_m - middle) <= ((bounds.radii_m + reach) * _REACH) ** 2)
    if len(near) == 0:
        return none, none
    squared = _squared(bounds.centers_m[near, None, :] - centers_m)
    row, sphere = np.nonzero(squared <= ((bounds.radii_m[near, None] + radii_m) * _REACH) ** 2)
    return sphere, near[row]


def _near_half_spaces(
    centers_m: FloatArray, radii_m: FloatArray, objects: PerceivedObjects
) -> tuple[IntArray, IntArray]:
    """Indices of gripper spheres and half-spaces that touch, ordered by half-space."""
    if len(objects.half_space_offsets_m) == 0:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    heights = objects.half_space_normals @ centers_m.T - objects.half_space_offsets_m[:, None]
    plane, sphere = np.nonzero(heights <= radii_m * _REACH)
    return sphere, plane


def _bounds_of(objects: PerceivedObjects) -> _Bounds:
    """The bounding spheres of `objects`, worked out when they are first seen."""
    key = id(objects)
    known = _bounds.get(key)
    if known is not None and known[0]() is objects:
        return known[1]
    _require_valid(objects)
    lowest, highest = objects.tetrahedron_vertices_m.min(axis=1), objects.tetrahedron_vertices_m.max(axis=1)
    middles = 0.5 * (lowest + highest)
    to_vertices = _squared(objects.tetrahedron_vertices_m - middles[:, None, :])
    radii = (
        objects.sphere_radii_m,
        np.sqrt(_squared(objects.box_half_sizes_m)),
        np.sqrt(to_vertices.max(axis=1)),
    )
    bounds = _Bounds(
        np.concatenate([objects.sphere_centers_m, objects.box_centers_m, middles]),
        np.concatenate(radii),
        np.concatenate([objects.sphere_object, objects.box_object, objects.tetrahedron_object]),
        (len(radii[0]), len(radii[1]), len(radii[2])),
    )
    _bounds[key] = weakref.ref(objects, lambda _: _bounds.pop(key, None)), bounds
    return bounds


def _require_valid(objects: PerceivedObjects) -> None:
    """Raise a ValueError that names the field of `objects` that no primitive can have."""
    for name, value in vars(objects).items():
        if isinstance(value, np.ndarray) and value.dtype.kind == "f":
            require_finite(f"objects.{name}", value)
    for name, value in (
        ("sphere_radii_m", objects.sphere_radii_m),
        ("box_half_sizes_m", objects.box_half_sizes_m),
    ):
        if (value < 0.0).any():
            raise ValueError(f"objects.{name} = {value.min()} is negative; valid: 0 or more")
    grams = objects.box_rotations.swapaxes(1, 2) @ objects.box_rotations
    for name, error in (
        ("box_rotations", np.abs(grams - np.eye(3))),
        ("half_space_normals", np.abs(_squared(objects.half_space_normals) - 1.0)),
    ):
        if (error > _UNIT_TOLERANCE).any():
            raise ValueError(
                f"objects.{name} is {error.max():.1e} off unit length or a right angle; valid: at most 1e-6"
            )


def _squared(vectors: FloatArray) -> FloatArray:
    result: FloatArray = np.einsum("...i,...i->...", vectors, vectors)
    return result
