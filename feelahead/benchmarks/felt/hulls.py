"""Objects made of meshes, each seen as one convex mesh: its hull, placed where the first of its meshes is."""

from dataclasses import replace

import numpy as np

from robot_side.objects.perceived import PerceivedObjects
from robot_side.overlap.meshes.mesh import Mesh
from robot_side.overlap.meshes.mesh_library import MeshLibrary
from robot_side.overlap.meshes.mesh_shapes import convex_hull_mesh
from robot_side.simulation.mesh_arrays import mesh_vertices
from robot_side.simulation.scene import Scene


class Hulls:
    """The hulls of a scene's objects that are nothing but meshes, which do not move against each other."""

    def __init__(self, scene: Scene, seen: PerceivedObjects) -> None:
        """`seen`: any frame of the scene. ValueError where nothing is made of meshes."""
        if len(seen.mesh_object) == 0:
            raise ValueError(f"{', '.join(seen.names)}: nothing of meshes; valid: a scene with an object of meshes")
        objects, self._rows = np.unique(seen.mesh_object, return_index=True)
        self._objects = objects
        hulls = []
        for thing in objects.tolist():
            geoms = scene.objects[thing].geoms
            data, first = scene.data, geoms[0]
            in_world = [
                mesh_vertices(scene.model, geom) @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
                for geom in geoms
            ]
            turned = data.geom_xmat[first].reshape(3, 3)
            hull = convex_hull_mesh((np.concatenate(in_world) - data.geom_xpos[first]) @ turned)
            hulls.append(Mesh(hull.vertices, hull.triangles))
        self._library = MeshLibrary(hulls)

    def of(self, seen: PerceivedObjects) -> PerceivedObjects:
        """Another frame of the same scene, with the hulls."""
        return replace(
            seen,
            mesh_library=self._library,
            mesh_index=np.arange(len(self._rows)),
            mesh_positions_m=np.ascontiguousarray(seen.mesh_positions_m[self._rows]),
            mesh_rotations=np.ascontiguousarray(seen.mesh_rotations[self._rows]),
            mesh_object=self._objects,
        )
