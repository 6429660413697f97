"""Overlaps of (sphere, placed mesh) pairs in contiguous arrays, for the library; a scene's law has `placed_meshes`.

No robot side imports this module, and so none compiles its kernel.
"""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import compiled, input_array, input_indices, output_array, output_indices
from robot_side.compiled.stack import on_stack
from robot_side.compiled.vectors import dot, load, subtract
from robot_side.overlap.meshes.mesh_kernels import PLACED_ARGUMENTS, TABLES, to_mesh, to_world
from robot_side.overlap.meshes.mesh_overlap import mesh_overlap
from robot_side.overlap.meshes.mesh_tables import MeshTables
from robot_side.overlap.meshes.tree_queries import is_clear_of
from robot_side.overlap.meshes.triangle_lanes import SCRATCH
from robot_side.overlap.solids.solid import Overlaps

_scratch = on_stack(SCRATCH)


def mesh_pairs(
    centers: FloatArray,
    radii: FloatArray,
    tables: MeshTables,
    mesh_index: IntArray,
    positions: FloatArray,
    rotations: FloatArray,
) -> Overlaps:
    """Return the overlap of each sphere (`centers` (p, 3), `radii` (p,)) with one placed mesh.

    tables: of a mesh library. mesh_index, positions and rotations: as for `nearest_mesh_pairs`. The result is (volumes
    (p,), gradients (p, 3), areas (p,)), as in `kernels`. Nothing is checked: a wrong index reads beyond the arrays.
    """
    count = len(radii)
    volumes, gradients, areas = np.empty(count), np.empty((count, 3)), np.empty(count)
    touched = np.empty(count, dtype=np.int64)
    placed, results = (mesh_index, positions, rotations), (volumes, gradients, areas, touched)
    overlap_loop(centers, radii, np.arange(count), *placed, tables, *results, tables.room())
    return volumes, gradients, areas


@compiled(
    *(input_array(2), input_array(1), input_indices(), *PLACED_ARGUMENTS),
    TABLES,
    *(output_array(1), output_array(2), output_array(1), output_indices(), output_indices()),
)
def overlap_loop(
    centers: FloatArray,
    radii: FloatArray,
    placed: IntArray,
    mesh_index: IntArray,
    positions: FloatArray,
    rotations: FloatArray,
    tables: MeshTables,
    volumes: FloatArray,
    gradients: FloatArray,
    areas: FloatArray,
    touched: IntArray,
    near: IntArray,
) -> None:
    """Fill volumes, gradients (in the world frame), areas, and `touched`: how many triangles each pair evaluated.

    placed (p,): each sphere's placed mesh, as a row of mesh_index, positions and rotations. near: scratch with room for
    all triangles and one more.
    """
    scratch = _scratch()
    for pair in range(radii.size):
        place, radius = placed[pair], radii[pair]
        mesh = mesh_index[place]
        away = subtract(load(centers, pair), load(positions, place))
        turned = rotations[place].T
        rounded = dot(load(turned, 0), away), dot(load(turned, 1), away), dot(load(turned, 2), away)
        if is_clear_of(tables, mesh, rounded, radius):
            volumes[pair], areas[pair], touched[pair] = 0.0, 0.0, 0
            gradients[pair, 0], gradients[pair, 1], gradients[pair, 2] = 0.0, 0.0, 0.0
            continue
        center = to_mesh(load(centers, pair), positions, rotations, place)
        overlap, count = mesh_overlap(center, radius, tables, mesh, near, scratch)
        gradient = to_world(rotations, place, overlap[1])
        volumes[pair], areas[pair], touched[pair] = overlap[0], overlap[2], count
        gradients[pair, 0], gradients[pair, 1], gradients[pair, 2] = gradient
