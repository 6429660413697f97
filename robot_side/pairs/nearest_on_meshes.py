"""The nearest point of a placed mesh's surface, as `nearest_kernels` has it for the other primitives.

Only a scene with meshes imports this module, and so compiles the mesh kernels.

A mesh may have any number of ways out, and faces that none of them leads through. Its deepening vector is therefore
not a sum over faces, as a tetrahedron's: it is the mean of the direction over a ball about the point, a third of the
depth in radius. By the divergence theorem that mean follows from signed distances on the ball alone, which are
continuous while the direction jumps; the ends of three diameters along the mesh's axes stand for the whole ball. As
for the other primitives the vector has length 1 near a face, and 0 in the middle of a plate or of a sphere.
"""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.objects.mesh_bounds import mesh_bounds
from robot_side.overlap.meshes.mesh_library import MeshLibrary, nearest_mesh_pairs

_BALL = 1.0 / 3.0
"""Radius of the ball as a share of the depth. In a plate the vector shrinks over the last quarter of the way from the
face to the middle; that of a box has fallen to 0.77 where this begins."""

_SHALLOW = 1e-9
"""Less deep than this share of the mesh's size, differences of distances are mostly rounding."""


def nearest_on_meshes(
    points_m: FloatArray, library: MeshLibrary, mesh_index: IntArray, positions_m: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Signed distance (p,) in metres, direction (p, 3) and deepening (p, 3) of points (p, 3) and placed meshes.

    `mesh_index` (p,) into `library`, `positions_m` (p, 3), `rotations` (p, 3, 3) mesh to world. The deepening of a
    point outside is the direction.
    """
    distance, direction = nearest_mesh_pairs(points_m, library, mesh_index, positions_m, rotations)
    deepening = direction.copy()
    inside = np.flatnonzero(-distance > _SHALLOW * mesh_bounds(library).radii_m.take(mesh_index))
    if len(inside):
        deepening[inside] = _deepening(
            points_m.take(inside, axis=0),
            -distance.take(inside),
            library,
            mesh_index.take(inside),
            positions_m.take(inside, axis=0),
            rotations.take(inside, axis=0),
        )
    return distance, direction, deepening


def _deepening(
    points_m: FloatArray,
    depths_m: FloatArray,
    library: MeshLibrary,
    mesh_index: IntArray,
    positions_m: FloatArray,
    rotations: FloatArray,
) -> FloatArray:
    """(q, 3) of points inside, at depths (q,) above 0."""
    axes = rotations.swapaxes(1, 2)
    reach = _BALL * depths_m
    radii = reach[:, None, None] * axes
    ends = np.stack([points_m[:, None] - radii, points_m[:, None] + radii], axis=2)
    points = np.ascontiguousarray(ends).reshape(-1, 3)
    placed = np.repeat(positions_m, 6, axis=0), np.repeat(rotations, 6, axis=0)
    distances, _ = nearest_mesh_pairs(points, library, np.repeat(mesh_index, 6), *placed)
    behind, ahead = np.moveaxis(distances.reshape(-1, 3, 2), 2, 0)
    vectors: FloatArray = np.einsum("qa,qai->qi", (behind - ahead) / (2.0 * reach[:, None]), axes)
    lengths = np.linalg.norm(vectors, axis=1)
    bounded: FloatArray = vectors / np.maximum(lengths, 1.0)[:, None]
    return bounded
