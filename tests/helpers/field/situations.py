"""Inputs of the law for a tool that moves freely, without an arm, and laws for them, for tests of stiffness."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.enlargement.distance import Uncertainty
from robot_side.enlargement.prediction_errors import PredictionErrors
from robot_side.laws.inputs import LawInputs
from robot_side.laws.law import Law
from robot_side.laws.paper import PaperLaw
from robot_side.laws.paper_settings import PaperSettings
from robot_side.laws.swept import SweptLaw
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation
from tests.helpers.field.fields import RADIUS_M, ball_pose
from tests.helpers.perceived_scenes import Scene

EXACT = PredictionErrors({"operator": ((1.0, 0.0, 0.0),), "robot": ((1.0, 0.0, 0.0),)})
"""Prediction errors of zero for both compensations"""
CAMERA_SD_M = 0.003
SIGMA_M = 2.3263478740408408 * CAMERA_SD_M
"""D_σ at P = 0.99 with only camera errors."""
FULL_SPEED_M_S, STICK_SPEED_M_S, ACCELERATION_M_S2 = 0.25, 0.1, 3.0
LIMITS = JointLimits(np.full(6, 10.0), np.full(6, ACCELERATION_M_S2))
MOTION = ToolMotionSettings(FULL_SPEED_M_S, STICK_SPEED_M_S)


def uncertain(**changes: Any) -> Uncertainty:
    """Return the uncertainty at P = 0.99. Unless changed, it has camera errors of 3 mm (standard deviation) only."""
    return replace(Uncertainty(0.99, camera_sd_m=CAMERA_SD_M, prediction=EXACT), **changes)


def inputs(encoder_sigma_rad: float = 0.0, **changes: Any) -> LawInputs:
    return LawInputs(uncertain(**changes), np.full(6, encoder_sigma_rad), LIMITS, MOTION, Surroundings())


def swept(encoder_sigma_rad: float = 0.0, *, maps: bool = False, **changes: Any) -> SweptLaw:
    return SweptLaw(inputs(encoder_sigma_rad, **changes), maps=maps)


def paper(
    encoder_sigma_rad: float = 0.0,
    settings: PaperSettings | None = None,
    *,
    isotropic: bool = False,
    **changes: Any,
) -> PaperLaw:
    return PaperLaw(
        replace(inputs(encoder_sigma_rad, **changes), paper=settings or PaperSettings()), isotropic=isotropic
    )


def situation(pose: GripperPose, objects: PerceivedObjects | None = None, **changes: Any) -> Situation:
    """Return an input of the law. Unless changed, the arm is at rest, the stick centred, the loop age known: 100 ms."""
    at_rest = Situation(
        pose=pose,
        joint_velocities_rad_s=np.zeros(6),
        objects=Scene().objects() if objects is None else objects,
        loop_age_s=0.1,
        loop_age_known=True,
        loop_age_settled=True,
        compensation="operator",
        gap_m=None,
        held=None,
        lateral=(0.0, 0.0),
    )
    return replace(at_rest, **changes)


def moving(velocity_m_s: FloatArray) -> FloatArray:
    """Return the joint velocities (6,) that move the free tool at the velocity `velocity_m_s` (3,)."""
    return np.concatenate([velocity_m_s, np.zeros(3)])


def walls(ahead_m: float | None, behind_m: float | None = None, front_m: float = RADIUS_M) -> PerceivedObjects:
    """Return a wall `ahead_m` before and one `behind_m` behind a gripper that extends to ±`front_m`; None: no wall."""
    scene = Scene()
    if ahead_m is not None:
        scene.add().box([0.0, 0.0, front_m + ahead_m + 0.05], [0.5, 0.5, 0.05])
    if behind_m is not None:
        scene.add().box([0.0, 0.0, -front_m - behind_m - 0.05], [0.5, 0.5, 0.05])
    return scene.objects()


def at(way_m: float, across_m: float = 0.0) -> GripperPose:
    """Return the pose of a gripper of one sphere, at `way_m` along the approach and `across_m` across it."""
    return ball_pose(tool_position_m=[across_m, 0.0, way_m])


@dataclass
class Senses:
    """Law and a virtual clock: each call of `sense` first advances the clock by `step_s`."""

    law: Law = field(default_factory=swept)
    step_s: float = 10.0
    now_s: float = 100.0

    def sense(self, pose: GripperPose, objects: PerceivedObjects | None = None, **changes: Any) -> Sensed:
        self.now_s += self.step_s
        return self.law.sense(situation(pose, objects, **changes), self.now_s)
