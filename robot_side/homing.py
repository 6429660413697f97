"""Way home: a straight line between joint positions to the arm's start pose, free as far as objects are perceived.

waiting ─▶ checking ─▶ moving ─▶ home
              │           │        the arm stands until all of the way has been looked at, one place in a tick;
              └─────┬─────┘        while it moves, what is left of the way is looked at again and again
                refused            until the button is released
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import MotionCommand
from common.roles import Role
from robot_side.arm.ability import JointLimits
from robot_side.arm.port import ArmState, GripperKinematics, GripperPose
from robot_side.gripper.grip import Grip
from robot_side.surroundings.distances import object_distances
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings

_CLEAR_M: Final = 0.01
"""Distance that must stay free beyond the enlargement at rest"""
_STEP_RAD: Final = 0.04
"""Largest motion of a joint between two places that are looked at"""
_AGAIN_TICKS: Final = 5
_RATE_RAD_S: Final = 0.4
_SPEED_M_S: Final = 0.125
"""Largest rate of a joint and speed of the tool on the way home, at full speed scale"""
_APPROACH_1_S: Final = 3.0
"""Rate of each rad that is left, in 1/s: the arm slows down before it is home"""
_HOME_RAD: Final = 0.001
_STILL_RAD_S: Final = 0.02
_NAME: Final = 100
"""Characters to which an object's name is cut"""


class Homing:
    """Motion to the start pose while the operator asks for it and touches nothing else."""

    def __init__(
        self, home_rad: FloatArray, limits: JointLimits, kinematics: GripperKinematics, surroundings: Surroundings
    ) -> None:
        """home_rad (n,): the start pose."""
        self._home_rad, self._limits = home_rad, limits
        self._kinematics, self._surroundings = kinematics, surroundings
        self._begin()

    def _begin(self) -> None:
        self._refused: str | None = None
        self._clear_m = math.nan
        self._place = self._ticks = 0
        self._free = False

    def follow(
        self,
        command: MotionCommand | None,
        state: ArmState,
        grip: Grip,
        objects: PerceivedObjects,
        enlargement_m: float,
    ) -> FloatArray | str | None:
        """Return joint velocities (n,) towards home, why there are none, or None if nothing asks for the way home.

        enlargement_m: the present D_incr. The arm's links are not looked at, only the gripper and what it holds.
        """
        if command is None or not _asks(command):
            self._begin()
            return None
        if self._refused is not None:
            return self._refused
        still = bool(np.abs(state.joint_velocities_rad_s).max(initial=0.0) < _STILL_RAD_S)
        if math.isnan(self._clear_m):
            if not still:
                return np.zeros(self._home_rad.size)
            self._clear_m = _CLEAR_M + enlargement_m
        self._look(state, grip, objects)
        if self._refused is not None:
            return self._refused
        return self._velocity(state, command.home) if self._free else np.zeros(self._home_rad.size)

    def _look(self, state: ArmState, grip: Grip, objects: PerceivedObjects) -> None:
        """Look at the next place on the way, and begin again once all were free."""
        self._ticks += 1
        if self._free and self._ticks % _AGAIN_TICKS > 0:
            return
        left_rad = self._home_rad - state.joint_positions_rad
        places = max(1, math.ceil(np.abs(left_rad).max(initial=0.0) / _STEP_RAD))
        self._place = min(self._place, places)
        here, there = (
            grip.joined(self._pose(state, state.joint_positions_rad + share * left_rad))
            for share in (self._place / places, min(self._place + 1, places) / places)
        )
        self._kinematics.pose(state)  # the scene shows the pose of the last call
        # Between two places no sphere moves farther than this from the nearer one.
        moved_m = 0.5 * float(np.linalg.norm(there.sphere_centers_m - here.sphere_centers_m, axis=1).max(initial=0.0))
        clear_m = self._clear_m + moved_m
        scene = self._surroundings.see(objects)
        distances_m = object_distances(here.sphere_centers_m, here.sphere_radii_m, scene, clear_m)
        for index in np.flatnonzero(np.isfinite(distances_m)).tolist():
            if index != grip.index and objects.roles[index] is not Role.IGNORED:
                apart_mm, needed_mm = 1e3 * max(float(distances_m[index]), 0.0), 1e3 * clear_m
                name = objects.names[index][:_NAME]
                self._refused = f"no way home: {name} is {apart_mm:.0f} mm from it, {needed_mm:.0f} must be free"
                return
        self._place += 1
        if self._place > places:
            self._free, self._place = True, 0

    def _pose(self, state: ArmState, positions_rad: FloatArray) -> GripperPose:
        return self._kinematics.pose(replace(state, joint_positions_rad=np.ascontiguousarray(positions_rad)))

    def _velocity(self, state: ArmState, share: float) -> FloatArray:
        left_rad = self._home_rad - state.joint_positions_rad
        farthest_rad = float(np.abs(left_rad).max(initial=0.0))
        if farthest_rad < _HOME_RAD:
            return np.zeros(left_rad.size)
        toward = left_rad / farthest_rad
        speed_m_s = float(np.linalg.norm(self._kinematics.pose(state).tool_jacobian[:3] @ toward))
        fastest = np.min(self._limits.velocity_rad_s / np.maximum(np.abs(toward), 1e-9))
        rate = min(_RATE_RAD_S, float(fastest), _SPEED_M_S / max(speed_m_s, 1e-9))
        velocity: FloatArray = toward * min(share * rate, _APPROACH_1_S * farthest_rad)
        return velocity


def _asks(command: MotionCommand) -> bool:
    """Return whether the command asks for the way home, with triggers and sticks at rest."""
    return command.home > 0.0 and command.l2 == command.r2 == 0.0 and not any((*command.lateral, *command.turning))
