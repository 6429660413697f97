"""Boxes {c + Q diag(half) x : |x_i| <= 1}. Numbers of a box: centre c (3), rotation Q by rows (9), half sizes (3)."""

import math
from typing import Final

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import FLOAT64, building_block, compiled, inlined
from robot_side.compiled.vectors import Vector, add, dot, norm, scale, subtract
from robot_side.surroundings.kinds.kind import Array, Check, Kind, Placed
from robot_side.surroundings.kinds.layout import (
    CLOSING,
    LEAST_CONTACT_M,
    MOST_STEPS,
    NEVER,
    NUMBERS,
    OVERLAP,
    SHAPE_NUMBERS,
    TOUCHING_M,
    WHOLE,
    Chord,
    Contact,
    Nearest,
    around,
    cut_chord,
    lengths,
    posed,
    rows,
    to_metres,
)


def place(numbers: FloatArray) -> Placed:
    """Return the boxes (k) with these numbers (k, 20)."""
    half = numbers[:, 12:15]
    return Placed(
        numbers[:, :SHAPE_NUMBERS], around(numbers[:, :3], lengths(half)), 8.0 * half[:, 0] * half[:, 1] * half[:, 2]
    )


def placed(sizes: FloatArray, positions: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return the numbers of boxes in frames at these poses. sizes: centre in that frame, and half sizes."""
    centers = posed(positions, rotations, sizes[:, :3])
    return rows(centers, rotations, sizes[:, 3:6], width=NUMBERS)


@inlined
def _axis(shapes: FloatArray, row: int, k: int) -> Vector:
    """Return the unit vector along the box's edge k: a column of Q."""
    return shapes[row, 3 + k], shapes[row, 6 + k], shapes[row, 9 + k]


@inlined
def _along(shapes: FloatArray, row: int, k: int, point: Vector) -> float:
    """Return the coordinate of `point` along the box's edge k, measured from the box's centre."""
    return dot(_axis(shapes, row, k), subtract(point, (shapes[row, 0], shapes[row, 1], shapes[row, 2])))


@building_block
def nearest(shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """Return signed distance and direction from `point` to the surface of the box in `row` (see `Nearest`)."""
    local = _along(shapes, row, 0, point), _along(shapes, row, 1, point), _along(shapes, row, 2, point)
    beyond = abs(local[0]) - shapes[row, 12], abs(local[1]) - shapes[row, 13], abs(local[2]) - shapes[row, 14]
    excess = max(beyond[0], 0.0), max(beyond[1], 0.0), max(beyond[2], 0.0)
    distance = norm(excess)
    if distance > 0.0:
        towards = 0.0, 0.0, 0.0
        for k in range(3):
            towards = add(towards, scale(math.copysign(excess[k] / distance, -local[k]), _axis(shapes, row, k)))
        return distance, towards
    face = 0
    for k in (1, 2):
        if beyond[k] > beyond[face]:
            face = k
    return beyond[face], scale(math.copysign(1.0, -local[face]), _axis(shapes, row, face))


@building_block
def contact(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, reach: float) -> Contact:
    """Return the first contact of a sphere that moves along the unit vector `along`, computed in the box's own frame.

    Each step of the sphere ends at the tangent plane at the box's nearest point.
    """
    x, y, z = _along(shapes, row, 0, start), _along(shapes, row, 1, start), _along(shapes, row, 2, start)
    u, v, w = (
        dot(_axis(shapes, row, 0), along),
        dot(_axis(shapes, row, 1), along),
        dot(_axis(shapes, row, 2), along),
    )
    a, b, c = shapes[row, 12], shapes[row, 13], shapes[row, 14]
    moved = 0.0
    for _ in range(MOST_STEPS):
        # From the nearest point of the box to the centre.
        i, j, k = x - min(max(x, -a), a), y - min(max(y, -b), b), z - min(max(z, -c), c)
        distance = math.sqrt(i * i + j * j + k * k)
        gap = distance - radius
        if gap < -TOUCHING_M:
            return moved, 1.0
        closing = -(i * u + j * v + k * w)
        if closing <= CLOSING * distance:
            return NEVER
        if gap <= TOUCHING_M:
            return max(moved, LEAST_CONTACT_M), closing / distance
        step = gap * distance / closing
        moved += step
        if moved > reach:
            return NEVER
        x, y, z = x + step * u, y + step * v, z + step * w
    # A sphere that still moves grazes the box: it has not touched up to here.
    return moved, 1.0


@inlined
def chord(shapes: FloatArray, row: int, start: Vector, along: Vector) -> Chord:
    """Return the chord of a line from `start` along the unit vector `along` in the box in `row`."""
    found = WHOLE
    for k in range(3):
        place, rise, half = _along(shapes, row, k, start), dot(_axis(shapes, row, k), along), shapes[row, 12 + k]
        found = cut_chord(cut_chord(found, place - half, rise), -place - half, -rise)
    return found


@building_block
def _beyond_edge(a: float, b: float) -> float:
    """Return the volume of the unit ball's part with x >= a and y >= b.

    V = (S - a A - b B) / 3 with the areas A, B of the flat sides. The area S of the spherical side follows from its
    boundary's curvature (Gauss and Bonnet).
    """
    if a * a + b * b >= 1.0 and a > 0.0 and b > 0.0:
        return 0.0
    a, b = max(a, -1.0), max(b, -1.0)
    inside = math.sqrt(max(1.0 - a * a - b * b, 0.0))
    turn_a, turn_b = math.atan2(inside, b), math.atan2(inside, a)
    surface = 2.0 * (math.pi - a * turn_a - b * turn_b - math.atan2(inside, -a * b))
    return max(surface - a * _segment(1.0 - a * a, b) - b * _segment(1.0 - b * b, a), 0.0) / 3.0


@building_block
def _segment(square: float, a: float) -> float:
    """Return the area of a disc's part with x >= a; square: of the disc's radius."""
    height = math.sqrt(max(square - a * a, 0.0))
    return square * math.atan2(height, a) - a * height


@building_block
def _beyond_lines(square: float, a: float, b: float) -> tuple[float, float]:
    """Return the area of a disc's part with x >= a and y >= b, and its arc's angle; square: of the disc's radius.

    The angle is right only if the lines cross in the disc.
    """
    if a * a + b * b < square:
        width, height = math.sqrt(square - b * b), math.sqrt(square - a * a)
        turn = math.atan2(height, a) - math.atan2(b, width)
        return 0.5 * (square * turn - a * (height - b) - b * (width - a)), turn
    area = 0.0
    if a < 0.0:
        area = _segment(square, b)
        return (area - _segment(square, -a) if b < 0.0 else area), 0.0
    return (_segment(square, a) if b < 0.0 else area), 0.0


@building_block
def _beyond_corner(a: float, b: float, c: float) -> float:
    """Return the volume of the unit ball's part with x >= a, y >= b and z >= c, as `_beyond_edge` does."""
    rest = 1.0 - a * a - b * b - c * c
    if rest > 0.0:
        area_a, turn_a = _beyond_lines(1.0 - a * a, b, c)
        area_b, turn_b = _beyond_lines(1.0 - b * b, c, a)
        area_c, turn_c = _beyond_lines(1.0 - c * c, a, b)
        corners = math.atan2(math.sqrt(rest + c * c), -a * b) + math.atan2(math.sqrt(rest + a * a), -b * c)
        corners += math.atan2(math.sqrt(rest + b * b), -c * a)
        surface = 2.0 * math.pi - corners - a * turn_a - b * turn_b - c * turn_c
        return max(surface - a * area_a - b * area_b - c * area_c, 0.0) / 3.0
    # The corner is outside the ball: what is beyond two faces, but for what is beyond neither the third nor its mirror.
    beyond, sign = 0.0, 1.0
    if a < 0.0:
        beyond, sign, a = _beyond_edge(b, c), -1.0, -a
    if b < 0.0:
        beyond, sign, b = beyond + sign * _beyond_edge(a, c), -sign, -b
    return beyond + sign * _beyond_edge(a, b) if c < 0.0 else beyond


@compiled(*OVERLAP, returns=FLOAT64)
def overlap_one_box(
    shapes: FloatArray,
    row: int,
    x: float,
    y: float,
    z: float,
    radius: float,
    _meshes: IntArray,
    overlap_gradient: FloatArray,
) -> float:
    """Return the overlap of a sphere with a box, by inclusion-exclusion over the sphere's parts beyond faces.

    The parts beyond one face are subtracted, those beyond two faces added again, those beyond three subtracted. Lengths
    are in units of the radius. Faces 0 to 2 are the upper faces of the three axes, 3 to 5 the lower faces.
    """
    a, b, c = x - shapes[row, 0], y - shapes[row, 1], z - shapes[row, 2]
    axes = (
        (shapes[row, 3], shapes[row, 6], shapes[row, 9]),
        (shapes[row, 4], shapes[row, 7], shapes[row, 10]),
        (shapes[row, 5], shapes[row, 8], shapes[row, 11]),
    )
    half, part = (shapes[row, 12], shapes[row, 13], shapes[row, 14]), 1.0 / radius
    u, v, w = dot(axes[0], (a, b, c)), dot(axes[1], (a, b, c)), dot(axes[2], (a, b, c))
    overlap_gradient[0] = overlap_gradient[1] = overlap_gradient[2] = 0.0
    gap = max(abs(u) - half[0], 0.0) ** 2 + max(abs(v) - half[1], 0.0) ** 2 + max(abs(w) - half[2], 0.0) ** 2
    if gap >= radius * radius:
        return 0.0
    away = (
        *(part * (half[0] - u), part * (half[1] - v), part * (half[2] - w)),
        *(part * (half[0] + u), part * (half[1] + v), part * (half[2] + w)),
    )
    volume, along = 4.0 / 3.0 * math.pi, (0.0, 0.0, 0.0)
    for face in range(6):
        if away[face] >= 1.0:
            continue
        height = max(away[face], -1.0)
        square = 1.0 - height * height
        area = math.pi * square
        volume -= math.pi / 3.0 * (1.0 - height) * (1.0 - height) * (2.0 + height)
        for other in range(6):
            if other % 3 == face % 3 or away[other] >= 1.0:
                continue
            area -= _segment(square, away[other])
            if face < other:
                volume += _beyond_edge(height, away[other])
            for third in range(other + 1, 6):
                if third % 3 != face % 3 and third % 3 != other % 3 and away[third] < 1.0:
                    area += _beyond_lines(square, away[other], away[third])[0]
                    if face < other:
                        volume -= _beyond_corner(height, away[other], away[third])
        rising = area if face >= 3 else -area
        axis = face % 3
        along = (
            along[0] + (rising if axis == 0 else 0.0),
            along[1] + (rising if axis == 1 else 0.0),
            along[2] + (rising if axis == 2 else 0.0),
        )
    pushed = add(scale(along[0], axes[0]), add(scale(along[1], axes[1]), scale(along[2], axes[2])))
    return to_metres(max(volume, 0.0), pushed, radius, radius, overlap_gradient)


KIND: Final = Kind(
    "box",
    (
        Array("box_centers_m", (3,)),
        Array("box_rotations", (3, 3), Check.ORTHONORMAL),
        Array("box_half_sizes_m", (3,), Check.NOT_NEGATIVE),
    ),
    placed=placed,
    place=place,
    nearest=nearest,
    contact=contact,
    chord=chord,
    kernel=overlap_one_box,
    in_box=True,
)
