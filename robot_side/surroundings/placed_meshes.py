"""Placed meshes of a scene: contact and overlap with a sphere, by kernels that are called by address.

A scene without meshes does not load this module.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from robot_side.compiled.columns import FLAGS, INDICES, NUMBERS, Declared, matrices, rows
from robot_side.compiled.kernel import FLOAT64, INT64, compiled, inlined
from robot_side.compiled.vectors import Vector, dot, load, subtract
from robot_side.overlap.meshes.mesh_kernels import to_world
from robot_side.overlap.meshes.mesh_tables import FIELDS, MeshTables
from robot_side.overlap.meshes.rounded_overlap import rounded_overlap
from robot_side.overlap.meshes.tree_queries import is_clear_of
from robot_side.overlap.meshes.triangle_lanes import SCRATCH
from robot_side.surroundings.kinds.layout import (
    CONTACT,
    CROSSINGS,
    LEAST_CONTACT_M,
    MESH_CONTACT,
    NEVER,
    OVERLAP,
    Contact,
)
from robot_side.surroundings.kinds.mesh_contact import closing_at, crossings_of, next_touch, overlaps, swept
from robot_side.surroundings.perceived import PerceivedObjects


class MeshColumns(NamedTuple):
    """Columns of placed meshes and of their library, for kernels; the fields are those of PlacedMeshes."""

    rows: IntArray
    mesh: IntArray
    positions: FloatArray
    rotations: FloatArray
    triangles: FloatArray
    spheres: FloatArray
    boxes: FloatArray
    links: IntArray
    moments: FloatArray
    roots: IntArray
    volumes: FloatArray
    convex: BoolArray
    near: IntArray
    scratch: FloatArray


MESHES: Final = Declared(
    MeshColumns,
    *(INDICES, INDICES, rows(3), matrices(3, 3)),
    *(rows(FIELDS), rows(4), rows(6), INDICES, rows(7), INDICES, NUMBERS, FLAGS),
    *(INDICES, NUMBERS),
)
_at = MESHES.at


class PlacedMeshes:
    """Meshes of one scene table; their positions and rotations are updated with the movers."""

    def __init__(self, objects: PerceivedObjects, rows_of_kind: IntArray) -> None:
        """rows_of_kind (n,): for each row of the scene table, its index among the primitives of its kind."""
        if objects.mesh_library is None:
            raise ValueError("objects.mesh_library is None; valid: the library of the placed meshes")
        self.rows = rows_of_kind
        self.mesh = objects.mesh_index
        self.positions, self.rotations = objects.mesh_positions_m.copy(), objects.mesh_rotations.copy()
        library = objects.mesh_library
        tables, self.convex = library.tables, library.convex
        self.triangles, self.spheres, self.boxes, self.links, self.moments, self.roots, self.volumes = tables
        self.near, self.scratch = np.empty(len(self.triangles) + 1, np.int64), np.empty(SCRATCH)
        self.bundle = MESHES.bundle(self)
        self.overlap, self.contact = overlap_one_mesh.address, contact_with_mesh.address
        self.crossings = crossings_of_mesh.address


@inlined
def _tables(meshes: MeshColumns) -> MeshTables:
    return MeshTables(
        meshes.triangles, meshes.spheres, meshes.boxes, meshes.links, meshes.moments, meshes.roots, meshes.volumes
    )


@inlined
def _turned_back(rotation: FloatArray, vector: Vector) -> Vector:
    turned = rotation.T
    return dot(load(turned, 0), vector), dot(load(turned, 1), vector), dot(load(turned, 2), vector)


@compiled(*OVERLAP, returns=FLOAT64)
def overlap_one_mesh(
    _shapes: FloatArray,
    row: int,
    x: float,
    y: float,
    z: float,
    radius: float,
    bundle: IntArray,
    overlap_gradient: FloatArray,
) -> float:
    """Return the overlap of a sphere with the closed mesh in `row`."""
    meshes = _at(bundle)
    tables, place, center = _tables(meshes), meshes.rows[row], (x, y, z)
    mesh = meshes.mesh[place]
    overlap_gradient[0] = overlap_gradient[1] = overlap_gradient[2] = 0.0
    own = _turned_back(meshes.rotations[place], subtract(center, load(meshes.positions, place)))
    if is_clear_of(tables, mesh, own, radius):
        return 0.0
    volume, gradient = rounded_overlap(own, radius, tables, mesh, meshes.near, meshes.scratch)
    overlap_gradient[0], overlap_gradient[1], overlap_gradient[2] = to_world(meshes.rotations, place, gradient)
    return volume


@compiled(*CONTACT, returns=MESH_CONTACT)
def contact_with_mesh(
    bundle: IntArray,
    row: int,
    x: float,
    y: float,
    z: float,
    u: float,
    v: float,
    w: float,
    radius: float,
    reach: float,
    inside: bool,
) -> Contact:
    """Return the first contact of a sphere at (x, y, z) that moves along (u, v, w); û·n is 0 unless the mesh is convex.

    inside: return the distance to the next triangle in front, even if sphere and mesh overlap.
    """
    meshes = _at(bundle)
    tables, place = _tables(meshes), meshes.rows[row]
    rotation, mesh = meshes.rotations[place], meshes.mesh[place]
    start = _turned_back(rotation, subtract((x, y, z), load(meshes.positions, place)))
    sweep = swept(start, _turned_back(rotation, (u, v, w)), radius, reach)
    if not inside and overlaps(tables, mesh, sweep):
        return 0.0, 1.0 if meshes.convex[mesh] else 0.0
    found, triangle = next_touch(tables, mesh, sweep, meshes.near, meshes.scratch)
    if not found <= reach:
        return NEVER
    found = max(found, 0.0 if inside else LEAST_CONTACT_M)
    return found, closing_at(tables, triangle, sweep, found) if meshes.convex[mesh] else 0.0


@compiled(*CROSSINGS, returns=INT64)
def crossings_of_mesh(
    bundle: IntArray,
    row: int,
    x: float,
    y: float,
    z: float,
    u: float,
    v: float,
    w: float,
    crossings: FloatArray,
    count: int,
) -> int:
    """Append where the line from (x, y, z) along (u, v, w) enters and leaves the mesh in `row`; return the new count.

    crossings (n, 2): distance, and 1 where the line enters or -1 where it leaves; the first `count` are there already.
    What finds no room is left out.
    """
    meshes = _at(bundle)
    tables, place = _tables(meshes), meshes.rows[row]
    rotation, mesh = meshes.rotations[place], meshes.mesh[place]
    start = _turned_back(rotation, subtract((x, y, z), load(meshes.positions, place)))
    along = _turned_back(rotation, (u, v, w))
    return crossings_of(tables, mesh, swept(start, along, 0.0, math.inf), crossings, count)
