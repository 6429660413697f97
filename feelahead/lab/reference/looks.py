"""The looks of recorded runs: what was asked in them, and how far off the field's ways are from their definition."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from feelahead.lab.approaches.ticks import Recorded
from feelahead.lab.reference.ways_by_definition import defined_ways
from robot_side.arm.port import GripperPose
from robot_side.field.field import Ahead, Along, Field
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable, scene_table

LATE_M = 1e-4
"""No way may be later than its definition by more."""


class Asked(NamedTuple):
    """What `Ahead.look` was asked; the fields are its arguments."""

    pose: GripperPose
    objects: PerceivedObjects
    classes: IntArray
    along: Along
    widest_m: float


class _Noting(Ahead):
    """Looks, and notes what is asked."""

    def __init__(self, encoder_sigma_rad: FloatArray) -> None:
        super().__init__(encoder_sigma_rad)
        self.asked: list[Asked] = []

    def look(
        self, pose: GripperPose, scene: SceneTable, classes: IntArray, along: Along, widest_m: float = np.inf
    ) -> Field:
        """Look along a direction."""
        self.asked.append(Asked(pose, scene.objects, classes, along, widest_m))
        return super().look(pose, scene, classes, along, widest_m)


def looks_of(recorded: Recorded, most: int) -> tuple[list[Asked], FloatArray]:
    """Go through the ticks of a run once more; its looks, `most` from all over it, and the encoders' errors (n,)."""
    law = recorded.new_law()
    law.ahead = law.turns.ahead = noting = _Noting(law.ahead.encoder_sigma_rad)
    for tick in recorded.ticks:
        law.sense(tick.situation, tick.now_s)
    return noting.asked[:: max(1, -(-len(noting.asked) // most))], noting.encoder_sigma_rad


@dataclass(frozen=True)
class Apart:
    """How far off the ways (n,) of looks are."""

    looks: int
    off_m: FloatArray
    """Later above 0, earlier below"""
    grazes: BoolArray
    sigma_off_m: float
    """The most that the largest D_σ of a look is off"""

    def row(self) -> dict[str, float]:
        """Sum it up: outside of grazes, and in these by how far a way is out of its band."""
        plain_m, graze_m = (np.append(self.off_m[which], 0.0) for which in (~self.grazes, self.grazes))
        return {
            "looks": self.looks,
            "ways": len(self.off_m),
            "late": int((plain_m > LATE_M).sum()),
            "earliest_mm": 1e3 * float(plain_m.min()),
            "latest_mm": 1e3 * float(plain_m.max()),
            "p999_mm": 1e3 * float(np.quantile(np.abs(plain_m), 0.999)),
            "grazes": int(self.grazes.sum()),
            "out_of_band": int((np.abs(graze_m) > LATE_M).sum()),
            "sigma_off_mm": 1e3 * self.sigma_off_m,
        }


def compare(asked: Iterable[Asked], encoder_sigma_rad: FloatArray) -> Apart:
    """Look, and define what should be found."""
    ahead = Ahead(encoder_sigma_rad)
    off_m, grazes, sigma_off_m = [np.zeros(0)], [np.zeros(0, dtype=np.bool_)], [0.0]
    for pose, objects, classes, along, widest_m in asked:
        found = ahead.look(pose, scene_table(objects), classes, along, widest_m)
        defined = defined_ways(pose, objects, classes, along, widest_m, encoder_sigma_rad)
        judged = defined.judge(found.ways_m, along.reach_m)
        off_m.append(judged.off_m)
        grazes.append(judged.grazes)
        sigma_off_m.append(abs(found.sigma_m - defined.sigma_m))
    return Apart(len(off_m) - 1, np.concatenate(off_m), np.concatenate(grazes), max(sigma_off_m))
