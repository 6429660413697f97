"""Nearest points of (point, primitive) pairs in contiguous arrays: what a 1 kHz tick calls.

Pair i is point point_index[i] with primitive primitive_index[i]. Its row of `distance` (p,) gets the signed distance,
positive outside and negative inside; that of `direction` (p, 3) the unit vector along which this falls fastest: towards
the nearest point from outside, away from it from inside, the same on both sides of a face. Inside, the direction jumps
where two ways out are equally short; `deepening` (p, 3) is its continuous relative, a mean over the ways out that has
length 1 at a face and 0 in the middle of a plate. Outside it is the direction.
Nothing is validated here. Arrays are float64 and int64, C-contiguous, lengths in m.
"""

import math

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import (
    COUNT,
    NUMBER,
    building_block,
    compiled,
    inlined,
    input_array,
    input_indices,
    output_array,
)
from robot_side.compiled.vectors import Vector, add, cross, dot, load, negative, norm, scale, subtract, unit

Nearest = tuple[float, Vector, Vector]
"""Signed distance, direction and deepening vector."""
Axes = tuple[Vector, Vector, Vector]
Vertices = tuple[Vector, Vector, Vector, Vector]

_ANY_DIRECTION = (0.0, 0.0, 1.0)
"""For a point in the centre of a sphere, from which every way out is as long."""

_WAY_OUT_EXPONENT = 4
"""Ways out count by length^-4: one 1.8 times as long as the shortest counts a tenth of it."""

_INDICES = input_indices(), input_indices()
_RESULTS = output_array(1), output_array(2), output_array(2)


@inlined
def _weight(length: float, shortest: float) -> float:
    """How much a way out of that length counts beside the shortest one; ways of length 0 as much as each other."""
    return (shortest / length) ** _WAY_OUT_EXPONENT if length > shortest else 1.0


@inlined
def _store(pair: int, nearest: Nearest, distance: FloatArray, direction: FloatArray, deepening: FloatArray) -> None:
    distance[pair] = nearest[0]
    for axis in range(3):
        direction[pair, axis] = nearest[1][axis]
        deepening[pair, axis] = nearest[2][axis]


@inlined
def _to_sphere(point: Vector, center: Vector, radius: float) -> Nearest:
    offset = subtract(center, point)
    length = norm(offset)
    direction = unit(offset) if length > 0.0 else _ANY_DIRECTION
    if length >= radius:
        return length - radius, direction, direction
    # The ways out are the nearest and the opposite one.
    opposite = _weight(radius + length, radius - length)
    return length - radius, direction, scale((1.0 - opposite) / (1.0 + opposite), direction)


@inlined
def _to_half_space(point: Vector, normal: Vector, offset: float) -> Nearest:
    inward = negative(normal)
    return dot(normal, point) - offset, inward, inward


@building_block
def _to_box(point: Vector, center: Vector, axes: Axes, half_size: Vector) -> Nearest:
    """`axes`: the unit vectors along the box's edges."""
    offset = subtract(point, center)
    local = dot(axes[0], offset), dot(axes[1], offset), dot(axes[2], offset)
    beyond = abs(local[0]) - half_size[0], abs(local[1]) - half_size[1], abs(local[2]) - half_size[2]
    excess = max(beyond[0], 0.0), max(beyond[1], 0.0), max(beyond[2], 0.0)
    distance = norm(excess)
    towards = 0.0, 0.0, 0.0
    if distance > 0.0:
        for k in range(3):
            towards = add(towards, scale(math.copysign(excess[k] / distance, -local[k]), axes[k]))
        return distance, towards, towards
    nearest = 0
    for k in (1, 2):
        if beyond[k] > beyond[nearest]:
            nearest = k
    # The ways out are those through the six faces: along each axis a nearer and a farther one.
    deepening = 0.0, 0.0, 0.0
    total = 0.0
    for k in range(3):
        nearer = _weight(-beyond[k], -beyond[nearest])
        farther = _weight(half_size[k] + abs(local[k]), -beyond[nearest])
        deepening = add(deepening, scale(math.copysign(nearer - farther, -local[k]), axes[k]))
        total += nearer + farther
    inward = scale(math.copysign(1.0, -local[nearest]), axes[nearest])
    return beyond[nearest], inward, scale(1.0 / total, deepening)


