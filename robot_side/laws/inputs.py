"""What a law is made from, with what most laws need: overlaps, the nearest thing, and a field of one strength."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.protocol.uniform_field import FAR_M, STRENGTHS, uniform_field
from common.roles import Role
from robot_side.arm.ability import along_approach
from robot_side.arm.limits import JointLimits
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.enlargement.distance import Uncertainty
from robot_side.field.object_class import OBSTACLE, SKIPPED
from robot_side.laws.paper_settings import PaperSettings
from robot_side.surroundings.surroundings import Surroundings
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

_NEAREST_STEPS: Final = 10


@dataclass(frozen=True)
class LawInputs:
    """Arm, errors and surroundings of a run."""

    uncertainty: Uncertainty
    """Probability P and the errors of eq. 9-10"""
    encoder_sigma_rad: FloatArray
    """(n,) σ_θ of eq. 3"""
    limits: JointLimits
    motion: ToolMotionSettings
    surroundings: Surroundings
    """Owner of the perceived scene"""
    paper: PaperSettings = field(default_factory=PaperSettings)
    """Settings of the paper's own law"""

    def total_overlap_m3(
        self,
        situation: Situation,
        inflated_m: float | FloatArray = 0.0,
        moved_m: FloatArray | None = None,
        classes: IntArray | None = None,
    ) -> float:
        """Return Σ V_ij (eq. 11-12) over the gripper's spheres i and all things j but what is held.

        Space counts once for each sphere that covers it. inflated_m: growth of every radius, or (m,) of each. moved_m
        (3,): displacement of the gripper in the world. classes (k,): of the objects j; SKIPPED ones do not count.
        """
        # Imported here, as the law `swept` does without its kernel, which takes 1.5 s to compile.
        from robot_side.field.total_overlap import total_overlap_m3  # noqa: PLC0415

        pose = situation.pose
        centers_m = pose.sphere_centers_m if moved_m is None else pose.sphere_centers_m + moved_m
        spheres = np.concatenate([centers_m, (pose.sphere_radii_m + inflated_m)[:, None]], axis=1)
        felt = everything_but_held(situation) if classes is None else classes
        return total_overlap_m3(spheres, self.surroundings.see(situation.objects), felt)

    def nearest_m(self, situation: Situation, farthest_m: float = 0.2) -> float:
        """Return the distance from the gripper to the nearest thing, to a thousandth of `farthest_m`, at most that."""
        near_m, far_m = 0.0, farthest_m
        if self.total_overlap_m3(situation, farthest_m) == 0.0:
            return farthest_m
        for _ in range(_NEAREST_STEPS):
            middle_m = 0.5 * (near_m + far_m)
            meets = self.total_overlap_m3(situation, middle_m) > 0.0
            near_m, far_m = (near_m, middle_m) if meets else (middle_m, far_m)
        return near_m

    def sensed(self, situation: Situation, *, l2: float, r2: float, enlargement_m: float = 0.0) -> Sensed:
        """Return the result of a law that has one stiffness for each trigger, 0 to 1, at every travel.

        It is rounded to eighths. enlargement_m: for the run's figures. ValueError for a stiffness out of range.
        """
        for name, stiffness in (("l2", l2), ("r2", r2)):
            if not 0.0 <= stiffness <= 1.0:
                raise ValueError(f"{name} = {stiffness}; valid: 0 to 1")
        pose = situation.pose
        able = along_approach(pose, self.limits, self.motion.trigger_speed_m_s)
        velocity_m_s = pose.tool_jacobian[:3] @ situation.joint_velocities_rad_s
        return Sensed(
            l2=uniform_field(round(STRENGTHS * l2), able.full_speed_m_s, able.acceleration_m_s2),
            r2=uniform_field(round(STRENGTHS * r2), able.full_speed_m_s, able.acceleration_m_s2),
            speed_m_s=float(pose.tool_rotation[:, 2] @ velocity_m_s),
            tool_speed_m_s=float(np.linalg.norm(velocity_m_s)),
            horizon_m=FAR_M,
            enlargement_m=enlargement_m,
        )


def everything_but_held(situation: Situation) -> IntArray:
    """Return the class of each object, (k,): all are obstacles but those that are ignored and the held one."""
    roles = situation.objects.roles
    classes = np.array([SKIPPED if role is Role.IGNORED else OBSTACLE for role in roles], dtype=np.int64)
    if situation.held is not None:
        classes[situation.held] = SKIPPED
    return classes
