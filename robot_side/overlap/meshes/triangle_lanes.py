"""Overlap of one ball with many triangles at once: branch-free loops over lanes, which LLVM compiles to vector code.

The sphere has its centre at the origin, and radius 1. A face lies at the signed distance h along its outward normal;
its piece inside the ball has the area A. Ω is the solid angle of this piece at the centre, with the sign of h. Faces
out of reach need not be visited, because the solid angles of a closed surface sum to 4π w, with w its winding number
about the centre. So the part of the sphere's surface inside the solid is

    S = 4π w - Σ Ω        (sum over the faces that reach the ball)

and the volume is (Σ h A + S) / 3. Only S modulo 4π is needed, as it lies between 0 and 4π.

Ω is a sum over the face's edges. Let p be the foot point on an edge's line, its point nearest to the centre; h = n·p
with the face's unit normal n; d the signed distance of p from the face's own foot point; and b = |p|. Let t be the
position of an edge's end along the edge, from p and clipped to the ball, and c the clipped end's distance from the
centre. Then the triangle (face's foot point, p, clipped end) has the solid angle 2 atan(d t / ((b + h)(b + c))). Where
the face's piece is bounded by the sphere instead of an edge, it has a sector of the angle φ, which adds (1 - |h|) φ.
Half of each triangle's angle is a complex number; their product over all edges of all faces needs no arctangents.

Two faces that share an edge use the same p to the last bit. If an edge or corner passes through the centre, the angle
of each of its faces is undetermined. Both faces then displace the edge by the same rounding error. The sum modulo 4π
does not depend on the position of an edge inside the ball, so it stays correct.
"""

import math

from common.arrays import FloatArray
from robot_side.compiled.kernel import building_block, inlined
from robot_side.compiled.vectors import Vector, cross, dot, scale, subtract
from robot_side.overlap.digits.arctangent import arctangent

LANES = 64
"""Number of triangles in a batch, one for each lane"""
WIDTH = 8
"""Number of lanes in a group: as many as the widest vector registers hold"""
ROW = LANES + 8
"""Distance between two rows of the scratch array, in numbers. It is more than LANES, because rows 4096 bytes apart
would slow each other down."""

# The rows of the scratch array, each of `LANES` numbers: one flat array with constant offsets lets LLVM see that
# rows do not overlap. (A sum of two of these constants as an argument is enough to hide it.)
CORNERS, SECOND_CORNERS, THIRD_CORNERS, NORMAL, INVERSE_LENGTHS = 0, 3 * ROW, 6 * ROW, 9 * ROW, 12 * ROW
LONGEST = 15 * ROW  # until the heights take its place
HEIGHTS, DISTANCES, BASES = 15 * ROW, 18 * ROW, 21 * ROW
STARTS, ENDS, CORNER_DISTANCES, HEIGHT = 24 * ROW, 27 * ROW, 30 * ROW, 33 * ROW
REAL, IMAGINARY, TURN, MOMENT = 34 * ROW, 35 * ROW, 36 * ROW, 37 * ROW
PUSH, PUSH_Y, PUSH_Z = 38 * ROW, 39 * ROW, 40 * ROW
SCRATCH = 41 * ROW
"""Length of the scratch array"""

ASIDE = 0.62e-30, -0.51e-30, 0.47e-30
"""Small shift of all triangles, in radii, so that no corner, edge or face passes exactly through the sphere's centre
(a degenerate case)"""
_ROUNDING = 4e-16
"""Distance of an edge's foot point from the centre, as a share of the distance of the edge's nearer end, up to which it
is only a rounding error"""
_FAR = 1e18


@inlined
def _load3(scratch: FloatArray, row: int, lane: int) -> Vector:
    return scratch[row + lane], scratch[row + ROW + lane], scratch[row + 2 * ROW + lane]


@inlined
def _store3(scratch: FloatArray, row: int, lane: int, values: Vector) -> None:
    scratch[row + lane] = values[0]
    scratch[row + ROW + lane] = values[1]
    scratch[row + 2 * ROW + lane] = values[2]


