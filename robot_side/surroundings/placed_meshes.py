"""Meshes where a scene has them: contact and overlap of a sphere, by kernels that others call by their addresses.

A scene without meshes loads none of this.
"""

from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.compiled.columns import INDICES, NUMBERS, Declared, matrices, rows
from robot_side.compiled.kernel import NUMBER, compiled, inlined
from robot_side.compiled.vectors import Vector, dot, load, subtract
from robot_side.overlap.meshes.mesh_kernels import to_mesh, to_world
from robot_side.overlap.meshes.mesh_overlap import mesh_overlap
from robot_side.overlap.meshes.mesh_tables import FIELDS, MeshTables
from robot_side.overlap.meshes.tree_queries import is_clear_of
from robot_side.overlap.meshes.triangle_lanes import SCRATCH
from robot_side.surroundings.kinds.layout import CONTACT, OVERLAP
from robot_side.surroundings.kinds.mesh_contact import Sweep, next_touch, way
from robot_side.surroundings.perceived import PerceivedObjects


class MeshColumns(NamedTuple):
    """Placed meshes, and their library's tables; the fields are those of PlacedMeshes."""

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
    near: IntArray
    scratch: FloatArray


MESHES: Final = Declared(
    MeshColumns,
    *(INDICES, INDICES, rows(3), matrices(3, 3)),
    *(rows(FIELDS), rows(4), rows(6), INDICES, rows(7), INDICES, NUMBERS),
    *(INDICES, NUMBERS),
)
_at = MESHES.at


class PlacedMeshes:
    """The meshes of one scene table; positions and rotations follow the movers."""

    def __init__(self, objects: PerceivedObjects, rows_of_kind: IntArray) -> None:
        """rows_of_kind (n,): of each row of the scene table its place among the primitives of its kind."""
        if objects.mesh_library is None:
            raise ValueError("objects.mesh_library is None; valid: the library of the placed meshes")
        self.rows = rows_of_kind
        self.mesh = objects.mesh_index
        self.positions, self.rotations = objects.mesh_positions_m.copy(), objects.mesh_rotations.copy()
        tables = objects.mesh_library.tables
        self.triangles, self.spheres, self.boxes, self.links, self.moments, self.roots, self.volumes = tables
        self.near, self.scratch = np.empty(len(self.triangles) + 1, np.int64), np.empty(SCRATCH)
        self.bundle = MESHES.bundle(self)
        self.overlap, self.contact = overlap_one_mesh.address, contact_with_mesh.address


@inlined
def _tables(meshes: MeshColumns) -> MeshTables:
    return MeshTables(
        meshes.triangles, meshes.spheres, meshes.boxes, meshes.links, meshes.moments, meshes.roots, meshes.volumes
    )


@inlined
def _turned_back(rotation: FloatArray, vector: Vector) -> Vector:
    turned = rotation.T
    return dot(load(turned, 0), vector), dot(load(turned, 1), vector), dot(load(turned, 2), vector)


@compiled(*OVERLAP, returns=NUMBER)
def overlap_one_mesh(
    _shapes: FloatArray,
    row: int,
    x: float,
    y: float,
    z: float,
    radius: float,
    bundle: IntArray,
    push: FloatArray,
) -> float:
    """The overlap with a closed mesh."""
    meshes = _at(bundle)
    tables, place, center = _tables(meshes), meshes.rows[row], (x, y, z)
    mesh = meshes.mesh[place]
    push[0] = push[1] = push[2] = 0.0
    rounded = _turned_back(meshes.rotations[place], subtract(center, load(meshes.positions, place)))
    if is_clear_of(tables, mesh, rounded, radius):
        return 0.0
    precise = to_mesh(center, meshes.positions, meshes.rotations, place)
    found, _ = mesh_overlap(precise, radius, tables, mesh, meshes.near, meshes.scratch)
    push[0], push[1], push[2] = to_world(meshes.rotations, place, found[1])
    return found[0]


@compiled(*CONTACT, returns=NUMBER)
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
) -> float:
    """The distance at which a sphere at (x, y, z) that moves along (u, v, w) first touches; infinite beyond the reach.

    0 where it overlaps already; with `inside`, the distance to the next triangle in front instead.
    """
    meshes = _at(bundle)
    tables, place = _tables(meshes), meshes.rows[row]
    rotation, mesh = meshes.rotations[place], meshes.mesh[place]
    start = _turned_back(rotation, subtract((x, y, z), load(meshes.positions, place)))
    sweep = Sweep(start, _turned_back(rotation, (u, v, w)), radius, reach)
    return next_touch(tables, mesh, sweep) if inside else way(tables, mesh, sweep)
