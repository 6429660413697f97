"""Exact overlap volumes of spheres with solids and their gradients; `warm_up` compiles the kernels beforehand.

The public functions are in `volumes` and `meshes.mesh`; faster ones for a 1 kHz tick, without checks, in `kernels`.
`lanes.face_angles` explains the method, which `lanes.tetrahedron_lane` and `lanes.box_lane` use. `precise.polyhedron`
computes overlaps that are too small for it.
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
    """Import the names for meshes on first use, so that a program without meshes does not compile their kernels."""
    if name == "MeshLibrary":
        return import_module("robot_side.overlap.meshes.mesh_library").MeshLibrary
    if name in {"Mesh", "sphere_mesh"}:
        return getattr(import_module("robot_side.overlap.meshes.mesh"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
