"""The operator side without I/O: bytes in, bytes out, and `now` with every call.

control payloads ─▶ receive ─▶ newest stiffness ─▶ output_report ─▶ controller
                                                     ▲ own commands under way
controller reports ─▶ read_report ─▶ newest intent ─▶ motion ─▶ control payloads
view payloads ─▶ receive_view ─▶ screen
"""

import math
from typing import Any

from common.command.live_view import LINK_UP
from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol.codec import decode, encode
from common.protocol.link_end import Arrival, LinkEnd
from common.protocol.messages import Compensation, Hello, LeaseNotice, LinkReport, StiffnessUpdate, Telemetry
from common.statistics import RunningStatistics
from operator_side.commanding import STOPPING, HeldCommand, StopButton, ToRobot, motion_command
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.output_report import OutputReport
from operator_side.feel.blindness import Blindness, Sight
from operator_side.feel.haptics import Haptics
from operator_side.feel.rendering import RenderingSettings
from operator_side.hands.intent import OperatorIntent, operator_intent
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.standing import Standing
from operator_side.tuner import Tuner

STIFFNESS_EXPIRES_S = 0.2
"""Triggers are released, and the hands move nothing, this long after the last stiffness that was received."""
INTENT_EXPIRES_S = 0.1
"""Without a controller report for this long nothing is sent, so that the robot stops."""
HEARTBEAT_PERIOD_S = 0.2
"""A Hello this often while nothing else is sent: it opens the session, and then shows that we are alive."""


