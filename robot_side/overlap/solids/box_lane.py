"""Overlap of a sphere and a box, computed without a branch: one lane of the vectorised loop in `box_batch`.

The box is the parallelepiped {c + Σ xₖ qₖ : |xₖ| <= halfₖ} with the columns qₖ of the given rotation, which need to be
perpendicular only to 1e-6. Its sides are measured from a reference point, the box's point nearest to the sphere's
centre, so that a large box costs no digits. Axes are named k, i and j in cyclic order; each has an upper and a lower
side.
"""

import math

from robot_side.compiled.kernel import inlined
from robot_side.compiled.vectors import Vector, add, cross, dot, norm, scale
from robot_side.overlap.digits.error_free import difference, sum_of_products
from robot_side.overlap.solids.face_angles import add_edge, edge_terms, face_areas, first_edge
from robot_side.overlap.solids.lane_result import LaneResult, settle
from robot_side.overlap.solids.solid import from_faces
from robot_side.overlap.solids.split_edge import SplitEdge, split_edge

Columns = tuple[Vector, Vector, Vector]

Sides = tuple[float, float]
"""Values for an axis's upper side and lower side"""

Axis = tuple[Vector, float, Vector, float, Sides]
"""(unit direction of q, |q|, outward unit normal of the upper face, q·normal, coordinates of both sides along q from
the reference point in m)"""

EdgeLine = tuple[float, float, float, float, float]
"""(start, end, squared distance of the foot point from the centre, d in the face across i, d in the face across j). The
foot point is the line's point nearest to the sphere's centre. start, end: signed distances (m) from it."""

FourLines = tuple[EdgeLine, EdgeLine, EdgeLine, EdgeLine]
"""Edges along an axis at the (upper i, upper j), (upper, lower), (lower, upper) and (lower, lower) sides"""

EdgeInFaces = tuple[SplitEdge, float, float]
"""(split edge, d in the face across i, d in the face across j); d is the edge's distance from the face's foot point"""

FourEdges = tuple[EdgeInFaces, EdgeInFaces, EdgeInFaces, EdgeInFaces]

LARGEST_REACH = 1e4
"""Distance from the box's point nearest to the sphere's centre, in radii, at which boxes are cut off"""

NO_REST = (0.0, 0.0, 0.0)


