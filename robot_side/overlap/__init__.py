"""Exact overlap volumes of spheres with solids and their gradients; `warm_up` compiles the kernels beforehand.

The public functions are in `volumes` and `meshes.mesh`; faster ones for a tick, without checks, in `kernels`.
`solids.face_angles` explains the method, which `solids.tetrahedron_lane` and `solids.box_lane` use.
`precise.polyhedron` computes overlaps that are too small for it. The batches compute 64 pairs at a time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from robot_side.compiled.warm_up import warm_up
    from robot_side.overlap.meshes.mesh import Mesh, sphere_mesh
    from robot_side.overlap.meshes.mesh_library import MeshLibrary
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
_OF_MESHES: Final = "robot_side.overlap.meshes.mesh_pairs"
_MODULES: Final = {
    "Mesh": (_OF_MESHES, "robot_side.overlap.meshes.mesh"),
    "MeshLibrary": (_OF_MESHES, "robot_side.overlap.meshes.mesh_library"),
    "sphere_mesh": (_OF_MESHES, "robot_side.overlap.meshes.mesh"),
    "warm_up": ("robot_side.compiled.warm_up",),
}
"""Modules to import, beside `volumes`, for a public name; the last one has it"""


def __getattr__(name: str) -> Any:
    """Import the library's modules, with their kernels, on the first use of a public name.

    A robot side uses none of these names, and so compiles none of these kernels.
    """
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    modules = [import_module(module) for module in ("robot_side.overlap.volumes", *_MODULES.get(name, ()))]
    return getattr(modules[-1], name)
