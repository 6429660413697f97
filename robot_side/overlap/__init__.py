"""Exact overlap volumes of spheres with solids, their gradients, and `warm_up` to compile beforehand.

The functions are in `volumes` and `meshes.mesh`, those for a 1 kHz tick in `kernels`. `lanes.face_angles` explains the
method. `lanes.tetrahedron_lane` and `lanes.box_lane` use it, `precise.polyhedron` has the tiny overlaps.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from robot_side.compiled.warm_up import warm_up
from robot_side.overlap.volumes import sphere_box, sphere_half_space, sphere_sphere, sphere_tetrahedron

if TYPE_CHECKING:
    from robot_side.overlap.meshes.mesh import Mesh, sphere_mesh
    from robot_side.overlap.meshes.mesh_library import MeshLibrary

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


def __getattr__(name: str) -> Any:
    """Load the names for meshes on first use: a program without meshes does not compile their kernels."""
    if name == "MeshLibrary":
        return import_module("robot_side.overlap.meshes.mesh_library").MeshLibrary
    if name in {"Mesh", "sphere_mesh"}:
        return getattr(import_module("robot_side.overlap.meshes.mesh"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
