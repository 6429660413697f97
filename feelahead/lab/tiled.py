"""Walls in tiles, as in a map, beside the same walls whole: onset distances, and clearances at which fingers pass.

A roughness r draws each tile's face within ±r of the true plane. "Each": every tile is an object. "Surface": all tiles
are pieces of one surface.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np
from rich.table import Table as Shown

from common.arrays import FloatArray
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.reference.onsets_by_definition import defined_onsets
from feelahead.lab.table import Row, Table
from feelahead.lab.tiles import Boxes, Tiling, flat, tiled
from feelahead.printing.figures import shown
from robot_side.arm.port import GripperPose
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.enlargement.distance import standard_quantile
from robot_side.field.along import Along
from robot_side.field.field import Ahead
from robot_side.field.look import MARGIN_M
from robot_side.field.object_class import OBSTACLE
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table

_PROBABILITY: Final = 0.99
_ENCODER_RAD: Final = 2e-4
_TILES_M: Final = (0.01, 0.02, 0.04, 0.16)
_ROUGH_M: Final = ((0.0, 0.0), (5e-4, 0.0), (1e-3, 0.0), (0.0, 1e-3), (0.0, 2e-3))
"""Roughness, and gap between tiles"""
_TILTS_DEG: Final = (0.0, 20.0, 45.0)
_DEFINED_FROM_M: Final = 0.04
"""Size of tiles from which on looks are compared with the definition, too: smaller ones take minutes"""
_SEEDS: Final = 4
_AHEAD_M: Final = 0.08
_SIZE_M: Final = (0.32, 0.32)
_BESIDE_M: Final = (0.16, 0.16)
_STEP_M: Final = 2.5e-4
_MOST_CLEAR_M: Final = 0.02
_ALARM: Final = 4
_PASSING_M: Final = (0.06, 0.02)
"""Examined distance, and how far ahead of the fingertips the wall beside begins, so that the palm never comes there"""


@dataclass(frozen=True)
class Tiled:
    """Cell: a wall ahead, or beside the fingers, in tiles of one size."""

    scene: str
    tile_m: float
    roughness_m: float
    gap_m: float
    tilt_deg: float = 0.0
    camera_sd_m: float = 1e-3


def tiled_cells(*, quick: bool) -> Iterator[Tiled]:
    """Yield walls ahead at several tilts, then walls beside the fingers and slots."""
    for tilt_deg, tile_m, (roughness_m, gap_m) in product(_TILTS_DEG, _TILES_M, _ROUGH_M):
        if not quick or (tile_m in (0.01, 0.04) and roughness_m > 0.0):
            yield Tiled("ahead", tile_m, roughness_m, gap_m, tilt_deg)
    for scene, sd_m, tile_m, roughness_m in product(("beside", "slot"), (1e-3, 3e-3), (0.01, 0.04), (5e-4, 1e-3)):
        if not quick or (scene == "beside" and tile_m == _TILES_M[0]):
            yield Tiled(scene, tile_m, roughness_m, 0.0, camera_sd_m=sd_m)


class _Looking:
    """The built-in gripper in its home pose, looking along its approach axis."""

    def __init__(self, camera_sd_m: float) -> None:
        gripper = PosedGripper(load_scene())
        self.pose: GripperPose = gripper.at(gripper.home_rad)
        self.axis, self.aside = (np.ascontiguousarray(self.pose.tool_rotation[:, k]) for k in (2, 0))
        self.sigma_rad = np.full(len(gripper.home_rad), _ENCODER_RAD)
        self._ahead = Ahead(self.sigma_rad)
        quantile = float(standard_quantile(_PROBABILITY))
        self.along = Along(self.axis, 0.0, camera_sd_m**2, quantile, _AHEAD_M)

    def reaches_m(self, direction: FloatArray) -> float:
        """Return how far the fingers' spheres reach along a unit vector, from the tool."""
        out_m = (self.pose.sphere_centers_m - self.pose.tool_position_m) @ direction + self.pose.sphere_radii_m
        return float(out_m[self.pose.sphere_on_finger].max())

    def onsets_m(self, seen: PerceivedObjects, reach_m: float) -> FloatArray:
        """Return the fast list (8,)."""
        classes = np.full(len(seen.names), OBSTACLE, dtype=np.int64)
        along = replace(self.along, reach_m=reach_m)
        return self._ahead.look(self.pose, scene_table(seen), classes, along).fast_m

    def defined_m(self, seen: PerceivedObjects, reach_m: float) -> FloatArray:
        """Return the fast list (8,) by its definition."""
        classes = np.full(len(seen.names), OBSTACLE, dtype=np.int64)
        along = replace(self.along, reach_m=reach_m)
        found = defined_onsets(self.pose, seen, classes, along, np.inf, self.sigma_rad)
        onsets_m: FloatArray = found.onsets_m[0, 0]
        return onsets_m


