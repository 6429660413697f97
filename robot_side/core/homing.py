"""Way home: a straight line between joint positions to the arm's start pose, free as far as objects are perceived.

waiting ─▶ checking ─▶ moving ─▶ home
              │           │        the arm stands until all of the way has been looked at, a place each millisecond;
              └─────┬─────┘        while it moves, what is left of the way is looked at again and again
                refused            until the button is released
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import MotionCommand
from common.roles import Role
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState, GripperKinematics
from robot_side.gripper.grip import Grip
from robot_side.surroundings.distances import object_distances
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings

CLEAR_M: Final = 0.01
"""Distance beyond the enlargement within which something may be touched"""
_STEP_RAD: Final = 0.04
"""Largest motion of a joint between two places that are looked at"""
_CHECK_S: Final = 0.001
_AGAIN_S: Final = 0.005
_MOST_S: Final = 0.02
"""Time from the look at a place to that at the next, in s: at first, and while the arm moves; longest time whose looks
are made up for"""
_RATE_RAD_S: Final = 0.4
_SPEED_M_S: Final = 0.125
"""Largest rate of a joint and speed of the tool on the way home, at full speed scale"""
_APPROACH_1_S: Final = 3.0
"""Rate of each rad that is left, in 1/s: the arm slows down before it is home"""
_HOME_RAD: Final = 0.001
_STILL_RAD_S: Final = 0.02
_LINK_SLACK_M: Final = 0.002
"""Distance by which a link may come nearer to what it was near to at the beginning"""
_FAR_M: Final = 0.1
_NAME: Final = 100
"""Characters to which an object's name is cut"""


_Spheres = tuple[FloatArray, FloatArray]


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
        self._near_m: dict[str, float] = {}
        self._place, self._next_s = 0, -math.inf
        self._free = False

    def velocity(
        self,
        command: MotionCommand | None,
        state: ArmState,
        grip: Grip,
        objects: PerceivedObjects,
        enlargement_m: float,
    ) -> FloatArray | str | None:
        """Return joint velocities (n,) towards home, why there are none, or None if nothing asks for the way home.

        enlargement_m: the present D_incr. Gripper, held object, and coarse spheres around the links are looked at.
        A link may stay as near to a thing as it is at the beginning, and to a support as it is at home.
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
            self._clear_m, self._next_s = CLEAR_M + enlargement_m, state.time_s
            self._note_near(state, grip, objects)
        self._next_s = max(self._next_s, state.time_s - _MOST_S)
        while self._next_s <= state.time_s:
            self._check(state, grip, objects)
            if self._refused is not None:
                return self._refused
            self._next_s += _AGAIN_S if self._free else _CHECK_S
        return self._velocity(state, command.home) if self._free else np.zeros(self._home_rad.size)

    def _check(self, state: ArmState, grip: Grip, objects: PerceivedObjects) -> None:
        """Look at the next place on the way, and begin again once all were free."""
        left_rad = self._home_rad - state.joint_positions_rad
        places = max(1, math.ceil(np.abs(left_rad).max(initial=0.0) / _STEP_RAD))
        self._place = min(self._place, places)
        here, there = (
            self._spheres(state, grip, state.joint_positions_rad + share * left_rad)
            for share in (self._place / places, min(self._place + 1, places) / places)
        )
        self._kinematics.pose(state)  # the scene shows the pose of the last call
        # Between two places no sphere moves farther than this from the nearer one.
        moved_m = 0.5 * max(
            float(np.linalg.norm(after[0] - before[0], axis=1).max(initial=0.0))
            for before, after in zip(here, there, strict=True)
        )
        clear_m = self._clear_m + moved_m
        for spheres, what, near_m in zip(here, ("it", "a link"), ({}, self._near_m), strict=True):
            for name, apart_m, _ in self._apart(spheres, grip, objects, clear_m):
                needed_m = min(clear_m, near_m.get(name, math.inf))
                if apart_m <= needed_m:
                    apart_mm, needed_mm = 1e3 * max(apart_m, 0.0), 1e3 * max(needed_m, 0.0)
                    self._refused = (
                        f"no way home: {name[:_NAME]} is {apart_mm:.0f} mm from {what}, {needed_mm:.0f} must be free"
                    )
                    return
        self._place += 1
        if self._place > places:
            self._free, self._place = True, 0

    def _note_near(self, state: ArmState, grip: Grip, objects: PerceivedObjects) -> None:
        """Note how near the links may come to things: as near as here, and to supports as at home."""
        for positions_rad, any_role in ((state.joint_positions_rad, True), (self._home_rad, False)):
            links = self._spheres(state, grip, positions_rad)[1]
            for name, apart_m, role in self._apart(links, grip, objects, _FAR_M):
                if any_role or role is Role.SUPPORT:
                    self._near_m[name] = min(self._near_m.get(name, math.inf), apart_m - _LINK_SLACK_M)

    def _apart(
        self, spheres: _Spheres, grip: Grip, objects: PerceivedObjects, reach_m: float
    ) -> Iterator[tuple[str, float, Role]]:
        """Yield name, distance and role of each object within `reach_m`, but of the held and of ignored ones."""
        distances_m = object_distances(*spheres, self._surroundings.see(objects), reach_m)
        for index in np.flatnonzero(np.isfinite(distances_m)).tolist():
            if index != grip.index and objects.roles[index] is not Role.IGNORED:
                yield objects.names[index], float(distances_m[index]), objects.roles[index]

    def _spheres(self, state: ArmState, grip: Grip, positions_rad: FloatArray) -> tuple[_Spheres, _Spheres]:
        """Return the spheres of the gripper with what it holds, and of the links, at joint positions (n,)."""
        there = replace(state, joint_positions_rad=np.ascontiguousarray(positions_rad))
        gripper = grip.joined(self._kinematics.pose(there))
        return (gripper.sphere_centers_m, gripper.sphere_radii_m), self._kinematics.link_spheres(there)

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
