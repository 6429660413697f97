"""Exact overlap volumes of spheres with simple solids, their gradients, and `warm_up` to compile beforehand.

Read `volumes` and `mesh` for the functions, `orthoscheme` and `triangle_lanes` for the ideas, `kernels` for what a
1 kHz tick calls.
"""

from robot_side.overlap.kernels import warm_up
from robot_side.overlap.mesh import Mesh, sphere_mesh
from robot_side.overlap.mesh_library import MeshLibrary
from robot_side.overlap.volumes import sphere_box, sphere_half_space, sphere_sphere, sphere_tetrahedron

__all__ = [
    "Mesh",
    "MeshLibrary",
    "sphere_box",
    "sphere_half_space",
    "sphere_mesh",
    "sphere_sphere",
    "sphere_tetrahedron",
    "warm_up",
]
