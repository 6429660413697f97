"""The robot side without I/O: payloads in, payloads out, and `now` with every call.

payloads ─▶ receive ─▶ newest command ─▶ safety ─▶ tool motion ─▶ arm
arm ─▶ kinematics ─▶ sensing of what is ahead ─▶ stiffness, telemetry ─▶ payloads
"""

from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np

from common.arrays import FloatArray
from common.codec import decode, encode
from common.delay import LoopAge
from common.errors import RemoteProtocolError
from common.link_end import LinkEnd
from common.messages import AnyMessage, Hello, MotionCommand, StiffnessUpdate, Telemetry
from common.statistics import RunningStatistics
from robot_side.arm_port import Arm, ArmState, GripperKinematics, GripperPose
from robot_side.held_object import HeldObject, grip, gripped_object, with_held
from robot_side.perceived_objects import ObjectSource, PerceivedObjects, Role
from robot_side.resolved_rate import joint_velocities
from robot_side.run_figures import RunFigures
from robot_side.safety import Permission, Safety
from robot_side.sensing import AheadSensing, Sensed
from robot_side.target_selection import next_target, object_centers, target_index
from robot_side.tool_motion import ToolMotionSettings, tool_twist

OutgoingStream = Literal["haptics", "telemetry"]

TELEMETRY_PERIOD_S = 0.02
TRUTH_PERIOD_S = 0.01
OPERATOR_SILENT_S = 1.0
"""An operator that has not been heard of for so long no longer keeps others out."""
_HELLO_PERIOD_S = 0.1
_LET_GO_S = 0.1
"""Fingers that move for a moment, as they follow a slipping object, still hold it."""


@dataclass(frozen=True)
class Outgoing:
    """One payload to send: haptics to `peer` over the control port, telemetry to whoever looks."""

    stream: OutgoingStream
    peer: bytes
    payload: bytes


class Observer(Protocol):
    """Sees what really happens, where there is a simulation to see it in."""

    def observe(self, figures: RunFigures, now_s: float) -> None:
        """Tell `figures` the true distances and contacts."""
        ...


