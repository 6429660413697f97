"""Overlaps of the enlarged gripper spheres with the perceived objects near them (eq. 11-12).

    pairs = candidate_pairs(centers_m, enlarged_radii_m, objects)
    nearest = nearest_surfaces(centers_m, objects, pairs)
    pair_radii_m, binding = radii_for_role(radii_m, enlargement_m[pairs.sphere_index], pairs, objects.roles, gap_m)
    overlaps = evaluate(centers_m, pair_radii_m, objects, pairs, nearest)

`candidate_pairs` has checked the centres and the objects, so the kernels are called without checking again.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side import nearest_point
from robot_side.overlap import kernels
from robot_side.perceived_objects import PerceivedObjects, Role
from robot_side.proximity import CandidatePairs


@dataclass(frozen=True)
class NearestSurfaces:
    """Where each candidate pair's primitive is, seen from the sphere's centre (see `nearest_point`)."""

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


def nearest_surfaces(centers_m: FloatArray, objects: PerceivedObjects, pairs: CandidatePairs) -> NearestSurfaces:
    """Distance and direction from the sphere centres (m, 3) to the primitives of `pairs`."""
    points = centers_m[pairs.sphere_index]
    distance = np.empty(len(pairs))
    direction = np.empty((len(pairs), 3))
    deepening = np.empty((len(pairs), 3))
    for kind in _kinds_present(objects, pairs):
        part = kind.part
        distance[part], direction[part] = kind.nearest(points[part], *kind.primitives)
        deepening[part] = direction[part]
        inside = part.start + np.flatnonzero(distance[part] < 0.0)
        if kind.deepening is not None and len(inside) > 0:
            primitives = (array[inside - part.start] for array in kind.primitives)
            deepening[inside] = kind.deepening(points[inside], *primitives)
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
    limited = np.array([roles[index] is Role.TARGET for index in pairs.object_index.tolist()], dtype=np.bool_)
    if between_fingers is not None:
        limited |= between_fingers
    binding = limited & (enlargement_m > 0.5 * gap_m)
    return radii_m[pairs.sphere_index] + np.where(binding, 0.5 * gap_m, enlargement_m), int(binding.sum())


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
    if nearest is None:
        nearest = nearest_surfaces(centers_m, objects, pairs)
    points = centers_m[pairs.sphere_index]
    volume = np.empty(len(pairs))
    gradient = np.empty((len(pairs), 3))
    for kind in _kinds_present(objects, pairs):
        part = kind.part
        volume[part], gradient[part], _ = kind.overlap(points[part], pair_radii_m[part], *kind.primitives)
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


def select(overlaps: Overlaps, rows: IntArray) -> Overlaps:
    """The `rows` (q,) of `overlaps`, in rising order."""
    if len(rows) == len(overlaps):
        return overlaps
    return Overlaps(*(values[rows] for values in vars(overlaps).values()))


def by_object(overlaps: Overlaps) -> Overlaps:
    """Merge the primitives of an object that overlap one sphere: one row for each sphere and object.

    Volumes and gradients add up, so that the discs of faces which two primitives share cancel. Distance and
    direction are those of the nearest primitive, which for a centre outside are the object's own. The
    deepening vectors are averaged by volume: near a shared face, which is no way out, they contradict each
    other.
    """
    if len(overlaps) == 0:
        return overlaps
    key = overlaps.sphere_index * (int(overlaps.object_index.max()) + 1) + overlaps.object_index
    # For the few pairs there are, a set finds out several times faster than a sort.
    if len(set(key.tolist())) == len(key):
        return overlaps
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


class _Kind(NamedTuple):
    """The pairs with one kind of primitive, and what is to be called with them."""

    part: slice
    primitives: tuple[FloatArray, ...]
    nearest: Callable[..., tuple[FloatArray, FloatArray]]
    deepening: Callable[..., FloatArray] | None
    overlap: Callable[..., kernels.Overlaps]


def _kinds_present(objects: PerceivedObjects, pairs: CandidatePairs) -> Iterator[_Kind]:
    """The kinds of which there are pairs, with the primitive of each pair."""
    if pairs.spheres.start < pairs.spheres.stop:
        rows = pairs.primitive_index[pairs.spheres]
        yield _Kind(
            pairs.spheres,
            (objects.sphere_centers_m[rows], objects.sphere_radii_m[rows]),
            nearest_point.nearest_on_sphere,
            nearest_point.sphere_deepening,
            kernels.sphere_pairs,
        )
    if pairs.boxes.start < pairs.boxes.stop:
        rows = pairs.primitive_index[pairs.boxes]
        yield _Kind(
            pairs.boxes,
            (objects.box_centers_m[rows], objects.box_rotations[rows], objects.box_half_sizes_m[rows]),
            nearest_point.nearest_on_box,
            nearest_point.box_deepening,
            kernels.box_pairs,
        )
    if pairs.tetrahedra.start < pairs.tetrahedra.stop:
        rows = pairs.primitive_index[pairs.tetrahedra]
        yield _Kind(
            pairs.tetrahedra,
            (objects.tetrahedron_vertices_m[rows],),
            nearest_point.nearest_on_tetrahedron,
            nearest_point.tetrahedron_deepening,
            kernels.tetrahedron_pairs,
        )
    if pairs.half_spaces.start < pairs.half_spaces.stop:
        rows = pairs.primitive_index[pairs.half_spaces]
        yield _Kind(
            pairs.half_spaces,
            (objects.half_space_normals[rows], objects.half_space_offsets_m[rows]),
            nearest_point.nearest_on_half_space,
            None,
            kernels.half_space_pairs,
        )
