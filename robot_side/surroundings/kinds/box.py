"""Boxes {c + Q diag(half) x : |x_i| <= 1}. Numbers of a box: centre c (3), rotation Q by rows (9), half sizes (3)."""

import math
from typing import Final, NamedTuple

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


class _Edge(NamedTuple):
    """What two planes x = a and y = b cut off the unit ball, and off each other's discs."""

    inside: float
    """Half the length of the edge within the ball"""
    turn_a: float
    """Half the angle of the arc with y >= b, of the circle at x = a"""
    turn_b: float
    part_a: float
    """Area with y >= b, of the disc at x = a"""
    part_b: float
    between: float
    """Angle between both circles where they cross"""
    beyond: float
    """Volume of the ball's part with x >= a and y >= b"""


@building_block
def _edge(a: float, b: float) -> _Edge:
    """Return the numbers of an edge; all are 0 if one plane passes the ball.

    V = (S - a A - b B) / 3 with the areas A, B of the flat sides. The area S of the spherical side follows from its
    boundary's curvature (Gauss and Bonnet).
    """
    if a >= 1.0 or b >= 1.0:
        return _Edge(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    inside = math.sqrt(max(1.0 - a * a - b * b, 0.0))
    turn_a, turn_b, between = math.atan2(inside, b), math.atan2(inside, a), math.atan2(inside, -a * b)
    part_a, part_b = (1.0 - a * a) * turn_a - b * inside, (1.0 - b * b) * turn_b - a * inside
    surface = 2.0 * (math.pi - a * turn_a - b * turn_b - between)
    beyond = max(surface - a * part_a - b * part_b, 0.0) / 3.0
    beyond = 0.0 if inside == 0.0 and a > 0.0 and b > 0.0 else beyond
    return _Edge(inside, turn_a, turn_b, part_a, part_b, between, beyond)


@inlined
def _cap(height: float) -> float:
    """Return the volume of the unit ball's part with x >= height."""
    return math.pi / 3.0 * (1.0 - height) * (1.0 - height) * (2.0 + height)


@inlined
def _disc(height: float) -> float:
    """Return the area of the unit ball's disc at x = height."""
    return math.pi * max(1.0 - height * height, 0.0)


@building_block
def _edges(ends: tuple[float, float], others: tuple[float, float]) -> tuple[_Edge, _Edge, _Edge, _Edge]:
    """Return the edges of each of two parallel planes with each of two others."""
    return (
        *(_edge(ends[0], others[0]), _edge(ends[0], others[1])),
        *(_edge(ends[1], others[0]), _edge(ends[1], others[1])),
    )


@inlined
def _on_disc(square: float, b: float, c: float, part_b: float, part_c: float) -> float:
    """Return the area with y >= b and z >= c of a disc within which these lines do not cross.

    square: of the disc's radius. part_b, part_c: areas beyond either line.
    """
    if b < 0.0:
        return part_c - (math.pi * square - part_b if c < 0.0 else 0.0)
    return part_b if c < 0.0 else 0.0


@building_block
def _corner(a: float, b: float, c: float, ab: _Edge, bc: _Edge, ca: _Edge) -> tuple[float, float, float, float]:
    """Return the volume of the unit ball's part with x >= a, y >= b and z >= c, and the areas of its flat sides."""
    rest = 1.0 - a * a - b * b - c * c
    squares = 1.0 - a * a, 1.0 - b * b, 1.0 - c * c
    if rest > 0.0:
        turn_a, turn_b = ab.turn_a + ca.turn_b - 0.5 * math.pi, bc.turn_a + ab.turn_b - 0.5 * math.pi
        turn_c = ca.turn_a + bc.turn_b - 0.5 * math.pi
        area_a = 0.5 * (squares[0] * turn_a - b * (ab.inside - c) - c * (ca.inside - b))
        area_b = 0.5 * (squares[1] * turn_b - c * (bc.inside - a) - a * (ab.inside - c))
        area_c = 0.5 * (squares[2] * turn_c - a * (ca.inside - b) - b * (bc.inside - a))
        surface = 2.0 * math.pi - ab.between - bc.between - ca.between - a * turn_a - b * turn_b - c * turn_c
        return max(surface - a * area_a - b * area_b - c * area_c, 0.0) / 3.0, area_a, area_b, area_c
    # The corner is outside the ball: what is beyond two faces, but for what is beyond neither the third nor its mirror.
    beyond, sign, beyond_ca, beyond_ab = 0.0, 1.0, ca.beyond, ab.beyond
    if a < 0.0:
        beyond, sign = bc.beyond, -1.0
        beyond_ca, beyond_ab = _cap(c) - beyond_ca, _cap(b) - beyond_ab
    if b < 0.0:
        beyond, sign = beyond + sign * beyond_ca, -sign
        beyond_ab = (_cap(-a) if a < 0.0 else _cap(a)) - beyond_ab
    beyond += sign * beyond_ab if c < 0.0 else 0.0
    return (
        max(beyond, 0.0),
        _on_disc(squares[0], b, c, ab.part_a, ca.part_b),
        _on_disc(squares[1], c, a, bc.part_a, ab.part_b),
        _on_disc(squares[2], a, b, ca.part_a, bc.part_b),
    )


@building_block
def _where_faces_meet(
    x_ends: tuple[float, float], y_ends: tuple[float, float], z_ends: tuple[float, float]
) -> tuple[float, Vector]:
    """Return what edges and corners add to the volume, and to the areas of faces, upper less lower ones."""
    volume, across = 0.0, (0.0, 0.0, 0.0)
    xy, yz, zx = _edges(x_ends, y_ends), _edges(y_ends, z_ends), _edges(z_ends, x_ends)
    for i in range(2):
        for j in range(2):
            near, far = 1.0 - 2.0 * i, 1.0 - 2.0 * j
            one, two, three = xy[2 * i + j], yz[2 * i + j], zx[2 * i + j]
            volume += one.beyond + two.beyond + three.beyond
            across = subtract(across, scale(near, (one.part_a, two.part_a, three.part_a)))
            across = subtract(across, scale(far, (three.part_b, one.part_b, two.part_b)))
            if x_ends[i] >= 1.0 or y_ends[j] >= 1.0:
                continue
            for k in range(2):
                if z_ends[k] < 1.0:
                    beyond, area_x, area_y, area_z = _corner(
                        x_ends[i], y_ends[j], z_ends[k], one, yz[2 * j + k], zx[2 * k + i]
                    )
                    volume -= beyond
                    across = add(across, (near * area_x, far * area_y, (1.0 - 2.0 * k) * area_z))
    return volume, across


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
    are in units of the radius. Faces 0 to 2 are the upper faces of the three axes, 3 to 5 the lower faces. Each edge's
    angles serve both of its faces and all corners, as arcs take most of the time.
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
    volume, across = 4.0 / 3.0 * math.pi, (0.0, 0.0, 0.0)
    x_ends = max(away[0], -1.0), max(away[3], -1.0)
    y_ends = max(away[1], -1.0), max(away[4], -1.0)
    z_ends = max(away[2], -1.0), max(away[5], -1.0)
    cut = 0
    for k in range(2):
        for height in (x_ends[k], y_ends[k], z_ends[k]):
            volume -= _cap(min(height, 1.0))
            cut += 1 if height < 1.0 else 0
        sign = 1.0 if k == 0 else -1.0
        across = add(across, scale(sign, (_disc(x_ends[k]), _disc(y_ends[k]), _disc(z_ends[k]))))
    if cut > 1:
        more, turned = _where_faces_meet(x_ends, y_ends, z_ends)
        volume, across = volume + more, add(across, turned)
    pushed = add(scale(-across[0], axes[0]), add(scale(-across[1], axes[1]), scale(-across[2], axes[2])))
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
