"""The nearest point of a primitive's surface: how far, which way, and how surely that is the way out.

Point i is paired with primitive i throughout; the points are (p, 3), in the primitives' frame. The *signed
distance* is positive outside and negative inside. The *direction* is the unit vector along which it falls
fastest, its negative gradient: outside it points at the nearest point of the surface; inside it points away
from that, so that moving along it deepens the penetration and moving against it is the shortest way out. It
is the same just outside and just inside a face. Where several points are equally near, one is taken.

Inside, the direction jumps where two ways out are equally short: in the middle of a plate, say. The
`*_deepening` functions are for points inside only and give its continuous relative: a mean over the ways out
that leaves less of itself the more they contradict each other. It has length 1 at a face, 0 in the middle of
a plate or of a sphere.

Nothing is validated here: centres are checked in `pairs.candidates`, primitives once for each frame. What a tick calls
is `nearest_kernels`.
"""

import numpy as np

from common.arrays import FloatArray
from robot_side.compiled.kernel import Compiled
from robot_side.pairs.nearest_kernels import box_pairs, half_space_pairs, sphere_pairs, tetrahedron_pairs


def nearest_on_sphere(
    points_m: FloatArray, centers_m: FloatArray, radii_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Signed distance (p,) in metres and direction (p, 3) to spheres (centers (p, 3), radii (p,))."""
    distance, direction, _ = _row_by_row(sphere_pairs, points_m, centers_m, radii_m)
    return distance, direction


def nearest_on_box(
    points_m: FloatArray, centers_m: FloatArray, rotations: FloatArray, half_sizes_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Signed distance (p,) in metres and direction (p, 3) to boxes.

    centers (p, 3), rotations (p, 3, 3) box to world, half sizes (p, 3).
    """
    distance, direction, _ = _row_by_row(box_pairs, points_m, centers_m, rotations, half_sizes_m)
    return distance, direction


def nearest_on_tetrahedron(points_m: FloatArray, vertices_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Signed distance (p,) in metres and direction (p, 3) to tetrahedra (p, 4, 3), in any vertex order.

    One of zero volume is a flat plate without an inside.
    """
    distance, direction, _ = _row_by_row(tetrahedron_pairs, points_m, vertices_m)
    return distance, direction


def nearest_on_half_space(
    points_m: FloatArray, normals: FloatArray, offsets_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Signed distance (p,) in metres and direction (p, 3) to half-spaces, solid where normal·x <= offset."""
    distance, direction, _ = _row_by_row(half_space_pairs, points_m, normals, offsets_m)
    return distance, direction


def sphere_deepening(points_m: FloatArray, centers_m: FloatArray, radii_m: FloatArray) -> FloatArray:
    """Deepening vectors (p, 3) inside spheres."""
    return _row_by_row(sphere_pairs, points_m, centers_m, radii_m)[2]


def box_deepening(
    points_m: FloatArray, centers_m: FloatArray, rotations: FloatArray, half_sizes_m: FloatArray
) -> FloatArray:
    """Deepening vectors (p, 3) inside boxes."""
    return _row_by_row(box_pairs, points_m, centers_m, rotations, half_sizes_m)[2]


def tetrahedron_deepening(points_m: FloatArray, vertices_m: FloatArray) -> FloatArray:
    """Deepening vectors (p, 3) inside tetrahedra."""
    return _row_by_row(tetrahedron_pairs, points_m, vertices_m)[2]


def _row_by_row(
    kernel: Compiled, points_m: FloatArray, *primitives: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distances (p,), directions and deepening vectors (p, 3) of point i and primitive i."""
    count = len(points_m)
    rows = np.arange(count)
    arguments = (np.ascontiguousarray(array, dtype=np.float64) for array in (points_m, *primitives))
    results = np.empty(count), np.empty((count, 3)), np.empty((count, 3))
    kernel(*arguments, rows, rows, *results)
    return results
