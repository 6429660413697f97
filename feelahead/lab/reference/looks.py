"""Looks of recorded runs: their inputs, and the errors of their onset distances against the definition."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from feelahead.lab.approaches.ticks import Recorded
from feelahead.lab.reference.onsets_by_definition import defined_onsets
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.field.field import Ahead, Field
from robot_side.laws.prospect import Asked
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable, scene_table

LATE_M = 1e-4
"""Limit in metres by which a contact distance may be later than its definition."""


class _Noting(Ahead):
    """Maker of looks that notes what each of them was asked."""

    def __init__(self, encoder_sigma_rad: FloatArray) -> None:
        super().__init__(encoder_sigma_rad)
        self.asked: list[tuple[Asked, PerceivedObjects]] = []

    def look(
        self,
        pose: GripperPose,
        scene: SceneTable,
        classes: IntArray,
        along: Along,
        widest_m: float = np.inf,
        *,
        full_only: bool = False,
    ) -> Field:
        """Look, and note the arguments."""
        self.asked.append((Asked(pose, classes, along, widest_m), scene.objects))
        return super().look(pose, scene, classes, along, widest_m, full_only=full_only)


def looks_of(recorded: Recorded, most: int) -> tuple[list[tuple[Asked, PerceivedObjects]], FloatArray]:
    """Run the law over the ticks of a run; return up to `most` of its looks, and the encoders' sigmas (n,)."""
    law = recorded.new_law()
    law.looking.ahead = noting = _Noting(law.looking.ahead.encoder_sigma_rad)
    for tick in recorded.ticks:
        law.sense(tick.situation, tick.now_s)
    return noting.asked[:: max(1, -(-len(noting.asked) // most))], noting.encoder_sigma_rad


@dataclass(frozen=True)
class LookErrors:
    """Errors of the onset distances (n,) of several looks."""

    looks: int
    off_m: FloatArray
    """(n,) later above 0, earlier below"""
    grazes: BoolArray
    sigma_off_m: float
    """Largest error of a look's largest D_σ"""

    def row(self) -> dict[str, float]:
        """Return the largest errors as a row: those outside grazes, and for grazes the distance out of the band."""
        plain_m, graze_m = (np.append(self.off_m[which], 0.0) for which in (~self.grazes, self.grazes))
        return {
            "looks": self.looks,
            "distances": len(self.off_m),
            "late": int((plain_m > LATE_M).sum()),
            "earliest_mm": 1e3 * float(plain_m.min()),
            "latest_mm": 1e3 * float(plain_m.max()),
            "p999_mm": 1e3 * float(np.quantile(np.abs(plain_m), 0.999)),
            "grazes": int(self.grazes.sum()),
            "out_of_band": int((np.abs(graze_m) > LATE_M).sum()),
            "sigma_off_mm": 1e3 * self.sigma_off_m,
        }


def compare(looks: Iterable[tuple[Asked, PerceivedObjects]], encoder_sigma_rad: FloatArray) -> LookErrors:
    """Compare the field's contact distances with the definition's."""
    ahead = Ahead(encoder_sigma_rad)
    off_m, grazes, sigma_off_m = [np.zeros(0)], [np.zeros(0, dtype=np.bool_)], [0.0]
    for (pose, classes, along, widest_m), objects in looks:
        found = ahead.look(pose, scene_table(objects), classes, along, widest_m)
        defined = defined_onsets(pose, objects, classes, along, widest_m, encoder_sigma_rad)
        judged = defined.judge(found.onsets_m, along.reach_m)
        off_m.append(judged.off_m)
        grazes.append(judged.grazes)
        sigma_off_m.append(abs(found.sigma_m - defined.sigma_m))
    return LookErrors(len(off_m) - 1, np.concatenate(off_m), np.concatenate(grazes), max(sigma_off_m))