@inlined
def box_lane(center: Vector, radius: float, box_center: Vector, columns: Columns, half: Vector) -> LaneResult:
    """Return the overlap of the sphere (`center`, `radius`) with a box; its columns may be left- or right-handed.

    The lengths are scaled so that the radius is 1 to 2. The overlap is exact to some 4e-16 of the sphere, unless the
    result is marked for precise forms.
    """
    q_0, q_1, q_2 = columns
    across_0, across_1, across_2 = cross(q_1, q_2), cross(q_2, q_0), cross(q_0, q_1)
    determinant = dot(q_0, across_0)
    handedness = 1.0 if determinant > 0.0 else -1.0
    normal_0, rise_0 = _normal(q_0, across_0, handedness)
    normal_1, rise_1 = _normal(q_1, across_1, handedness)
    normal_2, rise_2 = _normal(q_2, across_2, handedness)
    middle, rest = difference(box_center, center)
    place = (
        _clamp(-dot(middle, normal_0) / rise_0, half[0]),
        _clamp(-dot(middle, normal_1) / rise_1, half[1]),
        _clamp(-dot(middle, normal_2) / rise_2, half[2]),
    )
    reference = (
        sum_of_products(middle[0], rest[0], place, (q_0[0], q_1[0], q_2[0]), NO_REST),
        sum_of_products(middle[1], rest[1], place, (q_0[1], q_1[1], q_2[1]), NO_REST),
        sum_of_products(middle[2], rest[2], place, (q_0[2], q_1[2], q_2[2]), NO_REST),
    )
    # Parts farther away are out of reach, and are cut off so that products of distances do not overflow.
    most = LARGEST_REACH * radius
    axis_0 = _axis(q_0, normal_0, rise_0, place[0], half[0], most)
    axis_1 = _axis(q_1, normal_1, rise_1, place[1], half[1], most)
    axis_2 = _axis(q_2, normal_2, rise_2, place[2], half[2], most)
    heights_0, heights_1 = _heights(reference, axis_0), _heights(reference, axis_1)
    heights_2 = _heights(reference, axis_2)

    lines_0 = _lines(reference, axis_0, axis_1, q_1, axis_2, q_2, heights_1, handedness)
    lines_1 = _lines(reference, axis_1, axis_2, q_2, axis_0, q_0, heights_2, handedness)
    lines_2 = _lines(reference, axis_2, axis_0, q_0, axis_1, q_1, heights_0, handedness)
    # Distances of the corners, named by their side on axes 0, 1 and 2: u for upper, l for lower.
    luu, uuu = _corner_norms(lines_0[0])
    lul, uul = _corner_norms(lines_0[1])
    llu, ulu = _corner_norms(lines_0[2])
    lll, ull = _corner_norms(lines_0[3])
    edges_0 = _split(lines_0, (luu, lul, llu, lll), (uuu, uul, ulu, ull), radius)
    edges_1 = _split(lines_1, (ulu, llu, ull, lll), (uuu, luu, uul, lul), radius)
    edges_2 = _split(lines_2, (uul, ull, lul, lll), (uuu, ulu, luu, llu), radius)

    moment_0, push_0, covered_0 = _opposite_faces(edges_1, edges_2, heights_0, radius)
    moment_1, push_1, covered_1 = _opposite_faces(edges_2, edges_0, heights_1, radius)
    moment_2, push_2, covered_2 = _opposite_faces(edges_0, edges_1, heights_2, radius)
    push = add(scale(push_0, normal_0), add(scale(push_1, normal_1), scale(push_2, normal_2)))
    overlap = from_faces(moment_0 + moment_1 + moment_2, push, covered_0 + covered_1 + covered_2, radius)

    volume = 8.0 * abs(determinant) * (half[0] * half[1] * half[2])
    lowest = min(heights_0[0], heights_0[1], heights_1[0], heights_1[1], heights_2[0], heights_2[1])
    depth = max(lowest, 0.0)
    nearest_2 = max(dot(reference, reference), depth * depth)
    farthest = max(abs(middle[0]), abs(middle[1]), abs(middle[2]))
    extent = 2.0 * max(half[0], half[1], half[2])
    return settle(overlap, radius, volume, nearest_2, lowest, 0.0, farthest, extent, False)


@inlined
def _normal(q: Vector, across: Vector, handedness: float) -> tuple[Vector, float]:
    """Return (outward unit normal of the upper face, q·normal)."""
    normal = scale(handedness / norm(across), across)
    return normal, dot(q, normal)


@inlined
def _clamp(value: float, most: float) -> float:
    return min(max(value, -most), most)


@inlined
def _axis(q: Vector, normal: Vector, rise: float, place: float, half: float, most: float) -> Axis:
    length = norm(q)
    return scale(1.0 / length, q), length, normal, rise, (min(half - place, most), max(-half - place, -most))


@inlined
def _heights(reference: Vector, axis: Axis) -> Sides:
    """Return signed distances (m) of the upper and the lower face from the centre, each along its outward normal."""
    shift = dot(reference, axis[2])
    return shift + axis[4][0] * axis[3], -shift - axis[4][1] * axis[3]


