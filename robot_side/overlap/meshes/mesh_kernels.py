"""Distances of (point, placed mesh) pairs in contiguous arrays, for calls in a tick.

Arguments are not checked, as in `kernels`. A placed mesh is queried in its own frame. There a point, or a sphere's
centre, is Qᵀ (centre - position), with Q the rotation from the mesh's frame to the world.
"""

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import (
    building_block,
    compiled,
    inlined,
    input_array,
    input_indices,
    output_array,
    tuple_type,
)
from robot_side.compiled.vectors import Vector, dot, load, negative, norm, scale
from robot_side.overlap.digits.double_double import DoubleDouble, multiple, plus, two_sum
from robot_side.overlap.digits.double_double_vectors import PreciseVector, highs
from robot_side.overlap.meshes.mesh_tables import MeshTables
from robot_side.overlap.meshes.tree_queries import nearest_triangle, winding_number

TABLES = tuple_type(
    *(input_array(2), input_array(2), input_array(2), input_indices(), input_array(2), input_indices(), input_array(1)),
    named=MeshTables,
)
"""Numba type of `MeshTables`"""
PLACED_ARGUMENTS = (input_indices(), input_array(2), input_array(3))
"""Numba types of placed meshes: indices of the meshes (q,), positions (q, 3) and rotations (q, 3, 3)"""

_ON_SURFACE = 1e-12
"""Distance from the surface, as a share of the mesh's size, up to which the nearest triangle's normal decides whether a
point is inside; the winding number decides farther away"""


@inlined
def to_mesh(center: Vector, positions: FloatArray, rotations: FloatArray, pair: int) -> PreciseVector:
    """Return a sphere's centre in the mesh's frame, in double-double.

    One double would be too coarse for a small sphere at the far end of a large mesh.
    """
    away = (
        two_sum(center[0], -positions[pair, 0]),
        two_sum(center[1], -positions[pair, 1]),
        two_sum(center[2], -positions[pair, 2]),
    )
    turned = rotations[pair].T
    return (
        _product(load(turned, 0), away),
        _product(load(turned, 1), away),
        _product(load(turned, 2), away),
    )


@inlined
def _product(a: Vector, b: PreciseVector) -> DoubleDouble:
    return plus(plus(multiple(a[0], b[0]), multiple(a[1], b[1])), multiple(a[2], b[2]))


@inlined
def to_world(rotations: FloatArray, pair: int, vector: Vector) -> Vector:
    """Rotate a vector from the frame of a placed mesh to the world frame."""
    rotation = rotations[pair]
    return dot(load(rotation, 0), vector), dot(load(rotation, 1), vector), dot(load(rotation, 2), vector)


@building_block
def _signed_distance(tables: MeshTables, mesh: int, point: Vector) -> tuple[float, Vector]:
    """Return (signed distance of `point` in m, negative inside; unit vector along which it falls fastest).

    Both are in the mesh's frame.
    """
    triangle, foot = nearest_triangle(tables, mesh, point)
    distance = norm(foot)
    normal = tables.triangles[triangle, 9], tables.triangles[triangle, 10], tables.triangles[triangle, 11]
    root = tables.roots[mesh]
    size = 0.0
    for axis in range(3):
        size = max(size, tables.boxes[root, 3 + axis] - tables.boxes[root, axis])
    if distance <= _ON_SURFACE * size:
        return (distance if dot(foot, normal) <= 0.0 else -distance), negative(normal)
    outward = scale(1.0 / distance, foot)
    if winding_number(tables, mesh, point) > 0:
        return -distance, negative(outward)
    return distance, outward


@compiled(
    *(input_array(2), *PLACED_ARGUMENTS),
    TABLES,
    *(output_array(1), output_array(2)),
)
def nearest_loop(
    centers: FloatArray,
    mesh_index: IntArray,
    positions: FloatArray,
    rotations: FloatArray,
    tables: MeshTables,
    distances: FloatArray,
    directions: FloatArray,
) -> None:
    """Fill the centres' signed distances (m) from placed meshes, and directions in the world frame, one mesh each.

    The signed distance falls fastest along the direction. Row by row, `mesh_index`, `positions` and `rotations` are the
    placed mesh of the centre in the same row.
    """
    for pair in range(mesh_index.size):
        point = to_mesh(load(centers, pair), positions, rotations, pair)
        distance, direction = _signed_distance(tables, mesh_index[pair], highs(point))
        distances[pair] = distance
        directions[pair, 0], directions[pair, 1], directions[pair, 2] = to_world(rotations, pair, direction)
