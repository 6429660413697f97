"""Spheres. Numbers of a sphere: centre (3), radius."""

import math
from typing import Final

from common.arrays import FloatArray
from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, dot, load, norm, scale, subtract, unit
from robot_side.overlap.solids.solid import Overlap, nothing, sphere_volume, whole_solid, whole_sphere
from robot_side.surroundings.kinds.kind import Array, Check, Kind, Placed
from robot_side.surroundings.kinds.layout import (
    ANY_DIRECTION,
    LEAST_CONTACT_M,
    NEVER,
    NUMBERS,
    SHAPE_NUMBERS,
    TOUCHING_M,
    Chord,
    Contact,
    Nearest,
    chord_of_ball,
    rows,
)


def place(numbers: FloatArray) -> Placed:
    """Return the spheres (k) with these numbers (k, 20)."""
    return Placed(numbers[:, :SHAPE_NUMBERS], numbers[:, :4], 4.0 / 3.0 * math.pi * numbers[:, 3] ** 3)


def placed(sizes: FloatArray, positions: FloatArray, _rotations: FloatArray) -> FloatArray:
    """Return the numbers of spheres at these positions. sizes: the radius."""
    return rows(positions, sizes[:, 0], width=NUMBERS)


@inlined
def nearest(shapes: FloatArray, row: int, point: Vector) -> Nearest:
    """Return signed distance and direction from `point` to the surface of the sphere in `row` (see `Nearest`)."""
    offset = subtract((shapes[row, 0], shapes[row, 1], shapes[row, 2]), point)
    length = norm(offset)
    return length - shapes[row, 3], unit(offset) if length > 0.0 else ANY_DIRECTION


@inlined
def contact(shapes: FloatArray, row: int, start: Vector, radius: float, along: Vector, _reach: float) -> Contact:
    """Return the contact with the sphere in `row` of a sphere that moves along the unit vector `along`."""
    offset = subtract((shapes[row, 0], shapes[row, 1], shapes[row, 2]), start)
    reach = shapes[row, 3] + radius
    ahead, apart = dot(offset, along), dot(offset, offset) - reach * reach
    if apart < -2.0 * reach * TOUCHING_M:
        return 0.0, 1.0
    inside = ahead * ahead - apart
    if ahead <= 0.0 or inside < 0.0:
        return NEVER
    found = max(apart / (ahead + math.sqrt(inside)), LEAST_CONTACT_M)
    return found, (ahead - found) / reach


@inlined
def chord(shapes: FloatArray, row: int, start: Vector, along: Vector) -> Chord:
    """Return the chord of a line from `start` along the unit vector `along` in the sphere in `row`."""
    return chord_of_ball(subtract(start, load(shapes, row)), along, shapes[row, 3] * shapes[row, 3])


@inlined
def overlap(shapes: FloatArray, row: int, center: Vector, radius: float) -> Overlap:
    """Return the overlap of a sphere with the sphere in `row`, a lens (eq. 11): the sum of two caps."""
    offset = subtract((shapes[row, 0], shapes[row, 1], shapes[row, 2]), center)
    distance, other = norm(offset), shapes[row, 3]
    depth = radius + other - distance
    if depth <= 0.0:
        return nothing()
    if distance <= abs(radius - other):
        return whole_sphere(radius) if radius <= other else whole_solid(sphere_volume(other))
    # Heights of the caps of both spheres
    mine, theirs = (
        0.5 * depth * (distance + other - radius) / distance,
        0.5 * depth * (distance + radius - other) / distance,
    )
    volume = math.pi / 3.0 * (mine * mine * (3.0 * radius - mine) + theirs * theirs * (3.0 * other - theirs))
    disc = math.pi * mine * (2.0 * radius - mine)
    return volume, scale(disc / distance, offset), 2.0 * math.pi * radius * mine


KIND: Final = Kind(
    "sphere",
    (Array("sphere_centers_m", (3,)), Array("sphere_radii_m", (), Check.NOT_NEGATIVE)),
    placed=placed,
    place=place,
    nearest=nearest,
    contact=contact,
    chord=chord,
    overlap=overlap,
)