@inlined
def _relative(corner: Vector, center: Vector, center_rest: Vector, scaling: float) -> Vector:
    """Return `corner` relative to the centre, in radii, shifted by ASIDE; only coordinates of 0 change by that."""
    x, y, z = scale(scaling, subtract(subtract(corner, center), center_rest))
    return x + ASIDE[0], y + ASIDE[1], z + ASIDE[2]


@inlined
def aside(along: Vector) -> Vector:
    """Return the foot point of an edge through the centre: the part of ASIDE across the edge's unit vector `along`."""
    return subtract(ASIDE, scale(dot(ASIDE, along), along))


@inlined
def _foot(start: Vector, end: Vector, start_rank: float, end_rank: float, along: Vector) -> Vector:
    """Return the foot point on an edge's line, computed from the end of lower rank: a reversed edge gives the same."""
    from_start = start_rank < end_rank
    near = (
        start[0] if from_start else end[0],
        start[1] if from_start else end[1],
        start[2] if from_start else end[2],
    )
    raw = subtract(near, scale(dot(near, along), along))
    # Close to the centre, the rounding error is as likely along the edge as across it.
    x, y, z = subtract(raw, scale(dot(raw, along), along))
    vanished = max(abs(x), abs(y), abs(z)) <= _ROUNDING * max(abs(near[0]), abs(near[1]), abs(near[2]))
    instead = aside(along)
    return instead[0] if vanished else x, instead[1] if vanished else y, instead[2] if vanished else z


@building_block
def triangle_geometry(scratch: FloatArray, groups: int, center: Vector, center_rest: Vector, radius: float) -> None:
    """Fill `HEIGHTS` to `HEIGHT` from the corners, normals and inverse edge lengths of `groups` of `WIDTH` lanes.

    The centre is `center` + `center_rest` (m); results are relative to the centre, in radii.
    """
    scaling = 1.0 / radius
    for lane in range(groups * WIDTH):
        raw_a = _load3(scratch, CORNERS, lane)
        raw_b = _load3(scratch, SECOND_CORNERS, lane)
        raw_c = _load3(scratch, THIRD_CORNERS, lane)
        normal = _load3(scratch, NORMAL, lane)
        inverse = _load3(scratch, INVERSE_LENGTHS, lane)
        along_ab = scale(inverse[0], subtract(raw_b, raw_a))
        along_bc = scale(inverse[1], subtract(raw_c, raw_b))
        along_ca = scale(inverse[2], subtract(raw_a, raw_c))
        a = _relative(raw_a, center, center_rest, scaling)
        b = _relative(raw_b, center, center_rest, scaling)
        c = _relative(raw_c, center, center_rest, scaling)
        a_2, b_2, c_2 = dot(a, a), dot(b, b), dot(c, c)
        # The nearer end comes first; the small second term decides between ends that are equally near.
        rank_a = a_2 + 1e-9 * (a[0] + 0.73 * a[1] + 0.29 * a[2])
        rank_b = b_2 + 1e-9 * (b[0] + 0.73 * b[1] + 0.29 * b[2])
        rank_c = c_2 + 1e-9 * (c[0] + 0.73 * c[1] + 0.29 * c[2])
        foot_ab = _foot(a, b, rank_a, rank_b, along_ab)
        foot_bc = _foot(b, c, rank_b, rank_c, along_bc)
        foot_ca = _foot(c, a, rank_c, rank_a, along_ca)
        bases = math.sqrt(dot(foot_ab, foot_ab)), math.sqrt(dot(foot_bc, foot_bc)), math.sqrt(dot(foot_ca, foot_ca))
        heights = dot(normal, foot_ab), dot(normal, foot_bc), dot(normal, foot_ca)
        nearest_base, height = bases[0], heights[0]
        nearer = bases[1] < nearest_base
        nearest_base, height = (bases[1] if nearer else nearest_base), (heights[1] if nearer else height)
        height = heights[2] if bases[2] < nearest_base else height
        _store3(scratch, HEIGHTS, lane, heights)
        distances = (
            dot(cross(along_ab, normal), foot_ab),
            dot(cross(along_bc, normal), foot_bc),
            dot(cross(along_ca, normal), foot_ca),
        )
        _store3(scratch, DISTANCES, lane, distances)
        _store3(scratch, BASES, lane, bases)
        _store3(scratch, STARTS, lane, (dot(a, along_ab), dot(b, along_bc), dot(c, along_ca)))
        _store3(scratch, ENDS, lane, (dot(b, along_ab), dot(c, along_bc), dot(a, along_ca)))
        _store3(scratch, CORNER_DISTANCES, lane, (math.sqrt(a_2), math.sqrt(b_2), math.sqrt(c_2)))
        scratch[HEIGHT + lane] = height