class RobotSide:
    """The pipeline of one robot, with one operator at a time."""

    def __init__(
        self,
        arm: Arm,
        kinematics: GripperKinematics,
        camera: ObjectSource,
        sensing: AheadSensing,
        safety: Safety,
        loop_age: LoopAge,
        velocity_limits_rad_s: FloatArray,
        motion: ToolMotionSettings,
        link: LinkEnd,
        observer: Observer | None = None,
        seed: int = 0,
    ) -> None:
        self.figures = RunFigures(seed)
        self.link = link
        self.safety = safety
        self.rejected = 0
        self.motion_received = 0
        self.stiffness_sent = 0
        self.applied_age = RunningStatistics(seed)
        self._arm = arm
        self._kinematics = kinematics
        self._camera = camera
        self._sensing = sensing
        self._loop_age = loop_age
        self._velocity_limits_rad_s = velocity_limits_rad_s
        self._motion = motion
        self._observer = observer
        self._peer: bytes | None = None
        self._heard_s = -np.inf
        self._answers: list[Outgoing] = []
        self._answered_s = -np.inf
        self._command_one_way: tuple[float, float] | None = None
        self._start_s: float | None = None
        self._echoed_s: float | None = None
        self._next_target_was_down = False
        self._switch_target = False
        self._was_armed = False
        self._was_carrying = False
        self._held: HeldObject | None = None
        self._held_s = -np.inf
        self._frame: PerceivedObjects | None = None
        self._centers_m: FloatArray = np.empty((0, 3))
        self._last: tuple[ArmState, Sensed] | None = None
        self._next_telemetry_s = -np.inf
        self._next_truth_s = -np.inf

    # Arrivals

    def receive(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """Take one control payload from `peer`; what is invalid, late or not the operator's never gets further."""
        try:
            message = decode(payload)
        except RemoteProtocolError:
            self.rejected += 1
            return
        if not isinstance(message, Hello | MotionCommand) or (isinstance(message, Hello) and message.side == "robot"):
            self.rejected += 1
            return
        if message.header.epoch != self.link.peer_epoch and not self._admits(message, now_s):
            self._answer_hello(peer, now_s)
            self.rejected += 1
            return
        began = message.header.epoch != self.link.peer_epoch
        arrival = self.link.arrived(message, now_s)
        if message.header.epoch != self.link.peer_epoch:
            self.rejected += 1  # an epoch that has ended
            return
        if began:
            self.safety.new_epoch(now_s)
            self._loop_age.reset()
            self._echoed_s = None
        # The same operator may come back over another connection.
        self._peer, self._heard_s = peer, now_s
        if isinstance(message, Hello):
            self._answer_hello(peer, now_s)
            return
        self.motion_received += 1
        if self.safety.receive(message, arrival, now_s):
            self._echoed_s = message.header.echo_sent_s
            self._switch_target |= message.next_target and not self._next_target_was_down
            self._next_target_was_down = message.next_target
            if arrival.one_way_s is not None:
                self._command_one_way = (arrival.one_way_s, now_s)

    def _admits(self, message: AnyMessage, now_s: float) -> bool:
        """Whether a message of another epoch may begin it: a Hello, once the present operator has gone silent."""
        return isinstance(message, Hello) and now_s - self._heard_s > OPERATOR_SILENT_S

    def _answer_hello(self, peer: bytes, now_s: float) -> None:
        if now_s - self._answered_s >= _HELLO_PERIOD_S:
            self._answered_s = now_s
            self._answers.append(Outgoing("haptics", peer, encode(self.link.hello(now_s))))

    # The tick

    def tick(self, now_s: float) -> list[Outgoing]:
        """One turn of the pipeline at `now_s`; what to send."""
        if self._start_s is None:
            self._start_s = now_s
        if self._echoed_s is not None:
            # In every tick, so that a link that falls silent ages, too (eq. 8).
            self._loop_age.update(now_s - self._echoed_s, now_s)
        state = self._arm.state(now_s)
        pose = self._kinematics.pose(state)
        objects = self._perceive(now_s)
        self._follow_target(objects, pose)
        self._follow_grip(objects, pose, state)
        whole = pose if self._held is None else with_held(pose, self._held)
        sensed = self._sensing.sense(
            whole,
            state.joint_velocities_rad_s,
            objects,
            self._loop_age.value(now_s),
            state.gripper_opening_m if pose.sphere_on_finger.any() else None,
            None if self._held is None else self._held.index,
            now_s,
        )
        permission = self.safety.permission(now_s)
        self._move(permission, pose, now_s)
        armed = permission.state == "armed"
        carrying = self._held is not None
        if (armed and not self._was_armed) or carrying != self._was_carrying:
            # What the gripper carries changes its shape: the support counts anew from there.
            self._sensing.stiffness_map.set_support_baseline()
        self._was_armed, self._was_carrying = armed, carrying
        self._last = (state, sensed)
        speed_m_s = float(np.linalg.norm(pose.tool_jacobian[:3] @ state.joint_velocities_rad_s))
        self._record(sensed, objects, speed_m_s, armed, now_s)
        return self._outgoing(permission, pose, objects, state, sensed, speed_m_s, now_s)

    def _perceive(self, now_s: float) -> PerceivedObjects:
        objects = self._camera.perceive(now_s)
        if objects is not self._frame:
            self._frame = objects
            self._centers_m = object_centers(objects)
        return objects

    def _follow_target(self, objects: PerceivedObjects, pose: GripperPose) -> None:
        """Make the next object the target, once for each press of the button."""
        if not self._switch_target:
            return
        self._switch_target = False
        chosen = next_target(objects, self._centers_m, pose.tool_position_m, pose.tool_rotation[:, 2])
        present = target_index(objects)
        if chosen is None or self._held is not None:
            return
        if present is not None:
            self._camera.set_role(objects.names[present], Role.OBSTACLE)
        self._camera.set_role(chosen, Role.TARGET)

    def _follow_grip(self, objects: PerceivedObjects, pose: GripperPose, state: ArmState) -> None:
        """Notice when an object is gripped or let go."""
        if state.gripper_holding:
            self._held_s = state.time_s
        if self._held is not None and state.time_s - self._held_s > _LET_GO_S:
            self._held = None
        elif self._held is None and state.gripper_holding:
            index = gripped_object(objects, pose.tool_position_m, state.gripper_opening_m)
            if index is not None:
                self._held = grip(objects, index, pose)

    def _move(self, permission: Permission, pose: GripperPose, now_s: float) -> None:
        """Pass the operator's motion on to the arm; without permission nothing is commanded, and it stops."""
        command = permission.command
        if command is None:
            still = np.zeros(self._arm.joint_count)
            self._arm.command(still, now_s)
            self._arm.command_gripper(0.0, now_s)
            return
        twist = tool_twist(command, pose.tool_rotation, self._motion)
        velocity = joint_velocities(pose.tool_jacobian, twist, self._velocity_limits_rad_s)
        self._arm.command(velocity, permission.valid_until_s)
        self._arm.command_gripper(command.gripper, permission.valid_until_s)
        if self._command_one_way is not None:
            one_way_s, received_s = self._command_one_way
            self.applied_age.add(one_way_s + now_s - received_s)

    def _record(self, sensed: Sensed, objects: PerceivedObjects, speed_m_s: float, armed: bool, now_s: float) -> None:
        self.figures.tick(sensed, speed_m_s)
        target = target_index(objects)
        held = self._held is not None and self._held.index == target
        self.figures.task(armed, held, None if target is None else self._centers_m[target], now_s)
        if self._observer is not None and now_s >= self._next_truth_s:
            self._next_truth_s = now_s + TRUTH_PERIOD_S
            self._observer.observe(self.figures, now_s)

    def _outgoing(
        self,
        permission: Permission,
        pose: GripperPose,
        objects: PerceivedObjects,
        state: ArmState,
        sensed: Sensed,
        speed_m_s: float,
        now_s: float,
    ) -> list[Outgoing]:
        outgoing, self._answers = self._answers, []
        stiffness = sensed.stiffness
        if self._peer is not None and now_s - self._heard_s <= OPERATOR_SILENT_S:
            update = StiffnessUpdate(
                self.link.stamp(now_s),
                l2=stiffness.l2,
                r2=stiffness.r2,
                rumble=stiffness.rumble,
                state=permission.state,
            )
            self.stiffness_sent += 1
            outgoing.append(Outgoing("haptics", self._peer, encode(update)))
        if now_s >= self._next_telemetry_s:
            self._next_telemetry_s = now_s + TELEMETRY_PERIOD_S
            target = target_index(objects)
            target_in_tool = None
            if target is not None and np.isfinite(self._centers_m[target]).all():
                target_in_tool = (self._centers_m[target] - pose.tool_position_m) @ pose.tool_rotation
            view = Telemetry(
                self.link.stamp(now_s),
                state=permission.state,
                tool_position_m=_vector3(pose.tool_position_m),
                tool_speed_m_s=speed_m_s,
                target=None if target is None else objects.names[target],
                target_in_tool_m=None if target_in_tool is None else _vector3(target_in_tool),
                up_in_tool=_vector3(pose.tool_rotation[2]),
                gripper_opening_m=max(0.0, state.gripper_opening_m),
                holding=self._held is not None,
                enlargement_m=float(sensed.enlargement_m.max()),
                l2=stiffness.l2,
                r2=stiffness.r2,
            )
            outgoing.append(Outgoing("telemetry", b"", encode(view)))
        return outgoing

    # What people see

    def status(self, now_s: float) -> dict[str, float | str | bool | None]:
        """A few figures for the status line."""
        loop_age_s = self._loop_age.value(now_s)
        values: dict[str, float | str | bool | None] = {
            "state": self.safety.arming.state,
            "loop_age_ms": 1e3 * loop_age_s,
        }
        if self._last is not None:
            _, sensed = self._last
            values |= {
                "L2": sensed.stiffness.l2,
                "R2": sensed.stiffness.r2,
                "enlargement_mm": 1e3 * float(sensed.enlargement_m.max()),
                "holding": "nothing" if self._held is None else self._held.name,
            }
        return values

    def summary(self) -> dict[str, Any]:
        """This side's part of the run's summary."""
        start_s = self._start_s or 0.0
        stops = [{"time_s": when_s - start_s, "reason": reason} for when_s, reason in self.safety.arming.stops]
        return self.figures.summary() | {
            "skipped": vars(self._sensing.skipped).copy(),
            "messages": {
                "stiffness_sent": self.stiffness_sent,
                "motion_received": self.motion_received,
                "rejected": self.rejected,
                "stale": self.link.stale,
            },
            "delay_ms": {"to_robot": self.link.delay.summary_ms()},
            "applied_age_ms": {"to_robot": self.applied_age.summary_ms()},
            "stops": stops,
            "errors": [],
        }


def _vector3(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return (x, y, z)
