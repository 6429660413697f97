"""The ways to meshes, by array functions: a mesh need not be convex, so that only its distance bounds a step."""

import numpy as np

from common.arrays import FloatArray, IntArray
from robot_side.ahead.distances import nearest_mesh_points
from robot_side.ahead.scene_table import SceneTable
from robot_side.ahead.tables import DONE, Tables

_TOUCHING_M = 1e-6
_LEAST_STEP_M = 1e-3
"""Along a surface that is nearer than this, no step is shorter. What a sphere of some millimetres meets and leaves
within one such step it does not overlap by a cubic millimetre."""
_HALVINGS = 12


def find_mesh_ways(
    tables: Tables, new: slice, scene: SceneTable, spheres: FloatArray, direction: FloatArray, reach_m: float
) -> None:
    """Fill in the entries of all pairs with a mesh among the `new` ramps, and what follows for these.

    A mesh beyond a sphere's reach keeps its pair, with an infinite entry. spheres (m, 4), direction (3,).
    """
    ramps = tables.ramps[new]
    if len(ramps) == 0:
        return
    pairs = tables.pairs[ramps["first_pair"][0] : ramps["first_pair"][-1] + ramps["pairs"][-1]]
    of_mesh = np.flatnonzero(np.isnan(pairs["entry"]))
    if len(of_mesh) == 0:
        return
    ramp_of_pair = np.repeat(np.arange(len(ramps)), ramps["pairs"])
    owner = ramp_of_pair[of_mesh]
    starts = spheres[ramps["sphere"][owner], :3]
    ways_m = pairs["bound"][of_mesh]
    _lengthen(ways_m, scene, pairs["row"][of_mesh], starts, ramps["radius"][owner], direction, reach_m)
    pairs["entry"][of_mesh] = ways_m
    entries = np.full(len(ramps), np.inf)
    np.minimum.at(entries, ramp_of_pair, pairs["entry"])
    ramps["start"] = entries
    ramps["state"][entries > reach_m] = DONE
    # The uninflated sphere, which comes next, counts only beside one that overlaps already.
    bare = np.flatnonzero(ramps["before"] > 0.0)
    ramps["state"][bare[entries[bare - 1] > 0.0]] = DONE


def _lengthen(
    ways: FloatArray,
    scene: SceneTable,
    rows: IntArray,
    starts_m: FloatArray,
    radii_m: FloatArray,
    direction: FloatArray,
    reach_m: float,
) -> None:
    """Lengthen lower bounds of the ways (p,) of spheres to their meshes to the ways; infinite beyond the reach."""

    def gaps(those: IntArray, at: FloatArray) -> FloatArray:
        points = starts_m[those] + at[:, None] * direction
        distances, _ = nearest_mesh_points(points, scene, rows[those])
        found: FloatArray = distances - radii_m[those]
        return found

    live, outside = np.arange(len(rows)), ways.copy()
    while len(live):
        gap = gaps(live, ways[live])
        going = gap > _TOUCHING_M
        live = live[going]
        outside[live] = ways[live]
        ways[live] += np.maximum(gap[going], _LEAST_STEP_M)
        beyond = ways[live] > reach_m
        ways[live[beyond]] = np.inf
        live = live[~beyond]
    # A step that was longer than the gap may have led into the mesh.
    within = np.flatnonzero(np.isfinite(ways) & (ways > outside))
    for _ in range(_HALVINGS if len(within) else 0):
        middle = 0.5 * (outside[within] + ways[within])
        free = gaps(within, middle) > _TOUCHING_M
        outside[within[free]] = middle[free]
        ways[within[~free]] = middle[~free]
