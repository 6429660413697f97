"""What each law puts on the triggers' zones at given moments of a recorded approach."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.messages import Header, StiffnessUpdate
from feelahead.approaches.laws import Law, stiffness_settings
from feelahead.approaches.spoilt import SPOILING_DELAY_S, Spoil
from feelahead.benchmarks.coverage.replay import Replay
from operator_side.dualsense.effects.official import MAX_STRENGTH, ZONE_COUNT
from operator_side.feel.rendering import RenderingSettings, TriggerRendering
from operator_side.hands.travel_calibration import TravelCalibration
from robot_side.enlargement.distance import Enlargement, EnlargementSettings
from robot_side.objects.perceived import PerceivedObjects
from robot_side.sensing import AheadSensing
from robot_side.stiffness.map import StiffnessMap

_REMEMBERED_ROWS = 8
"""80 ms before the first moment asked for: longer than the first law's rate limits last. Its bands remember more: one
band, where the stiffness has just fallen."""


@dataclass(frozen=True)
class Draw:
    """One approach to objects that stand still, as a camera with one draw of its error perceives them."""

    replay: Replay
    objects: PerceivedObjects
    camera_sd_m: float
    """What the robot side believes of the camera, which is the truth here."""


class FieldLaw(Protocol):
    """One law at one P."""

    def felt(self, draw: Draw, times_s: FloatArray) -> IntArray:
        """Strengths (t, 2, 10), 0 to 8, of L2's and R2's zones at the operator side's moments times_s (t,), rising."""
        ...


@dataclass(frozen=True)
class Constant:
    """The same strength in every zone, whatever happens: 0 for no haptics, 8 for always full."""

    strength: int

    def felt(self, draw: Draw, times_s: FloatArray) -> IntArray:
        """As any law's."""
        del draw
        return np.full((len(times_s), 2, ZONE_COUNT), self.strength, dtype=np.int64)


@dataclass(frozen=True)
class Pipeline:
    """The shipped pipeline, tick by tick, with the messages' own delays, under one law that it can follow."""

    law: Law
    probability: float
    margin_m: float | None = None
    """A fixed enlargement in place of eq. 8-10: the law `margin`."""
    spoil: Spoil = "nothing"

    def felt(self, draw: Draw, times_s: FloatArray) -> IntArray:
        """As any law's."""
        record = draw.replay.record
        felt_s = times_s - (SPOILING_DELAY_S if self.spoil == "delayed" else 0.0)
        sent_s = record.seen_sent_s[[record.tick_row(time_s) for time_s in felt_s]]
        rows = np.array([-1 if np.isnan(sent) else record.pose_row(sent) for sent in sent_s])
        strengths = np.zeros((len(times_s), 2, ZONE_COUNT), dtype=np.int64)
        known = rows >= 0
        if known.any():
            first, last = max(0, int(rows[known].min()) - _REMEMBERED_ROWS), int(rows[known].max())
            by_row = self._rows(draw, first, last)
            strengths[known] = by_row[rows[known] - first]
        return strengths[:, ::-1] if self.spoil == "swapped" else strengths

    def _rows(self, draw: Draw, first: int, last: int) -> IntArray:
        """Strengths (rows, 2, 10) that follow from the poses' rows `first` to `last`."""
        replay, record = draw.replay, draw.replay.record
        settings = EnlargementSettings(
            probability=self.probability, camera_sd_m=draw.camera_sd_m, fixed_m=self.margin_m
        )
        stiffness_map = StiffnessMap(stiffness_settings(self.law))
        sensing = AheadSensing(Enlargement(settings), stiffness_map, replay.encoder_sigma_rad)
        rendering = TriggerRendering(RenderingSettings(), TravelCalibration())
        strengths = np.empty((last + 1 - first, 2, ZONE_COUNT), dtype=np.int64)
        for row in range(first, last + 1):
            now_s = float(record.pose_time_s[row])
            sensed = sensing.sense(
                replay.estimated[row],
                record.joint_velocities_rad_s[row],
                draw.objects,
                float(record.loop_age_s[row]),
                None,
                None,
                now_s,
            )
            header = Header(epoch=1, sequence=row, sent_s=now_s)
            stiffness = sensed.stiffness
            message = StiffnessUpdate(header, l2=stiffness.l2, r2=stiffness.r2, rumble=0.0, state="armed")
            shown = rendering.render(message, now_s)
            for trigger, effect in enumerate((shown.l2, shown.r2)):
                strengths[row - first, trigger] = 0 if effect is None else effect.zone_strengths
        return strengths


def make_law(law: Law, probability: float, margin_m: float | None = None, spoil: Spoil = "nothing") -> FieldLaw:
    """`law` at P. margin_m: the fixed enlargement of `margin`, which the other laws do not look at."""
    if law in ("none", "full"):
        return Constant(MAX_STRENGTH if law == "full" else 0)
    return Pipeline(law, probability, margin_m if law == "margin" else None, spoil)
