"""Other ways to the contact distance: MuJoCo's and coal's distances between convex geoms, and a distance grid.

The law needs the distance along û. MuJoCo and coal find the nearest distance, in no direction; steps as long as it
permits find the distance along û (conservative advancement). The grid is sampled at the centres of the same spheres as
ours. All of them give one distance. A look gives eight strengths in two lists, with each sphere's own D_σ.
"""

import importlib.util
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib import import_module
from typing import Any, Final

import numpy as np
from scipy.ndimage import map_coordinates

from common.arrays import FloatArray, IntArray
from feelahead.lab.accuracy.onset import Method
from feelahead.lab.accuracy.placements import REACH_M, Placement, as_meshes
from feelahead.lab.reference.solids import Solids
from robot_side.drivers.mujoco.mesh_arrays import mesh_vertices
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.true_contact import advanced_m

CELLS_MM: Final = (5, 10)
NO_COAL: Final = "coal's distance: not installed; to get it: pip install coal"
_ALONG: Final = "along û"
_NEAREST: Final = "nearest, no direction"
_MOST_STEPS: Final = 64
_TOUCHING_M: Final = 1e-4
_AT_A_TIME: Final = 1 << 18


def mujoco_along(there: Placement) -> float:
    """Return the distance along û by steps of MuJoCo's distances between the gripper's geoms and the objects'."""
    return there.posed.contact_distance_m(REACH_M)


def mujoco_nearest(there: Placement) -> float:
    """Return the nearest distance, in no direction."""
    return there.posed.gap_m(REACH_M)


def coal_missing() -> str:
    """Return a line that says how to get coal, if it is not installed."""
    return "" if importlib.util.find_spec("coal") else NO_COAL


class Coal:
    """The gripper's geoms and the objects' as convex shapes of coal, with which GJK measures distances."""

    def __init__(self, there: Placement) -> None:
        self._coal: Any = import_module("coal")
        scene, self._axis = there.scene, there.axis
        mine = scene.robot.gripper_geoms.tolist()
        theirs = [geom for thing in scene.objects for geom in thing.geoms]
        self._shapes = {geom: _shape(self._coal, scene, geom) for geom in (*mine, *theirs)}
        self._places: dict[int, Any] = {}
        self._from_m = {geom: scene.data.geom_xpos[geom].copy() for geom in mine}
        for geom in (*mine, *theirs):
            shift_m = np.zeros(3) if geom in self._from_m else there.shift_m
            turn, place_m = scene.data.geom_xmat[geom].reshape(3, 3), scene.data.geom_xpos[geom] + shift_m
            self._places[geom] = self._coal.Transform3s(turn.copy(), place_m)
        self._pairs = [(first, second) for first in mine for second in theirs]
        self._request, self._result = self._coal.DistanceRequest(), self._coal.DistanceResult()

    def _measure(self, first: int, second: int) -> tuple[float, float]:
        result, places, shapes = self._result, self._places, self._shapes
        result.clear()
        gap_m = self._coal.distance(shapes[first], places[first], shapes[second], places[second], self._request, result)
        return gap_m, float(result.normal @ self._axis)

    def _move(self, moved_m: float) -> None:
        for geom, from_m in self._from_m.items():
            self._places[geom].setTranslation(from_m + moved_m * self._axis)

    def along_m(self) -> float:
        """Return the distance along û."""
        self._move(0.0)
        return advanced_m(self._pairs, self._measure, self._move, REACH_M)

    def nearest_m(self) -> float:
        """Return the nearest distance, in no direction."""
        self._move(0.0)
        return min(REACH_M, *(self._measure(*pair)[0] for pair in self._pairs))


def _shape(coal: Any, scene: Scene, geom: int) -> Any:
    model = scene.model
    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == GeomKind.SPHERE:
        return coal.Sphere(float(size[0]))
    if kind == GeomKind.BOX:
        return coal.Box(2.0 * size)
    points = coal.StdVec_Vec3s()
    points.extend(list(mesh_vertices(model, geom)))
    return coal.ConvexBase.convexHull(points, True, "Qt")


class DistanceGrid:
    """Signed distances to the nearest object on a grid that moves with the objects, trilinear in between."""

    def __init__(self, placements: Sequence[Placement], cell_m: float) -> None:
        """Cover the gripper's ways at all `placements`, which are of one scene."""
        first = placements[0]
        self._cell_m, self._axis, self._radii_m = cell_m, first.axis, first.pose.sphere_radii_m
        starts_m = np.concatenate([there.pose.sphere_centers_m - there.shift_m for there in placements])
        ends = np.concatenate([starts_m, starts_m + REACH_M * self._axis])
        self._lowest_m: FloatArray = ends.min(axis=0) - 2.0 * cell_m
        shape = np.ceil((ends.max(axis=0) + 2.0 * cell_m - self._lowest_m) / cell_m).astype(np.int64) + 1
        nodes_m = self._lowest_m + cell_m * np.stack(np.unravel_index(np.arange(shape.prod()), shape), axis=1)
        # The definition's distances to meshes and balls are signed.
        seen = as_meshes(replace(first, shift_m=np.zeros(3)).seen, balls=False)
        solids, distances_m = Solids(seen), np.full(len(nodes_m), np.inf)
        for begin in range(0, len(nodes_m), _AT_A_TIME):
            rows = slice(begin, begin + _AT_A_TIME)
            for thing in range(len(seen.names)):
                things: IntArray = np.full(len(nodes_m[rows]), thing, dtype=np.int64)
                distances_m[rows] = np.minimum(distances_m[rows], solids.distance_m(nodes_m[rows], things))
        self._distances_m = distances_m.reshape(shape)

    def along_m(self, there: Placement) -> float:
        """Return the distance along û at which the first sphere touches, by steps of the sampled distances."""
        centers_m = there.pose.sphere_centers_m - there.shift_m
        radii_m, moved_m = self._radii_m, np.zeros(len(self._radii_m))
        least_m = REACH_M
        for _ in range(_MOST_STEPS):
            at = ((centers_m + moved_m[:, None] * self._axis - self._lowest_m) / self._cell_m).T
            gaps_m = map_coordinates(self._distances_m, at, order=1, mode="nearest") - radii_m
            touches = gaps_m <= _TOUCHING_M
            least_m = min(least_m, float(moved_m[touches].min(initial=REACH_M)))
            going = ~touches & (moved_m + gaps_m < least_m)
            if not going.any():
                break
            centers_m, radii_m, moved_m = centers_m[going], radii_m[going], (moved_m + gaps_m)[going]
        return least_m


def peers(placements: Sequence[Placement]) -> dict[tuple[str, str], Method]:
    """Return the methods that this machine has, by peer and setting; grids are made here, shapes at the first call."""

    @cache
    def coal(there: Placement) -> Coal:
        return Coal(there)

    found: dict[tuple[str, str], Method] = {("MuJoCo", _ALONG): mujoco_along, ("MuJoCo", _NEAREST): mujoco_nearest}
    for cell_mm in CELLS_MM:
        found["distance grid", f"cells of {cell_mm} mm"] = DistanceGrid(placements, 1e-3 * cell_mm).along_m
    if not coal_missing():
        found["coal", _ALONG] = lambda there: coal(there).along_m()
        found["coal", _NEAREST] = lambda there: coal(there).nearest_m()
    return found
