"""Overlaps of the enlarged gripper spheres with the perceived objects near them (eq. 11-12).

    pairs = candidate_pairs(centers_m, enlarged_radii_m, objects)
    nearest = nearest_surfaces(centers_m, objects, pairs)
    pair_radii_m, binding = radii_for_role(radii_m, enlargement_m[pairs.sphere_index], pairs, objects.roles, gap_m)
    pairs, nearest, pair_radii_m = touching_pairs(pairs, nearest, pair_radii_m)
    overlaps = evaluate(centers_m, pair_radii_m, objects, pairs, nearest)

`candidate_pairs` has checked the centres and the objects, so the kernels are called without checking again.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.objects.perceived import PerceivedObjects, Role
from robot_side.overlap import kernels
from robot_side.pairs import nearest_kernels
from robot_side.pairs.candidates import CandidatePairs


@dataclass(frozen=True)
class NearestSurfaces:
    """Where each candidate pair's primitive is, seen from the sphere's centre (see `nearest_kernels`)."""

    signed_distance_m: FloatArray
    """(p,) from the centre to the surface, negative inside"""
    direction: FloatArray
    """(p, 3) unit vector along which the signed distance falls fastest"""
    deepening: FloatArray
    """(p, 3) the direction outside; its continuous relative, of length 0 to 1, inside"""


@dataclass(frozen=True)
class Overlaps:
    """One row for each pair of an enlarged gripper sphere and a primitive, or an object (`by_object`)."""

    sphere_index: IntArray
    """(p,) into the gripper's spheres"""
    object_index: IntArray
    """(p,) into `PerceivedObjects.names`"""
    radius_m: FloatArray
    """(p,) of the enlarged sphere towards this object"""
    volume_m3: FloatArray
    """(p,)"""
    gradient_m2: FloatArray
    """(p, 3) dV/dcentre in the world frame: points the way that increases the overlap"""
    signed_distance_m: FloatArray
    """(p,) from the sphere's centre to the surface, negative inside"""
    nearest_direction: FloatArray
    """(p, 3) as `NearestSurfaces.direction`"""
    deepening: FloatArray
    """(p, 3) as `NearestSurfaces.deepening`"""
    centre_inside: BoolArray
    """(p,) whether the sphere's centre lies within"""

    def __len__(self) -> int:
        return len(self.sphere_index)


_NO_ROWS = np.empty(0, dtype=np.int64)
_NO_NUMBERS: FloatArray = np.empty(0)
_NO_VECTORS: FloatArray = np.empty((0, 3))
_NO_OVERLAPS = Overlaps(
    _NO_ROWS,
    _NO_ROWS,
    _NO_NUMBERS,
    _NO_NUMBERS,
    _NO_VECTORS,
    _NO_NUMBERS,
    _NO_VECTORS,
    _NO_VECTORS,
    np.empty(0, dtype=np.bool_),
)


def nearest_surfaces(centers_m: FloatArray, objects: PerceivedObjects, pairs: CandidatePairs) -> NearestSurfaces:
    """Distance and direction from the sphere centres (m, 3) to the primitives of `pairs`."""
    count, centers_m = len(pairs), np.ascontiguousarray(centers_m)
    distance, direction, deepening = np.empty(count), np.empty((count, 3)), np.empty((count, 3))
    for part, kernel, primitives in (
        (pairs.spheres, nearest_kernels.sphere_pairs, (objects.sphere_centers_m, objects.sphere_radii_m)),
        (
            pairs.boxes,
            nearest_kernels.box_pairs,
            (objects.box_centers_m, objects.box_rotations, objects.box_half_sizes_m),
        ),
        (pairs.tetrahedra, nearest_kernels.tetrahedron_pairs, (objects.tetrahedron_vertices_m,)),
        (
            pairs.half_spaces,
            nearest_kernels.half_space_pairs,
            (objects.half_space_normals, objects.half_space_offsets_m),
        ),
    ):
        if part.start < part.stop:
            kernel(
                centers_m,
                *primitives,
                pairs.sphere_index[part],
                pairs.primitive_index[part],
                distance[part],
                direction[part],
                deepening[part],
            )
    part = pairs.meshes
    if part.start < part.stop and objects.mesh_library is not None:
        # A scene without meshes does not load the kernels for them.
        from robot_side.pairs.nearest_on_meshes import nearest_on_meshes  # noqa: PLC0415

        points = centers_m.take(pairs.sphere_index[part], axis=0)
        distance[part], direction[part], deepening[part] = nearest_on_meshes(
            points, objects.mesh_library, *_placed(objects, pairs.primitive_index[part])
        )
    return NearestSurfaces(distance, direction, deepening)


def radii_for_role(
    radii_m: FloatArray,
    enlargement_m: FloatArray,
    pairs: CandidatePairs,
    roles: Sequence[Role],
    gap_m: float | None,
    between_fingers: BoolArray | None = None,
) -> tuple[FloatArray, int]:
    """Enlarged radius (p,) in metres of each pair's sphere, and how many limits were binding.

    radii_m (m,): the unenlarged spheres; enlargement_m (p,): D of each pair. Towards the target, and where
    `between_fingers` (p,) says so, D is limited to half of `gap_m`, the free gap between the fingers, lest the
    enlarged fingers fill it (§3.4); all others get the whole D. gap_m None: no gripper, no limit. ValueError
    for a negative or non-finite gap.
    """
    if gap_m is None:
        return radii_m[pairs.sphere_index] + enlargement_m, 0
    if not 0.0 <= gap_m < np.inf:
        raise ValueError(f"gap_m = {gap_m} is negative or not finite; valid: 0 or more, or None without a gripper")
    too_large = enlargement_m > 0.5 * gap_m
    if not too_large.any():
        return radii_m.take(pairs.sphere_index) + enlargement_m, 0
    limited = np.array([roles[index] is Role.TARGET for index in pairs.object_index.tolist()], dtype=np.bool_)
    if between_fingers is not None:
        limited |= between_fingers
    binding = limited & too_large
    return radii_m.take(pairs.sphere_index) + np.where(binding, 0.5 * gap_m, enlargement_m), int(binding.sum())


