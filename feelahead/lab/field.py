"""Measure how far before objects at known distances each strength of R2 begins."""

import functools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from common.errors import ConfigurationError
from feelahead.lab.figures import figure
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.table import Row, Table
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.posed_scene import PosedScene
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.enlargement.distance import standard_quantile
from robot_side.field.field import Ahead, Along, Field
from robot_side.field.object_class import OBSTACLE
from robot_side.settings import CameraSettings, EncoderSettings
from robot_side.surroundings.scene_table import scene_table

CONVEX: Final = ("wall", "plate", "ball", "post", "rod_10mm", "rod_5mm", "rod_2mm", "wall_45")
"""Frozen scenes with one convex object ahead."""
DRAWN: Final = {1: ":", 4: "--", 8: "-"}
"""Strengths that are drawn, with their kind of line."""
_PROBABILITY: Final = 0.99
_REACH_M, _FARTHEST_M, _MOST_MM = 0.4, 2.0, 150.0


@dataclass(frozen=True)
class Facing:
    """Gripper in the home pose of one scene, whose objects are moved along the approach."""

    scene: str
    model: Path
    site: str
    step_mm: float
    """Step between the tried distances from the gripper to the object, 0 to 150 mm."""


Look = Callable[[], Field]


def looks_before(cell: Facing, free_mm: Iterable[float]) -> Iterator[Look]:
    """Yield, for each distance to the object in `free_mm`, a function that evaluates the law along R2 (a look).

    ConfigurationError if the model cannot be used or has nothing ahead of its gripper.
    """
    scene = load_scene(cell.model, cell.site)
    posed, gripper, things = PosedScene(scene), PosedGripper(scene), len(scene.objects)
    pose = gripper.at(gripper.home_rad)
    posed.set_pose(gripper.home_rad, gripper.fingers, np.zeros(3))
    contact_distance_m = posed.contact_distance_m(_FARTHEST_M)
    if contact_distance_m >= _FARTHEST_M:
        raise ConfigurationError(
            f"--model {cell.model}: nothing is ahead of the gripper within {_FARTHEST_M:g} m; valid: a scene with"
            " an object ahead of the gripper"
        )
    encoder = EncoderSettings()
    sigma_rad = Encoder(encoder.sigma_rad, encoder.resolution_rad).standard_deviation_rad()
    ahead, classes = Ahead(np.full(len(gripper.home_rad), sigma_rad)), np.full(things, OBSTACLE, dtype=np.int64)
    axis = np.ascontiguousarray(pose.tool_rotation[:, 2])
    r2 = Along(axis, 0.0, CameraSettings().sd_m ** 2, float(standard_quantile(_PROBABILITY)), _REACH_M)
    for free in free_mm:
        posed.set_pose(gripper.home_rad, gripper.fingers, (1e-3 * free - contact_distance_m) * axis)
        seen = scene_table(posed.perceived(np.zeros((things, 3))))
        yield functools.partial(ahead.look, pose, seen, classes, r2)


def look_ahead(cell: Facing) -> Iterator[Row]:
    """Yield a row for each distance to the object, with the onset distances of R2's eight strengths, in mm.

    ConfigurationError as for `looks_before`.
    """
    ways_mm = np.arange(0.0, _MOST_MM + 0.1, cell.step_mm).tolist()
    for free_mm, look in zip(ways_mm, looks_before(cell, ways_mm), strict=True):
        found = look()
        found_mm = (1e3 * way if math.isfinite(way) else None for way in found.fast_m.tolist())
        yield {
            "free_mm": free_mm,
            **{strength_column(strength): way_mm for strength, way_mm in enumerate(found_mm, 1)},
            "sigma_mm": 1e3 * found.sigma_m,
        }


def strength_column(strength: int) -> str:
    """Return the name of the column with a strength's onset distance, which is None if the strength never begins."""
    return f"strength_{strength}_mm"


def draw_field(table: Table, frozen: str, path: Path) -> None:
    """Draw how far before each object the strengths begin: one colour for each scene, one line for each strength."""
    with figure(path, 1, 1, f"where strength begins (frozen {frozen})", figsize=(7.5, 4.2)) as (_, axes):
        for number, ((scene,), rows) in enumerate(table.groups("scene")):
            for strength, line in DRAWN.items():
                ways = (row[strength_column(strength)] for row in rows)
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
