"""Exact overlap volumes of spheres with solids, their gradients, and `warm_up` to compile beforehand.

Read `volumes` and `meshes.mesh` for the functions, `lanes.face_angles` for the idea, `lanes.tetrahedron_lane` and
`lanes.box_lane` for how it is used, `precise.polyhedron` for what tiny overlaps need, and `kernels` for what a 1 kHz
tick calls.
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
    """What deals with meshes, loaded when first asked for: who has none does not wait for their kernels to compile."""
    if name == "MeshLibrary":
        return import_module("robot_side.overlap.meshes.mesh_library").MeshLibrary
    if name in {"Mesh", "sphere_mesh"}:
        return getattr(import_module("robot_side.overlap.meshes.mesh"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