@inlined
def _lines(
    reference: Vector,
    axis: Axis,
    axis_i: Axis,
    q_i: Vector,
    axis_j: Axis,
    q_j: Vector,
    heights_i: Sides,
    handedness: float,
) -> FourLines:
    """Return the lines of the four edges along `axis`. `heights_i`: signed distances (m) of the faces across axis i."""
    direction, length, _, _, sides = axis
    # Unit vectors at right angles to the edges: in the faces across i towards upper j, and across j towards upper i.
    toward_j, toward_i = (
        scale(handedness, cross(direction, axis_i[2])),
        scale(handedness, cross(axis_j[2], direction)),
    )
    along = dot(reference, direction), dot(q_i, direction), dot(q_j, direction)
    across_i = dot(reference, toward_j), dot(q_i, toward_j), dot(q_j, toward_j)
    across_j = dot(reference, toward_i), dot(q_i, toward_i), dot(q_j, toward_i)
    ends = sides[1] * length, sides[0] * length
    upper_i, lower_i = axis_i[4]
    upper_j, lower_j = axis_j[4]
    return (
        _line(along, across_i, across_j, (upper_i, 1.0), (upper_j, 1.0), heights_i[0], ends),
        _line(along, across_i, across_j, (upper_i, 1.0), (lower_j, -1.0), heights_i[0], ends),
        _line(along, across_i, across_j, (lower_i, -1.0), (upper_j, 1.0), heights_i[1], ends),
        _line(along, across_i, across_j, (lower_i, -1.0), (lower_j, -1.0), heights_i[1], ends),
    )


@inlined
def _line(
    along: Vector,
    across_i: Vector,
    across_j: Vector,
    side_i: tuple[float, float],
    side_j: tuple[float, float],
    height: float,
    ends: tuple[float, float],
) -> EdgeLine:
    """Return the line of the edge through reference + x_i q_i + x_j q_j.

    side_i, side_j: (x, sign) of the edge's side on each axis; the sign is 1 for the upper side, -1 for the lower.
    """
    shift = along[0] + (side_i[0] * along[1] + side_j[0] * along[2])
    distance_i = side_j[1] * (across_i[0] + (side_i[0] * across_i[1] + side_j[0] * across_i[2]))
    distance_j = side_i[1] * (across_j[0] + (side_i[0] * across_j[1] + side_j[0] * across_j[2]))
    return shift + ends[0], shift + ends[1], height * height + distance_i * distance_i, distance_i, distance_j


@inlined
def _corner_norms(line: EdgeLine) -> tuple[float, float]:
    """Return the distances (m) of the edge's start and end from the centre."""
    return math.sqrt(line[2] + line[0] * line[0]), math.sqrt(line[2] + line[1] * line[1])


@inlined
def _split(
    lines: FourLines,
    start_norms: tuple[float, float, float, float],
    end_norms: tuple[float, float, float, float],
    radius: float,
) -> FourEdges:
    return (
        _split_line(lines[0], start_norms[0], end_norms[0], radius),
        _split_line(lines[1], start_norms[1], end_norms[1], radius),
        _split_line(lines[2], start_norms[2], end_norms[2], radius),
        _split_line(lines[3], start_norms[3], end_norms[3], radius),
    )


@inlined
def _split_line(line: EdgeLine, start_norm: float, end_norm: float, radius: float) -> EdgeInFaces:
    return split_edge(line[0], line[1], start_norm, end_norm, line[2], radius), line[3], line[4]


@inlined
def _opposite_faces(
    edges_i: FourEdges, edges_j: FourEdges, heights: Sides, radius: float
) -> tuple[float, float, float]:
    """Return (Σ h·A, A of the upper face minus A of the lower face, Σ S) of the two faces across an axis k.

    Edges are in the order of their sides on the two other axes. k is the second of these for edges along i, the first
    for edges along j.
    """
    disc, covered = _face(edges_i[0], edges_i[2], edges_j[0], edges_j[1], heights[0], radius)
    lower_disc, lower_covered = _face(edges_i[1], edges_i[3], edges_j[2], edges_j[3], heights[1], radius)
    return heights[0] * disc + heights[1] * lower_disc, disc - lower_disc, covered + lower_covered


@inlined
def _face(
    first: EdgeInFaces, second: EdgeInFaces, third: EdgeInFaces, fourth: EdgeInFaces, height: float, radius: float
) -> tuple[float, float]:
    """Return (A, S) of a face from its two edges along i, `first` and `second`, and its two along j."""
    depth = abs(height)
    total = first_edge(edge_terms(first[0], first[2], depth))
    total = add_edge(total, edge_terms(second[0], second[2], depth))
    total = add_edge(total, edge_terms(third[0], third[1], depth))
    total = add_edge(total, edge_terms(fourth[0], fourth[1], depth))
    return face_areas(height, total, radius)
