"""The robot side without I/O: payloads in, payloads out, and `now` with every call.

payloads ─▶ receive ─▶ newest command ─▶ safety ─▶ tool motion ─▶ arm
arm ─▶ kinematics ─▶ law: what is ahead ─▶ stiffness fields, telemetry ─▶ payloads
"""

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from common.arrays import FloatArray
from common.command.live_view import LINK_LOST, LINK_UP
from common.protocol.codec import encode
from common.statistics import RunningStatistics
from common.timing.ages import LoopAge
from robot_side.arm.ability import JointLimits
from robot_side.arm.commanded import commanded
from robot_side.arm.joint_estimate import JointEstimate
from robot_side.arm.port import Arm, ArmState, GripperKinematics, GripperPose
from robot_side.arm.speed_assist import assisted
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.arm.touching_down import TouchingDown, carried_n
from robot_side.figures import Observer, RunFigures
from robot_side.gripper.held_covers import HeldCovers
from robot_side.gripper.held_object import HeldObject, grip, gripped_object, with_held
from robot_side.gripper.perceived_distances import perceived_distances
from robot_side.laws.law import Law, Situation
from robot_side.laws.sensed import Sensed
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Permission
from robot_side.outgoing_messages import SHOWN_NAME, MapSchedule, Outgoing, stiffness_message, telemetry
from robot_side.perceptual_deadband import StiffnessDeadband, TelemetryDeadband
from robot_side.placing import scaled
from robot_side.surroundings.perceived import ObjectSource, PerceivedObjects, Role
from robot_side.surroundings.surroundings import Surroundings
from robot_side.surroundings.target import next_target, object_centers

OBSERVER_PERIOD_S = 0.02
"""How often those who only observe are told the stiffness."""
TRUTH_PERIOD_S = 0.01
_LET_GO_S = 0.1
"""Fingers that move for a moment, as they follow a slipping object, still hold it."""