class OperatorSide:
    """Turns stiffness into trigger effects and travel into motion commands, towards one robot."""

    def __init__(
        self,
        epoch: int,
        clock_domain: str,
        *,
        haptics: bool = True,
        calibration: TravelCalibration | None = None,
        rendering: RenderingSettings | None = None,
        compensation: Compensation = "operator",
        swap_sides: bool = False,
        seed: int = 0,
        asymmetry_s: float = 0.0,
        full_rate: bool = False,
    ) -> None:
        """`swap_sides`: left and right of the controller swapped; the last two: see LinkEnd and HeldCommand."""
        self.link = LinkEnd("operator", epoch, clock_domain, seed, asymmetry_s)
        self.screen: Telemetry | None = None
        """The newest view of the robot; None before the first."""
        self.stiffness: StiffnessUpdate | None = None
        """The newest stiffness; None before the first and once it has expired."""
        self.rejected = self.stiffness_received = self.motion_sent = 0
        self.other_version: str | None = None
        """What the robot side's messages said when they were of another version; None once they are not."""
        self.driving_delay = RunningStatistics(seed)
        """One-way delay in seconds of what an armed robot side sent: a link's first moments are not in it."""
        self.applied_age = RunningStatistics(seed)
        self._haptics_enabled = haptics
        self._calibration = calibration or TravelCalibration()
        self._compensation: Compensation = compensation
        self._swap_sides = swap_sides
        self.haptics = Haptics(
            rendering or RenderingSettings(),
            self._calibration,
            enabled=haptics,
            swap_sides=swap_sides,
            compensation=compensation,
        )
        """What the fingers are told, and why."""
        self.stop_button = StopButton()
        self.held_command = HeldCommand(full_rate=full_rate)
        self.tuner = Tuner()
        self._blindness = Blindness()
        self._standing = Standing()
        self._intent: OperatorIntent | None = None
        self._intent_s = self.stiffness_s = 0.0
        self._hello_s = -math.inf
        self._screen_order = (-1, -1)
        self._lost_s: float | None = None
        self._has_been_armed = False

    @property
    def lease(self) -> LeaseNotice | None:
        """Where we stand with the robot side; None before the first notice and once it has expired."""
        return self._standing.lease

    @property
    def intent(self) -> OperatorIntent | None:
        """What the hands meant by the newest report of the controller; None before the first."""
        return self._intent

    def receive(self, payload: bytes, now_s: float) -> None:
        """Take one control payload from the robot side."""
        try:
            message = decode(payload)
        except RemoteProtocolError as error:
            self.rejected += 1
            if isinstance(error, OtherVersionError):
                self.other_version = str(error)
            return
        if not isinstance(message, Hello | LeaseNotice | LinkReport | StiffnessUpdate):
            self.rejected += 1
            return
        self.other_version = None
        if isinstance(message, LinkReport):
            # In a sequence of its own, which must not be taken for the order of what is felt.
            if message.header.epoch == self.link.peer_epoch:
                self._standing.note(message, now_s)
            return
        known_epoch = self.link.peer_epoch
        arrival = self.link.arrived(message, now_s)
        if self.link.peer_epoch != known_epoch:
            self._standing.forget()
        if isinstance(message, StiffnessUpdate):
            self._feel(message, arrival, now_s)
        elif isinstance(message, LeaseNotice) and arrival.fresh:
            self._follow(message, now_s)

    def _feel(self, felt: StiffnessUpdate, arrival: Arrival, now_s: float) -> None:
        armed, one_way_s = felt.state == "armed", arrival.one_way_s
        if not arrival.copy:
            self.stiffness_received += 1
            self.haptics.take_map(felt)
            if armed and one_way_s is not None:
                self.driving_delay.add(one_way_s)
        if arrival.fresh:
            self._look(now_s)  # before it counts: a field that was lost meanwhile is back, and not unbroken
            self._blindness.end()
            self.stiffness, self.stiffness_s = felt, now_s
            self._has_been_armed |= armed
            if not armed and self._lost_s is not None and now_s > self._lost_s:
                self._lost_s = None
            if one_way_s is not None:
                self.applied_age.add(one_way_s)

    def _follow(self, notice: LeaseNotice, now_s: float) -> None:
        if self._standing.follow(notice, now_s):
            self.link.begin_anew()
        if not self._standing.owns:
            self._blindness.end()
            self.stop_button.forget()

    def receive_view(self, payload: bytes, now_s: float) -> None:
        """Take one view payload; only the newest of the robot's present epoch is kept."""
        del now_s
        try:
            message = decode(payload)
        except RemoteProtocolError:
            self.rejected += 1
            return
        if not isinstance(message, Telemetry):
            self.rejected += 1
            return
        if message.header.epoch != self.link.peer_epoch:
            return
        order = (message.header.epoch, message.header.sequence)
        if order[0] != self._screen_order[0] or order[1] > self._screen_order[1]:
            self.screen, self._screen_order = message, order

    def read_report(self, report: bytes, now_s: float) -> None:
        """Take one input report of the controller; one that is malformed is counted and passed over."""
        try:
            state = parse_input_report(report)
        except RemoteProtocolError:
            self.rejected += 1
            return
        self._intent = operator_intent(state, self._calibration, swap_sides=self._swap_sides)
        self._intent_s = now_s
        self._blindness.see_hands(released=self._intent.triggers_released)

    def tune(self, probability: float | None, link: str | None, now_s: float) -> None:
        """The person wants another P, another emulated link, or both; None leaves it."""
        self.tuner.ask(probability, link, self._standing, now_s)

    def calibrate(self, calibration: TravelCalibration) -> None:
        """Read the triggers and sticks of the controller that has just been found through `calibration`."""
        if calibration != self._calibration:
            self._calibration = calibration
            self.haptics.calibrate(calibration)

    def controller_found(self, now_s: float) -> None:
        """A controller came, perhaps with what was written to it before: it is released first, then told anew."""
        del now_s
        self.haptics.controller_found()

    def controller_lost(self, now_s: float) -> None:
        """The controller went: what the hands did last counts no more, and not again before the arm has stopped."""
        self._intent, self._lost_s = None, now_s

    def motion(self, now_s: float) -> list[ToRobot]:
        """What to send to the robot side now: the owner's motion command, else a Hello every so often."""
        self._look(now_s)
        self._standing.expire(now_s)
        linked = self.stiffness is not None and now_s - self.stiffness_s < 2 * HEARTBEAT_PERIOD_S
        messages = []
        lease = self.lease
        intent = self._meant(now_s)
        if intent is None or lease is None:
            self.held_command.forget()
            self.haptics.silent(now_s, owns=self._standing.owns)
        elif (leaving := self.held_command.due(intent, lease.token, now_s)) is not None:
            command = motion_command(self.link.stamp(now_s), intent, lease.token, self._compensation)
            self.haptics.commanded(command)
            self.motion_sent += 1
            messages.append(leaving._replace(payload=encode(command)))
        if (intent is None or not linked) and now_s - self._hello_s >= HEARTBEAT_PERIOD_S:
            self._hello_s = now_s
            messages.append(ToRobot(encode(self.link.hello(now_s)), everywhere=True))
        if (tune := self.tuner.due(self.lease, self.link, now_s)) is not None:
            messages.append(ToRobot(encode(tune)))
        return messages

    def _meant(self, now_s: float) -> OperatorIntent | None:
        """What the hands do; None while there is no lease to send it under, or neither controller nor stop."""
        if self.lease is None or not self._standing.owns:
            return None
        state = None if self.stiffness is None else self.stiffness.state
        intent = STOPPING if self.stop_button.holds(now_s, state) else self._present_intent(now_s)
        # The arm may still be armed from before the controller was lost: then silence disarms it.
        if intent is None or (self._lost_s is not None and not intent.emergency_stop):
            return None
        return intent.resting() if self._blindness.holds else intent

    def _present_intent(self, now_s: float) -> OperatorIntent | None:
        return None if now_s - self._intent_s > INTENT_EXPIRES_S else self._intent

    def _look(self, now_s: float) -> None:
        """Once the stiffness has expired there is none, and who drives is blind."""
        if self.stiffness is not None and now_s - self.stiffness_s > STIFFNESS_EXPIRES_S:
            self.stiffness = None
            if self._standing.owns:
                self._blindness.lose(now_s)

    def output_report(self, now_s: float) -> OutputReport | None:
        """What the controller has to be told now; None while nothing changes, or while a change has to wait."""
        self._look(now_s)
        felt, intent = self.stiffness, self._present_intent(now_s)
        if felt is not None and felt.state != "armed":
            felt = None
        pulled = (0.0, 0.0) if intent is None else (intent.l2, intent.r2)
        return self.haptics.output_report(felt, pulled, self._blindness, now_s)

    def status(self, now_s: float) -> dict[str, float | str | bool | None]:
        """What a person is shown; L2 and R2 are the controller's own, whatever the sides mean."""
        mean_s, lease, screen = self.link.delay.mean, self.lease, self.screen
        felt = (None, None) if self.stiffness is None else (self.stiffness.l2.stiffness, self.stiffness.r2.stiffness)
        intent, sight = self._present_intent(now_s), self._blindness.sight
        pulled = (None, None) if intent is None else (intent.l2, intent.r2)
        order = -1 if self._swap_sides else 1
        (left, right), (left_pulled, right_pulled) = felt[::order], pulled[::order]
        state, stands = (None, None) if self.stiffness is None else (self.stiffness.state, self.stiffness.stands)
        values: dict[str, float | str | bool | None] = {
            "link": self._link_status(now_s),
            "state": state,
            "stopped_because": lease.why if lease is not None and self._has_been_armed and state != "armed" else None,
            "owner": None if lease is None else str(lease.session),
            "L2": left,
            "R2": right,
            "L2_pulled": left_pulled,
            "R2_pulled": right_pulled,
            "haptics": self._haptics_enabled,
            "feel": self.haptics.status() if sight is Sight.SEEING else sight,
            "release_first": sight is Sight.WAITING,
            "delay_ms": None if mean_s is None else 1e3 * mean_s,
        }
        values |= self._standing.link_values(now_s) | {"stands": stands}
        if screen is not None and values["link"] == LINK_UP:
            centre_m = screen.target_in_tool_m
            values |= {
                "target": screen.target,
                "target_centre_mm": None if centre_m is None else 1e3 * math.hypot(*centre_m),
                "holding": "something" if screen.holding else "nothing",
            }
        return values

    def _link_status(self, now_s: float) -> str:
        linked = self.stiffness is not None and now_s - self.stiffness_s <= STIFFNESS_EXPIRES_S
        return self._standing.link_status(self.other_version, linked=linked, heard=self.stiffness_received > 0)

    def summary(self) -> dict[str, Any]:
        """This side's part of the run's summary."""
        return {
            "messages": {
                "stiffness_received": self.stiffness_received,
                "motion_sent": self.motion_sent,
                "rejected": self.rejected,
                "stale": self.link.stale,
            },
            "lease_states": self._standing.history,
            "stops_pressed_elsewhere": self.stop_button.presses,
            "tuning": self.tuner.summary(),
            "zones": self.haptics.rendering.zones(),
            "rendering": self.haptics.summary() | {"blind": self._blindness.times},
            "delay_ms": {
                "to_operator": self.link.delay.summary_ms(),
                "round_trip": self.link.round_trip.summary_ms(),
            },
            "gaps": {"to_operator": self.link.gaps},
            "driving_delay_ms": {"to_operator": self.driving_delay.summary_ms()},
            "applied_age_ms": {"to_operator": self.applied_age.summary_ms()},
            "offset_ms": {"operator": self.link.offset_summary_ms()},
        }
