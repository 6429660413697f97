"""Interface of every law: once a tick it computes two trigger fields and a rumble from a situation."""

import math
from typing import Final, Protocol

import numpy as np

from common.arrays import require_finite
from common.protocol.around import Around
from common.skipped import Part
from robot_side.arm.port import GripperPose
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

MOST_M: Final = 100.0
"""Largest distance (m) or speed (m/s) in a message; larger ones are cut to it. An unstable simulation would exceed it,
and must still report."""


class Law(Protocol):
    """Computes the stiffness of both triggers from a situation."""

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the fields and the rumble of one tick."""
        ...

    def around(self, pose: GripperPose) -> Around | None:
        """Return the map of onset distances around the gripper, or None if there is no valid one.

        An operator side traces the gripper's path through the map.
        """
        ...

    def summary(self) -> dict[str, int]:
        """Return counts of the law's work over the run, for the run's summary."""
        ...

    def skipped(self) -> dict[str, Part]:
        """Return what the law has done, of which whole, for the run's summary: `pairs` and `looks`, if it knows."""
        ...


def require_usable(situation: Situation, joints: int, now_s: float) -> None:
    """Raise a ValueError that names what is not finite or has the wrong size: NaN would compare as far away.

    joints: the number n for which the law was made.
    """
    pose, rates = situation.pose, situation.joint_velocities_rad_s
    spheres = len(pose.sphere_radii_m)
    for name, count, valid in (
        ("joint_velocities_rad_s", len(rates), joints),
        ("pose.tool_jacobian's columns", pose.tool_jacobian.shape[1], joints),
        ("pose.sphere_centers_m", len(pose.sphere_centers_m), spheres),
        ("pose.sphere_on_finger", len(pose.sphere_on_finger), spheres),
    ):
        if count != valid:
            raise ValueError(f"{name} = {count}; valid: {valid}, the number that the law was made for")
    arrays = pose.tool_position_m, pose.tool_rotation, pose.tool_jacobian, pose.sphere_centers_m, pose.sphere_radii_m
    # A sum of squares is finite only if all numbers are; this takes a third of the time that np.isfinite takes.
    squares = sum(float(np.vdot(array, array)) for array in (*arrays, rates))
    gap_m = situation.gap_m or 0.0
    if math.isfinite(squares + sum(situation.lateral) + situation.loop_age_s + gap_m + now_s):
        return
    for name in ("tool_position_m", "tool_rotation", "tool_jacobian", "sphere_centers_m", "sphere_radii_m"):
        require_finite(f"pose.{name}", getattr(pose, name))
    require_finite("joint_velocities_rad_s", rates)
    others = ("loop_age_s", situation.loop_age_s), ("lateral", situation.lateral), ("gap_m", gap_m), ("now_s", now_s)
    for name, values in others:
        require_finite(name, np.atleast_1d(np.array(values)))
