"""Looks at maps as of a depth camera: up to 2 000 thin boxes, near the built-in gripper."""

import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.tiles import Boxes, Tiling, cluttered_table, tiled
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.enlargement.distance import standard_quantile
from robot_side.field.along import Along
from robot_side.field.field import Ahead, Field
from robot_side.field.object_class import OBSTACLE
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table

_AHEAD_M: Final = (0.002, 0.006, 0.01, 0.02, 0.05, 0.1, 0.2)
"""Distances of walls ahead of the fingertips"""
_BELOW_M: Final = (0.06, 0.07, 0.08, 0.1, 0.15)
"""Depths of the table below the tool"""
_ROUGH_M: Final = (0.0, 0.001)
_WALLS: Final[Mapping[str, tuple[float, float]]] = {"40": (0.04, 0.64), "18": (0.018, 0.81), "10": (0.01, 0.45)}
"""Size of tiles and of the wall, by the tiles' size in mm"""
MAPS: Final = (*(f"wall of {size} mm tiles{more}" for size in _WALLS for more in ("", ", a surface")), "table")


def looks_at(name: str) -> Iterator[Callable[[], Field]]:
    """Yield functions that look along the approach at a map of `MAPS`, each from another distance or roughness."""
    gripper = PosedGripper(load_scene())
    pose = gripper.at(gripper.home_rad)
    axis = np.ascontiguousarray(pose.tool_rotation[:, 2])
    tips_m = float(((pose.sphere_centers_m - pose.tool_position_m) @ axis + pose.sphere_radii_m).max())
    along = Along(axis, 0.0, 1e-6, float(standard_quantile(0.99)), 0.4)
    for seed, rough_m in enumerate(_ROUGH_M):
        for away_m in _BELOW_M if name == "table" else _AHEAD_M:
            if name == "table":
                seen = _table(pose.tool_position_m + np.array([0.15, 0.0, -away_m]), rough_m, seed)
            else:
                tile_m, size_m = _WALLS[name.split()[2]]
                middle_m = pose.tool_position_m + (tips_m + away_m) * axis
                seen = tiled(middle_m, -axis, (size_m, size_m), Tiling(tile_m, rough_m), seed).objects()
                if name.endswith("surface"):
                    seen = replace(seen, surfaces=np.zeros(len(seen.names), dtype=np.int64))
            ahead, classes = Ahead(np.full(len(gripper.home_rad), 2e-4)), np.full(len(seen.names), OBSTACLE)
            yield functools.partial(ahead.look, pose, scene_table(seen), classes, along)


def _table(top_m: FloatArray, rough_m: float, seed: int) -> PerceivedObjects:
    """Return a table of one surface with things on it, 1 500 boxes in all."""
    boxes: Boxes = cluttered_table(top_m, (0.8, 0.8), Tiling(0.01, rough_m), 1500, seed)
    return replace(boxes.objects(), surfaces=np.where(boxes.half_sizes_m[:, 0] > 0.01, 0, -1))
