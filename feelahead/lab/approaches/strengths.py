"""Compute the strengths that a law gives to the triggers' zones at given times of a recorded approach."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.around import PERIOD_S
from common.protocol.messages import Header, StiffnessUpdate
from feelahead.lab.approaches.laws import TriedLaw, compensation_of, law_of_robot
from feelahead.lab.approaches.replay import Replay
from operator_side.controller.feel import MAX_STRENGTH, SENSED_TRAVEL, ZONE_COUNT
from operator_side.feel.commands_under_way import Displacement, Report
from operator_side.feel.path_ahead import CourseOnMap
from operator_side.feel.rendering import RenderingSettings, TriggerRendering
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from robot_side.arm.limits import ArmLimits
from robot_side.enlargement.distance import Uncertainty
from robot_side.enlargement.prediction_errors import BUILT_IN, PredictionErrors, load_prediction_errors
from robot_side.laws.inputs import LawInputs
from robot_side.laws.law import Law
from robot_side.laws.named import make_law
from robot_side.laws.paper_settings import PaperSettings
from robot_side.laws.swept import SweptLaw
from robot_side.surroundings.perceived import PerceivedObjects, displaced
from robot_side.surroundings.surroundings import Surroundings
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

_TRAVEL: Final = TriggerTravel()
_FRAME_S: Final = 1.0 / 30.0


@dataclass(frozen=True)
class Draw:
    """One recorded approach to objects that are perceived with one draw of the camera's error."""

    replay: Replay
    objects: PerceivedObjects | Callable[[float], PerceivedObjects]
    """Objects as perceived when the pull begins, or a function that returns the newest frame at rising times."""
    camera_sd_m: float
    """Standard deviation σ_c that the robot side assumes, in metres; it equals the true one here."""
    speed_m_s: float = 0.0
    """Speed of the objects along the approach axis at the pull's beginning, in m/s."""

    def objects_at(self, time_s: float) -> PerceivedObjects:
        """Return the newest camera frame at `time_s`; objects at rest have the same frame at all times."""
        if not isinstance(self.objects, PerceivedObjects):
            return self.objects(time_s)
        if self.speed_m_s == 0.0:
            return self.objects
        since_s = math.floor(max(time_s - self.replay.record.began_s, 0.0) / _FRAME_S) * _FRAME_S
        return _moved(self.objects, self.speed_m_s * self.replay.axis, since_s)


def _moved(objects: PerceivedObjects, velocity_m_s: FloatArray, after_s: float) -> PerceivedObjects:
    """Return the frame after all objects moved with `velocity_m_s` (3,) for `after_s`; it contains this velocity."""
    velocities_m_s = np.tile(velocity_m_s, (len(objects.names), 1))
    return replace(displaced(objects, velocity_m_s * after_s), velocities_m_s=velocities_m_s)