@inlined
def _axes(rotations: FloatArray, row: int) -> Axes:
    columns = rotations[row].T
    return load(columns, 0), load(columns, 1), load(columns, 2)


@inlined
def _edge_foot(start: Vector, end: Vector) -> Vector:
    """The point of an edge that is nearest to the origin."""
    edge = subtract(end, start)
    squared_length = dot(edge, edge)
    if squared_length == 0.0:
        return start
    along = min(max(-dot(start, edge) / squared_length, 0.0), 1.0)
    return add(start, scale(along, edge))


@inlined
def _face(a: Vector, b: Vector, c: Vector, orientation: float) -> tuple[float, Vector, bool]:
    """The origin's height over the face abc, the face's outward normal, and whether the origin's foot lies within."""
    raw = cross(subtract(b, a), subtract(c, a))
    area = norm(raw)
    if area == 0.0:
        return 0.0, (0.0, 0.0, 0.0), False
    normal = scale(orientation / area, raw)
    # The foot lies on the inner side of the edge from u to v where raw · (u x v) >= 0.
    foot_inside = dot(raw, cross(a, b)) >= 0.0 and dot(raw, cross(b, c)) >= 0.0 and dot(raw, cross(c, a)) >= 0.0
    return -dot(normal, a), normal, foot_inside


@inlined
def _corners(vertices: FloatArray, row: int) -> Vertices:
    four = vertices[row]
    return load(four, 0), load(four, 1), load(four, 2), load(four, 3)


@building_block
def _to_tetrahedron(point: Vector, corners: Vertices) -> Nearest:
    a, b = subtract(corners[0], point), subtract(corners[1], point)
    c, d = subtract(corners[2], point), subtract(corners[3], point)
    vertices = a, b, c, d
    six_volumes = dot(cross(subtract(c, b), subtract(d, b)), subtract(b, a))
    orientation = -1.0 if six_volumes < 0.0 else 1.0
    # In this order the faces' normals point outward where the vertices are positively oriented.
    faces = (
        _face(b, c, d, orientation),
        _face(a, d, c, orientation),
        _face(a, b, d, orientation),
        _face(a, c, b, orientation),
    )
    foot = 0.0, 0.0, 0.0
    squared_distance = math.inf
    for start in range(3):
        for end in range(start + 1, 4):
            on_edge = _edge_foot(vertices[start], vertices[end])
            if dot(on_edge, on_edge) < squared_distance:
                foot, squared_distance = on_edge, dot(on_edge, on_edge)
    nearest = 0
    for k in range(4):
        height, normal, foot_inside = faces[k]
        # A foot that rounding puts just off its face does no harm: the edge there is as near.
        if foot_inside and height * height < squared_distance:
            foot, squared_distance = scale(-height, normal), height * height
        if height > faces[nearest][0]:
            nearest = k
    distance = math.sqrt(squared_distance)
    if distance > 0.0 and (six_volumes == 0.0 or faces[nearest][0] > 0.0):
        direction = scale(1.0 / distance, foot)
        return distance, direction, direction
    distance = faces[nearest][0]
    direction = negative(faces[nearest][1])
    # On a tetrahedron without any area there is no face to take the normal of.
    if dot(direction, direction) == 0.0:
        direction = _ANY_DIRECTION
    if distance >= 0.0:
        return distance, direction, direction
    # The ways out are those through the four faces.
    deepening = 0.0, 0.0, 0.0
    total = 0.0
    for k in range(4):
        weight = _weight(-faces[k][0], -distance)
        deepening = add(deepening, scale(-weight, faces[k][1]))
        total += weight
    return distance, direction, scale(1.0 / total, deepening)


