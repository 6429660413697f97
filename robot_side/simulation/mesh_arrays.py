"""The surface of a mesh geom, out of the arrays in which a compiled MuJoCo model keeps all meshes."""

from typing import Any

import numpy as np

from common.arrays import FloatArray, IntArray


def mesh_vertices(model: Any, geom: int) -> FloatArray:
    """Vertices (v, 3) in m, in the geom's frame."""
    mesh = int(model.geom_dataid[geom])
    first = int(model.mesh_vertadr[mesh])
    vertices: FloatArray = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].astype(np.float64)
    return vertices


def mesh_triangles(model: Any, geom: int) -> IntArray:
    """Triangles (t, 3), indices of `mesh_vertices`."""
    mesh = int(model.geom_dataid[geom])
    first = int(model.mesh_faceadr[mesh])
    triangles: IntArray = model.mesh_face[first : first + int(model.mesh_facenum[mesh])].astype(np.int64)
    return triangles