Complex = tuple[float, float]


@inlined
def times(a: Complex, b: Complex) -> Complex:
    """Return the product of two complex numbers."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


@inlined
def _times_conjugate(a: Complex, b: Complex) -> Complex:
    return a[0] * b[0] + a[1] * b[1], a[1] * b[0] - a[0] * b[1]


@inlined
def _end(
    along: float, away: float, distance: float, base: float, height: float, half_chord: float, shrink: float
) -> tuple[Complex, Complex, float]:
    """Return three terms of an edge's end: two angles as complex numbers, and the clipped `along`.

    The first angle is that of the part of the edge beyond the ball, about the face's foot point. The second is half the
    solid angle of the triangle up to the clipped end. `along`: the end's position along the edge. `away`: its distance.
    """
    clipped = min(max(along, -half_chord), half_chord)
    near_away = min(away, max(1.0, base))
    shrunk, reach = distance * shrink, min(max(along * shrink, -_FAR), _FAR)
    cosine = shrunk * shrunk + reach * clipped
    # An end at the face's foot point has no turn.
    turn = (cosine if cosine > 0.0 else 1.0), shrunk * (reach - clipped)
    missed = base >= 1.0
    half = (1.0 if missed else (base + height) * (base + near_away)), (0.0 if missed else distance * clipped)
    return turn, half, clipped


@inlined
def _edge(
    start: float, end: float, away_start: float, away_end: float, distance: float, base: float, height: float
) -> tuple[Complex, Complex, float]:
    """Return three terms of an edge: two angles as complex numbers, and twice the area of a triangle.

    The triangle has the face's foot point and the edge's part inside the ball. The first angle is that of the edge's
    parts outside the ball, about the foot point. The second is half the triangle's solid angle.
    """
    shrink = 1.0 / max(base, 1.0)
    half_chord = math.sqrt(max((1.0 - base) * (1.0 + base), 0.0))
    turn_start, half_start, clipped_start = _end(start, away_start, distance, base, height, half_chord, shrink)
    turn_end, half_end, clipped_end = _end(end, away_end, distance, base, height, half_chord, shrink)
    return (
        _times_conjugate(turn_end, turn_start),
        _times_conjugate(half_end, half_start),
        distance * (clipped_end - clipped_start),
    )


@inlined
def _wraps(a: Complex, b: Complex, product: Complex) -> float:
    """Return the number of whole turns, -1, 0 or 1, by which arg a + arg b exceeds arg(a b)."""
    upper = a[1] >= 0.0 and b[1] >= 0.0 and product[1] < 0.0
    lower = a[1] < 0.0 and b[1] < 0.0 and (product[1] > 0.0 or (product[1] == 0.0 and product[0] < 0.0))
    return (1.0 if upper else 0.0) - (1.0 if lower else 0.0)


@building_block
def triangle_terms(scratch: FloatArray, groups: int) -> None:
    """Fill the rows `REAL` to `PUSH_Z` of `groups` of `WIDTH` lanes from `NORMAL` and `HEIGHTS` to `HEIGHT`.

    The argument of REAL + i IMAGINARY is half of the part of Ω that the triangles give. TURN is half of the rest of Ω,
    that of the sectors. MOMENT is h A, and PUSH is A n.
    """
    for lane in range(groups * WIDTH):
        normal = _load3(scratch, NORMAL, lane)
        heights = _load3(scratch, HEIGHTS, lane)
        distances = _load3(scratch, DISTANCES, lane)
        bases = _load3(scratch, BASES, lane)
        starts = _load3(scratch, STARTS, lane)
        ends = _load3(scratch, ENDS, lane)
        aways = _load3(scratch, CORNER_DISTANCES, lane)
        height = scratch[HEIGHT + lane]
        sign = -1.0 if height < 0.0 else 1.0
        h_0, h_1, h_2 = max(sign * heights[0], 0.0), max(sign * heights[1], 0.0), max(sign * heights[2], 0.0)
        turn_0, half_0, twice_0 = _edge(starts[0], ends[0], aways[0], aways[1], distances[0], bases[0], h_0)
        turn_1, half_1, twice_1 = _edge(starts[1], ends[1], aways[1], aways[2], distances[1], bases[1], h_1)
        turn_2, half_2, twice_2 = _edge(starts[2], ends[2], aways[2], aways[0], distances[2], bases[2], h_2)
        turn_01 = times(turn_0, turn_1)
        turn = times(turn_01, turn_2)
        whole = _wraps(turn_0, turn_1, turn_01) + _wraps(turn_01, turn_2, turn)
        angle = arctangent(turn[1], turn[0]) + 2.0 * math.pi * whole
        gap = max(1.0 - abs(height), 0.0)
        area = 0.5 * (twice_0 + twice_1 + twice_2) + 0.5 * gap * (1.0 + abs(height)) * angle
        half = times(times(half_0, half_1), half_2)
        size = 1.0 / (abs(half[0]) + abs(half[1]))
        scratch[REAL + lane] = half[0] * size
        scratch[IMAGINARY + lane] = sign * half[1] * size
        scratch[TURN + lane] = 0.5 * sign * gap * angle
        scratch[MOMENT + lane] = height * area
        _store3(scratch, PUSH, lane, scale(area, normal))


@inlined
def _fold(scratch: FloatArray, lane: int, other: int) -> None:
    """Combine lane `other` into `lane`: multiply the complex numbers, add the other rows."""
    real, imaginary = scratch[REAL + lane], scratch[IMAGINARY + lane]
    other_real, other_imaginary = scratch[REAL + other], scratch[IMAGINARY + other]
    scratch[REAL + lane] = real * other_real - imaginary * other_imaginary
    scratch[IMAGINARY + lane] = real * other_imaginary + imaginary * other_real
    scratch[TURN + lane] += scratch[TURN + other]
    scratch[MOMENT + lane] += scratch[MOMENT + other]
    scratch[PUSH + lane] += scratch[PUSH + other]
    scratch[PUSH_Y + lane] += scratch[PUSH_Y + other]
    scratch[PUSH_Z + lane] += scratch[PUSH_Z + other]


@building_block
def reduce_lanes(scratch: FloatArray, count: int) -> None:
    """Combine the first `count` lanes in lane 0: the product of the complex numbers, and the sums of the other rows."""
    # Constant counts give vector code without remainders; unused lanes are filled with neutral elements.
    filled = 64 if count > 32 else 32 if count > 16 else 16 if count > 8 else 8
    for lane in range(count, filled):
        scratch[REAL + lane] = 1.0
        for row in range(1, 7):
            scratch[REAL + row * ROW + lane] = 0.0
    if count > 32:
        for lane in range(32):
            _fold(scratch, lane, lane + 32)
    if count > 16:
        for lane in range(16):
            _fold(scratch, lane, lane + 16)
    if count > 8:
        for lane in range(8):
            _fold(scratch, lane, lane + 8)
    for lane in range(1, min(count, 8)):
        _fold(scratch, 0, lane)
