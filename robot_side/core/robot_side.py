"""Robot side without I/O: payloads come in and go out, and every call has the time `now`.


payloads ─▶ receive ─▶ newest command ─▶ safety ─▶ tool motion ─▶ arm
arm ─▶ kinematics ─▶ law: contact ahead ─▶ stiffness fields ─▶ payloads; afterwards telemetry
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import msgspec
import numpy as np

from common.skipped import Part, shares
from common.status.codes import LinkState
from common.status.statuses import RobotStatus
from robot_side.arm.joint_estimate import JointEstimate, lateness_s
from robot_side.arm.port import ArmState
from robot_side.core.homing import CLEAR_M, Homing
from robot_side.core.motion import Motion
from robot_side.core.robot_parts import RobotParts
from robot_side.gripper.grip import Grip
from robot_side.outcome.figures import RunFigures
from robot_side.outcome.placing import scaled
from robot_side.reporting.reports import Reports
from robot_side.surroundings.distances import object_distances
from robot_side.surroundings.perceived_distances import perceived_distances
from robot_side.surroundings.surroundings import Sight
from robot_side.tick.events import Found, Listener, Listeners, Tick
from robot_side.tick.outgoing import SHOWN_NAME, Outgoing
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

_TRIED_RAD: Final = 0.1
_LEVER_M: Final = 0.1
"""Turn of a joint, and lever from which what it turns may meet something: what is nearer stands beside it anyway"""


class RobotSide:
    """Pipeline of one robot, with one operator at a time and others that observe."""

    def __init__(self, parts: RobotParts, listeners: Sequence[Listener] = ()) -> None:
        """listeners: receive the events of each turn, like the run's figures."""
        self.parts, self.session = parts, parts.session
        self.sight = Sight(parts.camera, parts.surroundings)
        self.grip = Grip(parts.surroundings, parts.held_covers)
        moving = parts.arm, parts.limits, parts.motion, parts.following
        self.motion = Motion(*moving, assists=parts.assists, bounds=parts.bounds)
        home = parts.kinematics, parts.surroundings
        self.homing = None if parts.home_rad is None else Homing(parts.home_rad, parts.limits, *home)
        self.reports = Reports(parts.session, parts.law.around, parts.frames, full_rate=parts.full_rate)
        self.figures = RunFigures(parts.seed, parts.truth, parts.enlarged)
        self.newest: tuple[Sensed, Situation] | None = None
        """Result of the law in the last tick, and the situation for which it was computed"""
        self._joints = JointEstimate()
        self._measured: ArmState | None = None
        self._found: Found | None = None
        self._heard = Listeners((*listeners, self.figures))

    @property
    def held(self) -> str | None:
        """Name of the object that the gripper holds; None if it holds nothing."""
        return None if self.grip.held is None else self.grip.held.name

    def loop_age_s(self, now_s: float) -> float:
        """Return the loop age used at `now_s`, in seconds: t_d of eq. 8."""
        return self.parts.loop_age.value(now_s)

    def receive(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """Take one control payload from `peer`; drop a payload that is invalid, late, or not the operator's."""
        self._heard.on_received(peer, payload, now_s)
        self.session.receive(peer, payload, now_s)
        for mark in self.session.episodes.take_accepted():
            if mark == "reset":
                self.grip.let_go()
                self.motion.following.restart()
                self.sight.see(now_s)
            self._heard.on_episode(mark, now_s)

    def tick(self, now_s: float) -> list[Outgoing]:
        """Run the pipeline once at `now_s`; return the messages to send. Listeners receive a failed tick, too."""
        outgoing: list[Outgoing] = []
        self._found = None
        try:
            outgoing = self._run(now_s)
        finally:
            command = self.session.safety.command
            sent_s = math.nan if command is None else command.header.sent_s
            self._heard.on_step("listeners")
            self._heard.on_tick(Tick(now_s, self._measured, self.sight.frame, sent_s, outgoing, self._found))
            self._heard.on_step("end")
        return outgoing

    def _run(self, now_s: float) -> list[Outgoing]:
        begin, parts, sight, grip = self._heard.on_step, self.parts, self.sight, self.grip
        begin("arm")
        self._measured = parts.arm.state(now_s)
        begin("pose")
        late_s, following = lateness_s(self._measured, now_s), self.motion.following
        following.update(self.motion.commanded_rad_s, self._measured, late_s, self._touches)
        delay_s = self._follow_operator(now_s, late_s, self._measured)
        self._joints.update(self._measured)
        state = self._joints.carried(late_s)
        pose = parts.kinematics.pose(state)
        begin("grip")
        objects = sight.see(now_s) if sight.frame is None else sight.frame
        if self.session.take_next_target() and grip.held is None:
            sight.choose_next(objects, pose.tool_position_m, pose.tool_rotation[:, 2])
        grip.update(objects, pose, state, self.motion.rises_m_s)
        whole = grip.joined(pose)
        begin("motion")
        permission = self.session.permission(now_s)
        before = None if self.newest is None else self.newest[0]
        homeward = None
        if self.homing is not None and before is not None:
            homeward = self.homing.velocity(permission.command, state, grip, objects, before.enlargement_m)
        self.motion.command(permission, pose, state, grip, before, now_s, homeward)
        begin("law")
        command = permission.command
        situation = Situation(
            pose=whole,
            joint_velocities_rad_s=state.joint_velocities_rad_s,
            objects=objects,
            loop_age_s=delay_s,
            loop_age_known=parts.loop_age.known,
            loop_age_settled=parts.loop_age.settled(now_s),
            compensation="operator" if command is None else command.compensation,
            gap_m=state.gripper_opening_m if parts.kinematics.has_fingers else None,
            held=grip.index,
            lateral=(0.0, 0.0) if command is None else command.lateral,
            astray_m_s=following.tool_error_m_s(pose),
            response_s=parts.limits.response_s,
            later_s=following.stops.later_s,
        )
        sensed = parts.law.sense(situation, now_s)
        self.newest = sensed, situation
        begin("messages")
        done = self.motion.commanded_m_s, grip.touchdown.stands, self.motion.hindrance.text is not None
        outgoing = self.reports.outgoing(permission, situation, sensed, *done, now_s)
        holds_target = grip.index is not None and grip.index == sight.target
        found = permission.state, self.motion.commanded_rad_s, state, situation, sensed
        held = None if grip.held is None else grip.held.spheres_in_tool
        self._found = Found(*found, holds_target, sight.target_m, held)
        return outgoing

    def _follow_operator(self, now_s: float, late_s: float, state: ArmState) -> float:
        """Update the lease's owner and the loop age; return the loop age t_d of eq. 8.

        late_s: lateness of the arm's states, in seconds. Commands take about as long to reach the arm, so it is added,
        and so is the time in which the arm's drives respond.
        """
        session, loop_age = self.session, self.parts.loop_age
        session.update(now_s)
        session.safety.arm_measured(late_s, now_s)
        following, safety = self.motion.following, session.safety
        stop = following.stop
        safety.arm_followed(state.doubt if stop is None else f"the arm does not follow: {stop}", now_s)
        safety.arm_stopped(state.condition, now_s)
        safety.arm_loaded(following.loads.over(state, armed=safety.state == "armed"), now_s)
        if session.take_owner_changed():
            loop_age.reset()
            self.reports.begin_epoch()
        if (age_s := session.loop_age_s(now_s)) is None:
            return loop_age.value(now_s)
        # In every tick, so that a link that falls silent ages, too (eq. 8).
        return loop_age.update(age_s + late_s + self.parts.limits.response_s, now_s)

    def _touches(self, joint: int) -> bool:
        """Return whether what `joint` (from 0) moves may touch something, as far as errors allow.

        These are the gripper, what it holds, and the coarse spheres around the links that are not next to the joint.
        """
        if self.newest is None or self._measured is None:
            return False
        situation, state, link_spheres = self.newest[1], self._measured, self.parts.kinematics.link_spheres
        pose, scene = situation.pose, self.parts.surroundings.see(situation.objects)
        elsewhere_rad = state.joint_positions_rad.copy()
        elsewhere_rad[joint] += _TRIED_RAD
        centers_m, radii_m = link_spheres(state)
        moved_m = link_spheres(replace(state, joint_positions_rad=elsewhere_rad))[0] - centers_m
        swings = np.linalg.norm(moved_m, axis=1) > _TRIED_RAD * _LEVER_M
        spheres = (
            np.concatenate([pose.sphere_centers_m, centers_m[swings]]),
            np.concatenate([pose.sphere_radii_m, radii_m[swings]]),
        )
        near = np.isfinite(object_distances(*spheres, scene, CLEAR_M + self.parts.misplaced_m(situation.objects)))
        return any(index != self.grip.index for index in np.flatnonzero(near).tolist())

    def observe(self, now_s: float) -> list[Outgoing]:
        """Return telemetry, read the camera's newest frame, and let listeners work.

        To be called after the tick's messages have left.
        """
        self._heard.on_step("frame")
        seen: list[Outgoing] = []
        if (found := self._found) is not None:
            motion_state, _, state, situation, sensed, _, target_m, _ = found
            target = None if self.sight.target is None else situation.objects.names[self.sight.target]
            shown = situation, sensed, state, target, target_m, self.motion.hindrance
            seen = self.reports.telemetry(motion_state, *shown, now_s)
        self.sight.see(now_s)
        self._heard.on_step("end")
        self._heard.on_sent(now_s)
        return seen

    def status(self, now_s: float) -> RobotStatus:
        """Return the status shown to people, without the figures of the link, which `turns.py` adds."""
        lease, safety, command = self.session.lease, self.session.safety, self.session.safety.command
        delay_s = self.session.link.delay.mean
        status = RobotStatus(
            link=LinkState.UP if lease.owner is not None else LinkState.LOST if lease.token > 0 else LinkState.WAITING,
            state=safety.state,
            stopped_because=safety.still_because,
            owner=None if lease.owner is None else lease.owner.state,
            observers=len(lease.observers()),
            refused=self.session.refused,
            loop_age_ms=1e3 * self.loop_age_s(now_s),
            delay_ms=None if delay_s is None else 1e3 * delay_s,
            l2_pulled=None if command is None else command.l2,
            r2_pulled=None if command is None else command.r2,
            hindrance=self.motion.hindrance.text,
            offset_s=self.session.link.clock_offset.offset_at(now_s),
            placed=self.figures.placed,
        )
        if self.newest is None or (objects := self.sight.frame) is None:
            return status
        sensed, situation = self.newest
        pose = situation.pose
        target = self.sight.target
        spheres = pose.sphere_centers_m, pose.sphere_radii_m
        apart = perceived_distances(*spheres, self.parts.surroundings.see(objects), target, self.grip.index)
        return msgspec.structs.replace(
            status,
            l2_course_stiffness=sensed.l2.course_stiffness,
            r2_course_stiffness=sensed.r2.course_stiffness,
            enlargement_mm=1e3 * sensed.enlargement_m if situation.loop_age_settled else None,
            holding=None if self.held is None else self.held[:SHOWN_NAME],
            stands=self.grip.touchdown.stands,
            nearest=None if apart.nearest is None else apart.nearest[:SHOWN_NAME],
            nearest_mm=scaled(apart.nearest_m, 1e3),
            target=None if target is None else objects.names[target][:SHOWN_NAME],
            target_mm=scaled(apart.target_m, 1e3),
        )

    def summary(self) -> dict[str, Any]:
        """Return the part of the run's summary that comes from the core."""
        stops = [
            {"time_s": self.figures.since_start_s(when_s), "reason": reason}
            for when_s, reason in self.session.safety.stops
        ]
        return self.figures.summary() | {
            "work": self.parts.law.summary(),
            "skipped": shares(
                **self.parts.law.skipped(),
                stiffness_messages=Part(self.reports.stiffness_sent, self.reports.turns_with_owner),
            ),
            "messages": {
                "stiffness_sent": self.reports.stiffness_sent,
                "motion_received": self.session.motion_received,
                "rejected": self.session.rejected,
                "stale": self.session.stale,
            },
            "following": self.motion.following.summary(),
            "late_stops": self.motion.following.stops.summary(),
            "lease": self.session.summary(),
            "episodes": self.session.episodes.summary(),
            "delay_ms": {"to_robot": self.session.link.delay.summary_ms()},
            "gaps": {"to_robot": self.session.link.gaps},
            "driving_delay_ms": {"to_robot": self.session.driving_delay.summary_ms()},
            "applied_age_ms": {"to_robot": self.session.applied_age.summary_ms()},
            "offset_ms": {"robot": self.session.link.offset_summary_ms()},
            "stops": stops,
        }
