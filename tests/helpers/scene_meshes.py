"""MJCF of objects with curved and non-convex shapes, for the tests of how meshes are perceived."""

from pathlib import Path

import numpy as np

from common.arrays import FloatArray, IntArray
from feelahead.lab.reference.meshes import grid_tetrahedra, surface_of
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import planar_arm

CELL_M = 0.04


def cup() -> tuple[FloatArray, IntArray]:
    """Vertices (v, 3) in m and triangles (t, 3) of a block of 3³ cubes without the middle and upper one of its middle
    column: a mouth that opens upward, 40 mm wide and 80 mm deep, between walls and over a floor of 40 mm."""
    places, tetrahedra = grid_tetrahedra(3)
    middles = np.floor(places[tetrahedra].mean(axis=1))
    mouth = (middles[:, 0] == 1.0) & (middles[:, 1] == 1.0) & (middles[:, 2] >= 1.0)
    triangles = surface_of(tetrahedra[~mouth])
    used, numbers = np.unique(triangles, return_inverse=True)
    return CELL_M * (places[used] - 1.5), numbers.reshape(-1, 3)


def mesh_asset(name: str, vertices: FloatArray, triangles: IntArray, inertia: str = "convex") -> str:
    """An MJCF asset with just these vertices and triangles."""
    numbers = " ".join(f"{value:.17g}" for value in vertices.ravel())
    indices = " ".join(str(index) for index in triangles.ravel())
    return f'<asset><mesh name="{name}" inertia="{inertia}" vertex="{numbers}" face="{indices}"/></asset>'


def scene_with(path: Path, world: str, assets: str = "") -> Scene:
    """The planar arm at the objects `world`."""
    return load_scene(planar_arm(path, world=world, extra_top=assets), "tcp")