def evaluate(
    centers_m: FloatArray,
    pair_radii_m: FloatArray,
    objects: PerceivedObjects,
    pairs: CandidatePairs,
    nearest: NearestSurfaces | None = None,
) -> Overlaps:
    """Overlap volume and gradient of each candidate pair, exactly.

    centers_m (m, 3) of the gripper's spheres; pair_radii_m (p,) enlarged: from `radii_for_role`, or
    `radii[pairs.sphere_index]`. `nearest` saves finding it again. ValueError for a wrong number of radii.
    """
    if pair_radii_m.shape != (len(pairs),):
        raise ValueError(f"pair_radii_m has the shape {pair_radii_m.shape}; valid: ({len(pairs)},), one a pair")
    if len(pairs) == 0:
        return _NO_OVERLAPS
    if nearest is None:
        nearest = nearest_surfaces(centers_m, objects, pairs)
    volume = np.empty(len(pairs))
    gradient = np.empty((len(pairs), 3))
    points = centers_m.take(pairs.sphere_index, axis=0)
    for part, kernel, primitives in (
        (pairs.spheres, kernels.sphere_pairs, (objects.sphere_centers_m, objects.sphere_radii_m)),
        (pairs.boxes, kernels.box_pairs, (objects.box_centers_m, objects.box_rotations, objects.box_half_sizes_m)),
        (pairs.tetrahedra, kernels.tetrahedron_pairs, (objects.tetrahedron_vertices_m,)),
        (pairs.half_spaces, kernels.half_space_pairs, (objects.half_space_normals, objects.half_space_offsets_m)),
    ):
        if part.start < part.stop:
            rows = pairs.primitive_index[part]
            of_pairs = (array.take(rows, axis=0) for array in primitives)
            volume[part], gradient[part], _ = kernel(points[part], pair_radii_m[part], *of_pairs)
    part = pairs.meshes
    if part.start < part.stop and objects.mesh_library is not None:
        from robot_side.overlap.meshes.mesh_library import mesh_pairs  # noqa: PLC0415

        volume[part], gradient[part], _ = mesh_pairs(
            points[part], pair_radii_m[part], objects.mesh_library, *_placed(objects, pairs.primitive_index[part])
        )
    return Overlaps(
        pairs.sphere_index,
        pairs.object_index,
        pair_radii_m,
        volume,
        gradient,
        nearest.signed_distance_m,
        nearest.direction,
        nearest.deepening,
        nearest.signed_distance_m < 0.0,
    )


def _placed(objects: PerceivedObjects, rows: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Index (p,), position (p, 3) and rotation (p, 3, 3) of the meshes `rows` (p,)."""
    return (
        objects.mesh_index.take(rows),
        objects.mesh_positions_m.take(rows, axis=0),
        objects.mesh_rotations.take(rows, axis=0),
    )


def select(overlaps: Overlaps, rows: IntArray) -> Overlaps:
    """The `rows` (q,) of `overlaps`, in rising order."""
    if len(rows) == len(overlaps):
        return overlaps
    return Overlaps(*(values.take(rows, axis=0) for values in vars(overlaps).values()))


def by_object(overlaps: Overlaps) -> Overlaps:
    """Merge the primitives of an object that overlap one sphere: one row for each sphere and object.

    Volumes and gradients add up, so that the discs of faces which two primitives share cancel. Distance and
    direction are those of the nearest primitive, which for a centre outside are the object's own. The
    deepening vectors are averaged by volume: near a shared face, which is no way out, they contradict each
    other.
    """
    if len(overlaps) == 0:
        return overlaps
    # For the few pairs there are, a set finds out several times faster than a sort.
    if len(set(zip(overlaps.sphere_index.tolist(), overlaps.object_index.tolist(), strict=True))) == len(overlaps):
        return overlaps
    key = overlaps.sphere_index * (int(overlaps.object_index.max()) + 1) + overlaps.object_index
    order = np.lexsort((overlaps.signed_distance_m, key))
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    nearest = order[starts]
    volume: FloatArray = np.add.reduceat(overlaps.volume_m3[order], starts)
    weighted = np.add.reduceat((overlaps.volume_m3[:, None] * overlaps.deepening)[order], starts)
    touched = (volume > 0.0)[:, None]
    return Overlaps(
        overlaps.sphere_index[nearest],
        overlaps.object_index[nearest],
        overlaps.radius_m[nearest],
        volume,
        np.add.reduceat(overlaps.gradient_m2[order], starts),
        overlaps.signed_distance_m[nearest],
        overlaps.nearest_direction[nearest],
        np.where(touched, weighted / np.where(touched, volume[:, None], 1.0), overlaps.deepening[nearest]),
        overlaps.centre_inside[nearest],
    )