class RobotSide:
    """The pipeline of one robot, with one operator at a time and others that observe."""

    def __init__(
        self,
        arm: Arm,
        kinematics: GripperKinematics,
        camera: ObjectSource,
        law: Law,
        surroundings: Surroundings,
        session: OperatorSession,
        loop_age: LoopAge,
        limits: JointLimits,
        motion: ToolMotionSettings,
        observer: Observer | None = None,
        *,
        assists: bool = False,
        seed: int = 0,
        notes: Sequence[str] = (),
        held_covers: HeldCovers | None = None,
        full_rate: bool = False,
    ) -> None:
        """assists: cap the speed along the triggers (see `speed_assist`). full_rate: a stiffness in every tick."""
        self.notes = tuple(notes)
        """What a person should know about the scene before the run."""
        self.figures, self.stiffness_sent = RunFigures(seed), 0
        self.session = session
        self._arm = arm
        self._kinematics = kinematics
        self._camera = camera
        self._law = law
        self._surroundings = surroundings
        self._loop_age = loop_age
        self._limits = limits
        self._motion = motion
        self._observer = observer
        self._assists = assists
        self._joints = JointEstimate()
        self._still: FloatArray = np.zeros(arm.joint_count)
        self._told_m_s = self._rises_m_s = 0.0
        self._touching_down = TouchingDown()
        self._held_covers = held_covers
        self._start_s: float | None = None
        self._held: HeldObject | None = None
        self._held_s = self._next_observers_s = self._next_truth_s = -np.inf
        self._measured: ArmState | None = None
        self._frame: PerceivedObjects | None = None
        self._target: int | None = None
        self._target_m: FloatArray | None = None
        self.newest: tuple[Sensed, Situation] | None = None
        """What the last tick found out, and where."""
        self._loop_age_s = RunningStatistics(seed)
        self.felt = StiffnessDeadband(full_rate=full_rate)
        """When a stiffness leaves"""
        self._around = MapSchedule()
        self._seen = TelemetryDeadband()

    @property
    def held(self) -> str | None:
        """The name of the object that the gripper holds; None for none."""
        return None if self._held is None else self._held.name

    def loop_age_s(self, now_s: float) -> float:
        """The delay that is reckoned with at `now_s`: t_d of eq. 8."""
        return self._loop_age.value(now_s)

    def receive(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """Take one control payload from `peer`; what is invalid, late or not the operator's never gets further."""
        self.session.receive(peer, payload, now_s)

    def tick(self, now_s: float) -> list[Outgoing]:
        """One turn of the pipeline at `now_s`; what to send."""
        if self._start_s is None:
            self._start_s = now_s
        self.session.update(now_s)
        if self.session.take_owner_changed():
            self._loop_age.reset()
            self.felt.forget()
            self._around = MapSchedule()
        if (age_s := self.session.loop_age_s(now_s)) is not None:
            # In every tick, so that a link that falls silent ages, too (eq. 8).
            delay_s = self._loop_age.update(age_s, now_s)
            self._loop_age_s.add(delay_s)
        else:
            delay_s = self._loop_age.value(now_s)
        self._measured = self._arm.state(now_s)
        state = self._joints.update(self._measured)
        pose = self._kinematics.pose(state)
        objects = self.see(now_s) if self._frame is None else self._frame
        self._follow_target(objects, pose)
        self._follow_grip(objects, pose, state)
        whole = pose if self._held is None else with_held(pose, self._held)
        self._follow_stand(pose, state)
        permission = self.session.permission(now_s)
        self._move(permission, pose, state, now_s)
        command = permission.command
        situation = Situation(
            pose=whole,
            joint_velocities_rad_s=state.joint_velocities_rad_s,
            objects=objects,
            loop_age_s=delay_s,
            loop_age_known=self._loop_age.known,
            compensation="operator" if command is None else command.compensation,
            gap_m=state.gripper_opening_m if self._kinematics.has_fingers else None,
            held=None if self._held is None else self._held.index,
            lateral=(0.0, 0.0) if command is None else command.lateral,
        )
        sensed = self._law.sense(situation, now_s)
        self.newest = sensed, situation
        self._record(sensed, permission.state == "armed", now_s)
        return self._outgoing(permission, situation, state, sensed, now_s)

    def see(self, now_s: float) -> PerceivedObjects:
        """Take in the camera's newest frame, from the next tick on: no message waits for what is made of it."""
        objects = self._camera.perceive(now_s)
        if objects is not self._frame:
            self._surroundings.see(objects)
            self._frame = objects
            self._target = self._surroundings.target(objects)
            self._target_m = None if self._target is None else self._surroundings.center_m(objects, self._target)
        return objects

    def _follow_target(self, objects: PerceivedObjects, pose: GripperPose) -> None:
        """Make the next object the target, once for each press of the button."""
        if not self.session.take_next_target():
            return
        where = object_centers(objects), pose.tool_position_m, pose.tool_rotation[:, 2]
        chosen = next_target(objects, self._target, *where)
        if chosen is None or self._held is not None:
            return
        if self._target is not None:
            self._camera.set_role(objects.names[self._target], Role.OBSTACLE)
        self._camera.set_role(chosen, Role.TARGET)

    def _follow_grip(self, objects: PerceivedObjects, pose: GripperPose, state: ArmState) -> None:
        """Notice when an object is gripped or let go."""
        if state.gripper_holding:
            self._held_s = state.time_s
        if self._held is not None and state.time_s - self._held_s > _LET_GO_S:
            self._held, self._touching_down = None, TouchingDown()
        elif self._held is None and state.gripper_holding:
            index = gripped_object(self._surroundings.see(objects), pose.tool_position_m, state.gripper_opening_m)
            if index is not None:
                self._held = grip(objects, index, pose, self._held_covers)

    def _follow_stand(self, pose: GripperPose, state: ArmState) -> None:
        """Notice when what is held comes to stand."""
        if self._held is not None and self._touching_down.due(state.time_s):
            carried = carried_n(pose.tool_jacobian, state.joint_loads_nm)
            height_m = float(pose.tool_position_m[2])
            self._touching_down.update(carried, height_m, self._rises_m_s, state.time_s)

    def _move(self, permission: Permission, pose: GripperPose, state: ArmState, now_s: float) -> None:
        """Pass the operator's motion on to the arm; without permission nothing is commanded, and it stops."""
        command = permission.command
        if command is None or self._touching_down.gives_way:
            self._told_m_s = self._rises_m_s = 0.0
            # No longer valid: a command that runs out between two physics steps would let a load sink, each time anew.
            self._arm.command(self._still, state.time_s)
            self._arm.command_gripper(0.0, now_s)
            return
        if self._assists and self.newest is not None:
            command = assisted(command, self.newest[0].l2, self.newest[0].r2)
        where = pose, state.joint_positions_rad, self._limits, self._motion
        velocity, self._told_m_s = commanded(command, *where, stands=self._touching_down.stands)
        self._rises_m_s = 0.0 if self._held is None else float(pose.tool_jacobian[2] @ velocity)
        self._arm.command(velocity, permission.valid_until_s)
        self._arm.command_gripper(command.gripper, permission.valid_until_s)

    def _record(self, sensed: Sensed, armed: bool, now_s: float) -> None:
        self.figures.tick(sensed, armed=armed)
        held = self._held is not None and self._held.index == self._target
        self.figures.task(armed, held, self._target_m, now_s)

    def observe(self, now_s: float) -> None:
        """After the messages of the tick at `now_s` have left: see, and note what was true, where somebody knows it."""
        self.see(now_s)
        self.figures.reckon()
        if self._observer is not None:
            self._observer.watch(self.figures, now_s - (self._start_s or 0.0))
        if self._observer is not None and now_s >= self._next_truth_s:
            self._next_truth_s = now_s + TRUTH_PERIOD_S
            self._observer.observe(self.figures, now_s)

    def _outgoing(
        self, permission: Permission, situation: Situation, state: ArmState, sensed: Sensed, now_s: float
    ) -> list[Outgoing]:
        session = self.session
        felt = sensed, self._told_m_s, permission.state, self._touching_down.stands
        outgoing = [Outgoing("haptics", *answer) for answer in session.take_answers(now_s)]
        if session.owner_peer is not None and self.felt.due(*felt, permission.command, now_s):
            self.stiffness_sent += 1
            around = self._around.due(self._law, situation.pose, now_s)
            outgoing += [stiffness_message(one, *felt, around) for one in session.owners(now_s)]
        if now_s >= self._next_observers_s:
            self._next_observers_s = now_s + OBSERVER_PERIOD_S
            outgoing += [stiffness_message(one, *felt) for one in session.observers(now_s)]
        holding = self._held is not None
        if self._seen.may_be_due((session.lease.token, permission.state, self._target, holding), now_s):
            target = None if self._target is None else (situation.objects.names[self._target], self._target_m)
            view = telemetry(permission.state, situation.pose, sensed, state, target, holding=holding)
            if self._seen.due(view, now_s):
                view = msgspec.structs.replace(view, header=session.view_header(now_s))
                outgoing.append(Outgoing("telemetry", b"", encode(view)))
        return outgoing

    def status(self, now_s: float) -> dict[str, float | str | bool | None]:
        """What a person is shown, and a few figures for whoever reads JSON lines."""
        lease, safety, command = self.session.lease, self.session.safety, self.session.safety.command
        delay_s = self.session.link.delay.mean
        lost = f"{LINK_LOST}nothing heard from the operator" if lease.token > 0 else "waiting for an operator"
        values: dict[str, float | str | bool | None] = {
            "link": lost if lease.owner is None else LINK_UP,
            "state": safety.state,
            "stopped_because": safety.stops[-1][1] if safety.stops and safety.state != "armed" else None,
            "owner": "none" if lease.owner is None else str(lease.owner.state),
            "observers": len(lease.observers()),
            "refused": self.session.refused,
            "loop_age_ms": 1e3 * self._loop_age.value(now_s),
            "delay_ms": None if delay_s is None else 1e3 * delay_s,
            "L2_pulled": None if command is None else command.l2,
            "R2_pulled": None if command is None else command.r2,
        }
        if self.newest is not None and (objects := self._frame) is not None:
            sensed, pose = self.newest[0], self.newest[1].pose
            target, held = self._target, None if self._held is None else self._held.index
            apart = perceived_distances(pose, self._surroundings.see(objects), target, held)
            values |= {
                "L2": sensed.l2.stiffness,
                "R2": sensed.r2.stiffness,
                "enlargement_mm": 1e3 * sensed.enlargement_m,
                "holding": "nothing" if self._held is None else self._held.name[:SHOWN_NAME],
                "stands": self._touching_down.stands,
                "nearest": None if apart.nearest is None else apart.nearest[:SHOWN_NAME],
                "nearest_mm": scaled(apart.nearest_m, 1e3),
                "target": None if target is None else objects.names[target][:SHOWN_NAME],
                "target_mm": scaled(apart.target_m, 1e3),
            }
        return values

    def summary(self) -> dict[str, Any]:
        """This side's part of the run's summary."""
        start_s = self._start_s or 0.0
        stops = [{"time_s": when_s - start_s, "reason": reason} for when_s, reason in self.session.safety.stops]
        return self.figures.summary() | {
            "skipped": self._law.summary(),
            "messages": {
                "stiffness_sent": self.stiffness_sent,
                "motion_received": self.session.motion_received,
                "rejected": self.session.rejected,
                "stale": self.session.stale,
            },
            "lease": self.session.summary(),
            "delay_ms": {"to_robot": self.session.link.delay.summary_ms()},
            "gaps": {"to_robot": self.session.link.gaps},
            "driving_delay_ms": {"to_robot": self.session.driving_delay.summary_ms()},
            "loop_age_ms": self._loop_age_s.summary_ms(),
            "applied_age_ms": {"to_robot": self.session.applied_age.summary_ms()},
            "offset_ms": {"robot": self.session.link.offset_summary_ms()},
            "stops": stops,
        }
