"""Ellipsoids {c + Q diag(a) x : |x| <= 1}. Numbers of one: centre c (3), rotation Q by rows (9), half axes a (3).

Nearest points: Newton's method on the secular equation (Eberly 2013). Contact: steps to tangent planes. Overlap:
adaptive quadrature over plane sections (`ellipsoid_sections`).
"""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import FLOAT64, building_block, compiled, inlined
from robot_side.compiled.vectors import Vector, add, dot, norm, scale, subtract
from robot_side.surroundings.kinds.convex_contact import convex_contact
from robot_side.surroundings.kinds.ellipsoid_sections import reach_up, rolled, sum_slices
from robot_side.surroundings.kinds.kind import Array, Check, Kind, Placed
from robot_side.surroundings.kinds.layout import (
    NUMBERS,
    OVERLAP,
    SHAPE_NUMBERS,
    Chord,
    Nearest,
    around,
    chord_of_ball,
    rows,
    to_metres,
)

_NEWTON_STEPS: Final = 60


def place(numbers: FloatArray) -> Placed:
    """Return the ellipsoids (k) with these numbers (k, 20)."""
    half = numbers[:, 12:15]
    volumes = 4.0 / 3.0 * math.pi * half[:, 0] * half[:, 1] * half[:, 2]
    return Placed(numbers[:, :SHAPE_NUMBERS], around(numbers[:, :3], half.max(axis=1)), volumes)


