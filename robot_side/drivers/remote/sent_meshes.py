"""Meshes that a perception process has defined by name."""

import numpy as np

from robot_side.drivers.remote.frame_message import MOST_MESHES, MOST_TRIANGLES, SentMesh

# These load the kernels that meshes need, so that none is compiled when the first mesh comes.
from robot_side.overlap.meshes.mesh import Mesh
from robot_side.overlap.meshes.mesh_library import MeshLibrary, Source
from robot_side.surroundings import placed_meshes  # noqa: F401


class SentMeshes:
    """Meshes by name; a mesh keeps its index. Immutable."""

    def __init__(self) -> None:
        self.library: MeshLibrary | None = None
        """Library of all meshes; None before the first"""
        self.index: dict[str, int] = {}
        """Index of each mesh in the library"""
        self._meshes: list[Mesh] = []
        self._sources: list[Source] = []

    def and_also(self, new: dict[str, tuple[Mesh, Source]]) -> "SentMeshes":
        """Return these meshes with others, which replace those of the same names; ValueError if they are too many."""
        if all(name in self.index and self._sources[self.index[name]] == source for name, (_, source) in new.items()):
            return self
        found = SentMeshes()
        found.index, found._meshes, found._sources = dict(self.index), list(self._meshes), list(self._sources)
        for name, (mesh, source) in new.items():
            if (place := found.index.setdefault(name, len(found._meshes))) < len(found._meshes):
                found._meshes[place], found._sources[place] = mesh, source
            else:
                found._meshes.append(mesh)
                found._sources.append(source)
        triangles = sum(mesh.triangle_count for mesh in found._meshes)
        if len(found._meshes) > MOST_MESHES or triangles > MOST_TRIANGLES:
            raise ValueError(
                f"meshes: {len(found._meshes)} with {triangles} triangles are known; valid: up to {MOST_MESHES} with"
                f" {MOST_TRIANGLES} triangles"
            )
        found.library = MeshLibrary(found._meshes, tuple(found._sources))
        return found


def prepared(name: str, sent: SentMesh) -> tuple[Mesh, Source]:
    """Return a mesh for `and_also`; ValueError names it if it is not closed, or not oriented outward."""
    vertices_m = np.array(sent.vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.array(sent.triangles, dtype=np.int64).reshape(-1, 3)
    try:
        mesh = Mesh(vertices_m, triangles)
    except ValueError as error:
        raise ValueError(f"meshes: {name!r}: {error}") from error
    return mesh, Source(vertices_m.tobytes(), triangles.tobytes())