@dataclass(frozen=True)
class Judged:
    """One law at one P, computed as both sides do, except that each message has a map, whose age is the average one.

    The field is of the pose before the message left; the zones are of the time at which they are felt. Nothing is
    rendered between the given times, so a strength falls by several steps at once from one time to the next.
    """

    law: TriedLaw
    probability: float
    paper: PaperSettings = field(default_factory=PaperSettings)
    """Settings of the paper's laws"""

    def strengths(self, draw: Draw, times_s: FloatArray) -> IntArray:
        """Return the strengths (t, 2, 10), 0 to 8, of L2's and R2's zones at the operator side's rising times (t,)."""
        always = MAX_STRENGTH if self.law == "full" else 0
        strengths = np.full((len(times_s), 2, ZONE_COUNT), always, dtype=np.int64)
        if self.law in ("none", "full"):
            return strengths
        record = draw.replay.record
        law, rendering = self._law(draw), TriggerRendering(RenderingSettings(), TravelCalibration())
        mapped_s = -math.inf
        for number, shown_s in enumerate(times_s.tolist()):
            tick = record.tick_row(shown_s)
            sent_s = record.seen_sent_s[tick]
            if np.isnan(sent_s) or sent_s < record.pose_time_s[0]:
                continue
            row = record.pose_row(float(sent_s))
            if isinstance(law, SweptLaw) and self.law == "swept" and sent_s - mapped_s > 0.5 * PERIOD_S:
                # A map is as old as its period when it is replaced, and half as old when it arrives.
                mapped_s, of_map = float(sent_s), record.pose_row(float(sent_s) - 0.5 * PERIOD_S)
                law.look_around(self._situation(draw, of_map), float(record.pose_time_s[of_map]))
            sensed = law.sense(self._situation(draw, row), float(record.pose_time_s[row]))
            pulled = [_TRAVEL.travel(min(travel / SENSED_TRAVEL, 1.0)) for travel in record.travel[tick]]
            message = _message(sensed, row)
            known, aside = self._under_way(draw.replay, law, sensed, row, shown_s)
            shown = rendering.render(message, (pulled[0], pulled[1]), known, shown_s, aside)
            for trigger, zones in enumerate((shown.l2, shown.r2)):
                strengths[number, trigger] = zones or 0
        return strengths

    def _law(self, draw: Draw) -> Law:
        replay = draw.replay
        uncertainty = Uncertainty(self.probability, camera_sd_m=draw.camera_sd_m, prediction=_prediction_errors())
        limits = ArmLimits().of_joints(replay.joints)
        inputs = LawInputs(uncertainty, replay.encoder_sigma_rad, limits, replay.motion, Surroundings(), self.paper)
        if self.law == "swept_robot":
            return SweptLaw(inputs)
        return make_law(law_of_robot(self.law), inputs)

    def _situation(self, draw: Draw, row: int) -> Situation:
        replay, record = draw.replay, draw.replay.record
        return Situation(
            pose=replay.estimated[row],
            joint_velocities_rad_s=record.joint_velocities_rad_s[row],
            objects=draw.objects_at(float(record.pose_time_s[row])),
            loop_age_s=float(record.loop_age_s[row]),
            loop_age_known=True,
            loop_age_settled=True,
            compensation=compensation_of(self.law),
            gap_m=None,
            held=None,
            lateral=(0.0, 0.0),
        )

    def _under_way(
        self, replay: Replay, law: Law, sensed: Sensed, row: int, now_s: float
    ) -> tuple[Displacement | None, CourseOnMap | None]:
        """Predict the motion by trigger and sticks after the pose in `row`; None if the robot side compensates."""
        if compensation_of(self.law) == "robot":
            return None, None
        record, then_s = replay.record, float(replay.record.pose_time_s[row])
        tick = record.tick_row(then_s)
        echo_sent_s = float(record.applied_sent_s[tick])
        if np.isnan(echo_sent_s):
            return None, None
        held_s = then_s - float(record.applied_at_s[tick])
        able = sensed.r2
        report = Report(echo_sent_s, held_s, sensed.speed_m_s, able.full_speed_m_s)
        around = law.around(replay.estimated[row])
        course = None if around is None else replay.commands.course(now_s, report, around.changes_s())
        if course is None or around is None:
            return replay.commands.displacement(now_s, report, able.acceleration_m_s2), None
        return None, CourseOnMap(around, sensed.horizon_m, course, replay.commands.sticks_at(now_s))


@cache
def _prediction_errors() -> PredictionErrors:
    return load_prediction_errors(BUILT_IN)


def _message(sensed: Sensed, row: int) -> StiffnessUpdate:
    return StiffnessUpdate(
        Header(epoch=1, sequence=row, sent_s=0.0),
        l2=sensed.l2,
        r2=sensed.r2,
        speed_m_s=sensed.speed_m_s,
        horizon_m=sensed.horizon_m,
        rumble=sensed.rumble,
        state="armed",
    )