def together(boxes: Boxes) -> PerceivedObjects:
    """Return a frame in which all boxes are pieces of one surface."""
    return replace(boxes.objects(), surfaces=np.zeros(len(boxes.centers_m), dtype=np.int64))


def measure_tiled(cell: Tiled) -> Iterator[Row]:
    """Yield a row for tiles that are objects each, and one for tiles of a surface."""
    looking, tiling = _Looking(cell.camera_sd_m), Tiling(cell.tile_m, cell.roughness_m, cell.gap_m)
    measure = _onsets if cell.scene == "ahead" else _clearance
    for shared in (False, True):
        yield {"as": "surface" if shared else "each", **measure(looking, cell, tiling, shared)}


def _onsets(looking: _Looking, cell: Tiled, tiling: Tiling, shared: bool) -> Row:
    """Return how much earlier (below 0) strengths begin than before the wall as one box, in mm."""
    lean = np.radians(cell.tilt_deg)
    normal = -(np.cos(lean) * looking.axis + np.sin(lean) * looking.pose.tool_rotation[:, 1])
    middle_m = looking.pose.tool_position_m + (looking.reaches_m(looking.axis) + _AHEAD_M) * looking.axis
    reach_m = _AHEAD_M + MARGIN_M
    true_m = looking.onsets_m(flat(middle_m, normal, _SIZE_M).objects(), reach_m)
    maps = [tiled(middle_m, normal, _SIZE_M, tiling, seed) for seed in range(_SEEDS)]
    seen = [together(one) if shared else one.objects() for one in maps]
    off_mm = 1e3 * np.array([looking.onsets_m(one, reach_m) - true_m for one in seen])
    row: Row = {f"o{level + 1}_mm": float(np.median(off_mm[:, level])) for level in range(8)}
    row |= {"o8_least_mm": float(off_mm[:, 7].min()), "o8_most_mm": float(off_mm[:, 7].max())}
    if cell.tile_m < _DEFINED_FROM_M:
        return row
    defined_mm = 1e3 * (looking.defined_m(seen[0], reach_m) - true_m)
    return row | {"look_less_defined_mm": float(np.abs(off_mm[0] - defined_mm).max())}


def _clearance(looking: _Looking, cell: Tiled, tiling: Tiling, shared: bool) -> Row:
    """Return from which clearance on the fingers pass without an alarm: tiles, and the whole walls (mm)."""
    tiles_mm = [_free_from_mm(looking, cell, tiling, shared, seed) for seed in range(_SEEDS)]
    return {"free_mm": max(tiles_mm), "true_free_mm": _free_from_mm(looking, cell, None, shared, 0)}


def _free_from_mm(looking: _Looking, cell: Tiled, tiling: Tiling | None, shared: bool, seed: int) -> float:
    """Return the least clearance from which on no strength of `_ALARM` or more is found, in mm."""
    reach_m, ahead_m = _PASSING_M
    begins_m = looking.reaches_m(looking.axis) + ahead_m + 0.5 * _BESIDE_M[0]
    for clear_m in np.arange(_MOST_CLEAR_M, 0.0, -_STEP_M):
        walls = []
        for sign in (1.0, -1.0) if cell.scene == "slot" else (1.0,):
            out_m = looking.reaches_m(sign * looking.aside) + clear_m
            middle_m = looking.pose.tool_position_m + begins_m * looking.axis + sign * out_m * looking.aside
            normal = -sign * looking.aside
            if tiling is None:
                walls.append(flat(middle_m, normal, _BESIDE_M))
            else:
                walls.append(tiled(middle_m, normal, _BESIDE_M, tiling, seed))
        boxes = walls[0].and_also(*walls[1:])
        seen = boxes.objects()
        if shared and tiling is not None:
            sides = np.repeat(np.arange(len(walls)), [len(wall.centers_m) for wall in walls])
            seen = replace(seen, surfaces=sides)
        if looking.onsets_m(seen, reach_m)[_ALARM - 1] < np.inf:
            return 1e3 * (float(clear_m) + _STEP_M)
    return 0.0


def show_tiled(table: Table) -> Iterator[Shown]:
    """Yield the table of walls ahead, then that of clearances."""
    walls = ("tilt_deg", "tile_m", "roughness_m", "gap_m", "as")
    onsets = ("o1_mm", "o4_mm", "o8_mm", "o8_least_mm", "o8_most_mm", "look_less_defined_mm")
    ahead = Table(row for row in table if row["scene"] == "ahead")
    yield shown("tiles ahead beside the whole wall: later above 0", (*walls, *onsets), ahead.lines(*walls, *onsets))
    passes = ("scene", "camera_sd_m", "tile_m", "roughness_m", "as", "free_mm", "true_free_mm")
    beside = Table(row for row in table if row["scene"] != "ahead")
    yield shown("clearance of the fingers from which on no strength reaches 4", passes, beside.lines(*passes))
