"""Surfaces of mesh geoms and of height fields, read from the shared arrays of a compiled MuJoCo model."""

from itertools import product
from typing import Any

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.drivers.mujoco.model_enums import GeomKind

_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def mesh_vertices(model: Any, geom: int) -> FloatArray:
    """Return the vertices (v, 3) of a mesh geom, in m, in the geom's frame."""
    mesh = int(model.geom_dataid[geom])
    first = int(model.mesh_vertadr[mesh])
    vertices: FloatArray = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].astype(np.float64)
    return vertices


def mesh_triangles(model: Any, geom: int) -> IntArray:
    """Return the triangles (t, 3) of a mesh geom, as indices into `mesh_vertices`."""
    mesh = int(model.geom_dataid[geom])
    first = int(model.mesh_faceadr[mesh])
    triangles: IntArray = model.mesh_face[first : first + int(model.mesh_facenum[mesh])].astype(np.int64)
    return triangles


def geom_points(model: Any, data: Any, geoms: IntArray) -> FloatArray:
    """Return points (p, 3), in the world, whose convex hull contains the geoms: a mesh's vertices, corners of a box."""
    placed = [np.empty((0, 3))]
    for geom in geoms.tolist():
        is_mesh, box = model.geom_type[geom] == GeomKind.MESH, model.geom_aabb[geom]
        points = mesh_vertices(model, geom) if is_mesh else box[:3] + _CORNERS * box[3:]
        placed.append(points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return np.concatenate(placed)


def height_field_surface(model: Any, geom: int) -> tuple[FloatArray, IntArray]:
    """Return the solid of a height field with its base: vertices (v, 3) in m in the geom's frame, and triangles (t, 3).

    As in MuJoCo's collisions, the two triangles of a cell share the diagonal from its least to its greatest x and y.
    """
    field = int(model.geom_dataid[geom])
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, height, base = model.hfield_size[field].tolist()
    first = int(model.hfield_adr[field])
    elevations = model.hfield_data[first : first + rows * columns].astype(np.float64)
    y, x = np.meshgrid(np.linspace(-half_y, half_y, rows), np.linspace(-half_x, half_x, columns), indexing="ij")
    top = np.column_stack([x.ravel(), y.ravel(), height * elevations])
    numbers = np.arange(rows * columns).reshape(rows, columns)
    here, right = numbers[:-1, :-1].ravel(), numbers[:-1, 1:].ravel()
    beyond, across = numbers[1:, :-1].ravel(), numbers[1:, 1:].ravel()
    # Rim of the field, anticlockwise from above; the base has a vertex below each of these, and one in its middle.
    rim = np.concatenate([numbers[0, :-1], numbers[:-1, -1], numbers[-1, :0:-1], numbers[:0:-1, 0]])
    bottom = top[rim] * [1.0, 1.0, 0.0] - [0.0, 0.0, base]
    below = len(top) + np.arange(len(rim))
    next_rim, next_below = np.roll(rim, -1), np.roll(below, -1)
    amid = np.full(len(rim), len(top) + len(rim))
    triangles = [
        *((here, right, across), (here, across, beyond)),
        *((below, next_below, next_rim), (below, next_rim, rim)),
        (amid, next_below, below),
    ]
    return (
        np.concatenate([top, bottom, [[0.0, 0.0, -base]]]),
        np.concatenate([np.column_stack(corners) for corners in triangles]),
    )
