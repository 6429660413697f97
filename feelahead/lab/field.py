"""Look ahead at things that stand at known distances: where each strength begins, and what that takes."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from feelahead.lab.cover import home_pose
from feelahead.lab.figures import figure
from feelahead.lab.table import Row, Table
from robot_side.ahead.field import Ahead, Along, FieldCounts
from robot_side.ahead.find import OBSTACLE
from robot_side.ahead.scene_table import scene_table
from robot_side.compiled.warm_up import warm_up
from robot_side.enlargement.distance import standard_quantile
from robot_side.settings import CameraSettings, EncoderSettings
from robot_side.simulation.encoders import Encoder
from robot_side.simulation.posed_scene import PosedScene
from robot_side.simulation.scene import load_scene

CONVEX: Final = ("wall", "plate", "ball", "post", "rod_10mm", "rod_5mm", "rod_2mm", "wall_45")
"""Frozen scenes with one convex thing ahead"""
SHOWN_MM: Final = 80.0
DRAWN: Final = {1: ":", 4: "--", 8: "-"}
"""Strengths that are shown, and their lines."""
_PROBABILITY: Final = 0.99
_REACH_M, _FARTHEST_M, _MOST_MM = 0.4, 2.0, 150.0


@dataclass(frozen=True)
class Facing:
    """The gripper in the home pose of one scene; its objects are moved along the approach."""

    scene: str
    model: Path
    site: str
    step_mm: float
    """Free ways from 0 to 150 mm in such steps, and 80 mm"""
    looks: int = 200
    """Looks that are timed"""


def look_ahead(cell: Facing) -> Iterator[Row]:
    """Yield a row for each free way: the ways to R2's strengths, mm, and the median times of looks.

    ConfigurationError for a model that cannot be used, or that has nothing ahead of its gripper.
    """
    scene = load_scene(cell.model, cell.site)
    posed, pose, things = PosedScene(scene), home_pose(scene), len(scene.objects)
    joints = scene.data.qpos[scene.robot.arm_positions].copy()
    fingers = scene.data.qpos[scene.robot.finger_positions].copy()
    posed.put(joints, fingers, np.zeros(3))
    way_m = posed.way_m(_FARTHEST_M)
    if way_m >= _FARTHEST_M:
        raise ConfigurationError(
            f"--model {cell.model}: nothing is ahead of the gripper within {_FARTHEST_M:g} m; valid: a scene with"
            " something on its way"
        )
    warm_up()
    encoder = EncoderSettings()
    sigma_rad = Encoder(encoder.sigma_rad, encoder.resolution_rad).standard_deviation_rad()
    ahead, standing = Ahead(np.full(len(joints), sigma_rad)), np.full(things, OBSTACLE, dtype=np.int64)
    axis = pose.tool_rotation[:, 2]
    r2, l2 = _along(axis), _along(-axis)
    for free_mm in np.unique([*np.arange(0.0, _MOST_MM + 0.1, cell.step_mm), SHOWN_MM]).tolist():
        posed.put(joints, fingers, (1e-3 * free_mm - way_m) * axis)
        seen = scene_table(posed.perceived(np.zeros((things, 3))))
        ahead.counts = FieldCounts()
        found = ahead.look(pose, seen, standing, r2)
        overlaps, took_s = ahead.counts.overlaps, np.empty((cell.looks, 2))
        for look in range(cell.looks):
            for side, along in enumerate((r2, l2)):
                began_s = time.thread_time()
                ahead.look(pose, seen, standing, along)
                took_s[look, side] = time.thread_time() - began_s
        r2_us, l2_us = (1e6 * np.median(took_s, axis=0)).tolist()
        ways_mm = (1e3 * way if math.isfinite(way) else None for way in found.fast_m.tolist())
        yield {
            "free_mm": free_mm,
            **{way_name(strength): way_mm for strength, way_mm in enumerate(ways_mm, 1)},
            **{"sigma_mm": 1e3 * found.sigma_m, "overlaps": overlaps, "r2_us": r2_us, "l2_us": l2_us},
        }


def way_name(strength: int) -> str:
    """Name the column of the way after which a strength begins; None in it where it never does."""
    return f"strength_{strength}_mm"


def _along(direction: FloatArray) -> Along:
    quantile = float(standard_quantile(_PROBABILITY))
    return Along(np.ascontiguousarray(direction), 0.0, CameraSettings().sd_m ** 2, quantile, _REACH_M)


def draw_field(table: Table, frozen: str, path: Path) -> None:
    """Draw how far before each thing strengths begin: a colour for each scene, a kind of line for each strength."""
    with figure(path, 1, 1, f"where strength begins (frozen {frozen})", figsize=(7.5, 4.2)) as (_, axes):
        for number, ((scene,), rows) in enumerate(table.groups("scene")):
            for strength, line in DRAWN.items():
                ways = (row[way_name(strength)] for row in rows)
                before = [
                    math.nan if way is None else free - way
                    for free, way in zip(rows.values("free_mm"), ways, strict=True)
                ]
                label = scene if strength == max(DRAWN) else None
                axes.plot(rows.values("free_mm"), before, line, color=f"C{number}", label=label)
        sigma_mm = table.rows[0]["sigma_mm"]
        axes.axhline(sigma_mm, color="black", linewidth=0.6)
        axes.annotate("D_σ", (0.0, sigma_mm), textcoords="offset points", xytext=(2, 2), fontsize=8)
        axes.set(xlabel="free way of the gripper, mm", ylabel="begins so far before the contact, mm", ylim=(0.0, None))
        axes.legend(ncols=2, fontsize=8, title="strength 8 (full line), 4, 1 (dotted)", title_fontsize=8)