@compiled(input_array(2), input_array(2), input_array(1), *_INDICES, *_RESULTS)
def sphere_pairs(
    points: FloatArray,
    centers: FloatArray,
    radii: FloatArray,
    point_index: IntArray,
    primitive_index: IntArray,
    distance: FloatArray,
    direction: FloatArray,
    deepening: FloatArray,
) -> None:
    """Spheres centers (s, 3), radii (s,)."""
    for pair in range(point_index.size):
        point, other = load(points, point_index[pair]), primitive_index[pair]
        _store(pair, _to_sphere(point, load(centers, other), radii[other]), distance, direction, deepening)


@compiled(input_array(2), input_array(2), input_array(3), input_array(2), *_INDICES, *_RESULTS)
def box_pairs(
    points: FloatArray,
    centers: FloatArray,
    rotations: FloatArray,
    half_sizes: FloatArray,
    point_index: IntArray,
    primitive_index: IntArray,
    distance: FloatArray,
    direction: FloatArray,
    deepening: FloatArray,
) -> None:
    """Boxes centers (b, 3), rotations (b, 3, 3) box to world, half sizes (b, 3)."""
    for pair in range(point_index.size):
        point, other = load(points, point_index[pair]), primitive_index[pair]
        nearest = _to_box(point, load(centers, other), _axes(rotations, other), load(half_sizes, other))
        _store(pair, nearest, distance, direction, deepening)


@compiled(input_array(2), input_array(3), *_INDICES, *_RESULTS)
def tetrahedron_pairs(
    points: FloatArray,
    vertices: FloatArray,
    point_index: IntArray,
    primitive_index: IntArray,
    distance: FloatArray,
    direction: FloatArray,
    deepening: FloatArray,
) -> None:
    """Tetrahedra (t, 4, 3), in any vertex order; one of zero volume is a flat plate without an inside."""
    for pair in range(point_index.size):
        nearest = _to_tetrahedron(load(points, point_index[pair]), _corners(vertices, primitive_index[pair]))
        _store(pair, nearest, distance, direction, deepening)


@compiled(input_array(2), input_array(2), input_array(1), *_INDICES, *_RESULTS)
def half_space_pairs(
    points: FloatArray,
    normals: FloatArray,
    offsets: FloatArray,
    point_index: IntArray,
    primitive_index: IntArray,
    distance: FloatArray,
    direction: FloatArray,
    deepening: FloatArray,
) -> None:
    """Half-spaces normals (h, 3), offsets (h,), solid where normal·x <= offset."""
    for pair in range(point_index.size):
        point, other = load(points, point_index[pair]), primitive_index[pair]
        _store(pair, _to_half_space(point, load(normals, other), offsets[other]), distance, direction, deepening)


@compiled(
    input_array(2),
    COUNT,
    *(input_indices(), input_array(2), input_array(1)),
    *(input_indices(), input_array(2), input_array(3), input_array(2)),
    *(input_indices(), input_array(3)),
    *(input_indices(), input_array(2), input_array(1)),
    returns=NUMBER,
)
def object_distance(
    points: FloatArray,
    index: int,
    sphere_object: IntArray,
    sphere_centers: FloatArray,
    sphere_radii: FloatArray,
    box_object: IntArray,
    box_centers: FloatArray,
    box_rotations: FloatArray,
    box_half_sizes: FloatArray,
    tetrahedron_object: IntArray,
    vertices: FloatArray,
    half_space_object: IntArray,
    normals: FloatArray,
    offsets: FloatArray,
) -> float:
    """Signed distance of the one point (1, 3) to the nearest primitive of the object `index`; infinite without any."""
    point = load(points, 0)
    least = math.inf
    for row in range(sphere_object.size):
        if sphere_object[row] == index:
            least = min(least, _to_sphere(point, load(sphere_centers, row), sphere_radii[row])[0])
    for row in range(box_object.size):
        if box_object[row] == index:
            center, half_size = load(box_centers, row), load(box_half_sizes, row)
            least = min(least, _to_box(point, center, _axes(box_rotations, row), half_size)[0])
    for row in range(tetrahedron_object.size):
        if tetrahedron_object[row] == index:
            least = min(least, _to_tetrahedron(point, _corners(vertices, row))[0])
    for row in range(half_space_object.size):
        if half_space_object[row] == index:
            least = min(least, _to_half_space(point, load(normals, row), offsets[row])[0])
    return least