def placed(sizes: FloatArray, positions: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return the numbers of ellipsoids at these poses. sizes: the half axes."""
    return rows(positions, rotations, sizes[:, :3], width=NUMBERS)


@inlined
def _turned_back(shapes: FloatArray, row: int, vector: Vector) -> Vector:
    x, y, z = vector
    return (
        shapes[row, 3] * x + shapes[row, 6] * y + shapes[row, 9] * z,
        shapes[row, 4] * x + shapes[row, 7] * y + shapes[row, 10] * z,
        shapes[row, 5] * x + shapes[row, 8] * y + shapes[row, 11] * z,
    )


@inlined
def _turned(shapes: FloatArray, row: int, vector: Vector) -> Vector:
    return (
        dot((shapes[row, 3], shapes[row, 4], shapes[row, 5]), vector),
        dot((shapes[row, 6], shapes[row, 7], shapes[row, 8]), vector),
        dot((shapes[row, 9], shapes[row, 10], shapes[row, 11]), vector),
    )


@inlined
def _local(shapes: FloatArray, row: int, point: Vector) -> Vector:
    return _turned_back(shapes, row, subtract(point, (shapes[row, 0], shapes[row, 1], shapes[row, 2])))


@building_block
def _surface(a: Vector, x: Vector) -> tuple[float, Vector]:
    """Return the signed distance of the point x from the surface, and the unit normal at the nearest point.

    x, a: the point and the half axes in the ellipsoid's own frame. The nearest point is y_i = a_i² x_i / (a_i² + t),
    where t solves F(t) = Σ (a_i x_i / (a_i² + t))² - 1 = 0. F is falling and convex. Newton's method starts where the
    largest term is 1, so that 0 <= F <= 2, and t rises to the root.
    """
    least = 0
    if a[1] < a[least]:
        least = 1
    if a[2] < a[least]:
        least = 2
    lowest = -a[least] * a[least] * (1.0 - 1e-14)
    t = max(a[0] * (abs(x[0]) - a[0]), a[1] * (abs(x[1]) - a[1]), a[2] * (abs(x[2]) - a[2]), lowest)
    for _ in range(_NEWTON_STEPS):
        p, q, r = a[0] * a[0] + t, a[1] * a[1] + t, a[2] * a[2] + t
        u, v, w = a[0] * x[0] / p, a[1] * x[1] / q, a[2] * x[2] / r
        excess, slope = u * u + v * v + w * w - 1.0, -2.0 * (u * u / p + v * v / q + w * w / r)
        if excess <= 0.0:
            break
        step = -excess / slope
        t += step
        if step <= 1e-16 * abs(t):
            break
    p, q, r = a[0] * a[0] + t, a[1] * a[1] + t, a[2] * a[2] + t
    u, v, w = a[0] * x[0] / p, a[1] * x[1] / q, a[2] * x[2] / r
    missing = 1.0 - u * u - v * v - w * w
    if missing > 0.0:
        # On the plane of the two longer axes, near the middle: the nearest points lie above and below the plane.
        if least == 0:
            u = math.copysign(math.sqrt(u * u + missing), x[0])
        elif least == 1:
            v = math.copysign(math.sqrt(v * v + missing), x[1])
        else:
            w = math.copysign(math.sqrt(w * w + missing), x[2])
    normal = u / a[0], v / a[1], w / a[2]
    length = norm(normal)
    return t * length, scale(1.0 / length, normal)


@building_block
def nearest(shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """Return signed distance and direction from `point` to the surface of the ellipsoid in `row` (see `Nearest`)."""
    distance, normal = _surface((shapes[row, 12], shapes[row, 13], shapes[row, 14]), _local(shapes, row, point))
    return distance, _turned(shapes, row, scale(-1.0, normal))


contact = convex_contact(nearest)


@inlined
def chord(shapes: FloatArray, row: int, start: Vector, along: Vector) -> Chord:
    """Return the chord of a line from `start` along the unit vector `along` in the ellipsoid in `row`."""
    (x, y, z), (u, v, w) = _local(shapes, row, start), _turned_back(shapes, row, along)
    a, b, c = shapes[row, 12], shapes[row, 13], shapes[row, 14]
    return chord_of_ball((x / a, y / b, z / c), (u / a, v / b, w / c), 1.0)


@compiled(*OVERLAP, returns=FLOAT64)
def overlap_one_ellipsoid(
    shapes: FloatArray,
    row: int,
    x: float,
    y: float,
    z: float,
    radius: float,
    _meshes: IntArray,
    overlap_gradient: FloatArray,
) -> float:
    """Return the overlap of a sphere with an ellipsoid, by quadrature over plane sections; lengths are in radii.

    The sections are perpendicular to the ellipsoid's axis that is closest to the surface normal at the nearest point.
    """
    half = scale(1.0 / radius, (shapes[row, 12], shapes[row, 13], shapes[row, 14]))
    center = scale(1.0 / radius, _local(shapes, row, (x, y, z)))
    distance, normal = _surface(half, center)
    overlap_gradient[0] = overlap_gradient[1] = overlap_gradient[2] = 0.0
    if distance >= 1.0:
        return 0.0
    if distance <= -1.0:
        return to_metres(4.0 / 3.0 * math.pi, (0.0, 0.0, 0.0), radius, radius, overlap_gradient)
    axis = 0
    for k in (1, 2):
        if abs(normal[k]) > abs(normal[axis]):
            axis = k
    half, center, normal = rolled(half, axis), rolled(center, axis), rolled(normal, axis)
    low = max(center[2] - reach_up(-normal[2], distance), -half[2])
    high = min(center[2] + reach_up(normal[2], distance), half[2])
    between = min(max(center[2] - distance * normal[2], low), high)
    below, downward = sum_slices(center, half, low, between)
    above, upward = sum_slices(center, half, between, high)
    # Undo the roll of the axes.
    pushed = add(downward, upward)
    pushed = (
        (pushed[2], pushed[0], pushed[1]) if axis == 0 else ((pushed[1], pushed[2], pushed[0]) if axis == 1 else pushed)
    )
    return to_metres(max(below + above, 0.0), _turned(shapes, row, pushed), radius, radius, overlap_gradient)


KIND: Final = Kind(
    "ellipsoid",
    (
        Array("ellipsoid_centers_m", (3,)),
        Array("ellipsoid_rotations", (3, 3), Check.ORTHONORMAL),
        Array("ellipsoid_half_axes_m", (3,), Check.NOT_NEGATIVE),
    ),
    placed=placed,
    place=place,
    nearest=nearest,
    contact=contact,
    chord=chord,
    kernel=overlap_one_ellipsoid,
    in_box=True,
)
