"""Core of the operator side, without I/O or clock: bytes in, bytes out, and the time `now_s` in every call.

control payloads ─▶ receive ─▶ newest stiffness ─▶ feel_now ─▶ controller
                                                  ▲ own commands under way
controller's states ─▶ read_state ─▶ newest intent ─▶ motion ─▶ control payloads
view payloads ─▶ receive_view ─▶ screen
"""

import contextlib
import math
from collections.abc import Sequence
from typing import Any

from msgspec import UNSET

from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol.codec import decode, encode
from common.protocol.link_end import Arrival, LinkEnd
from common.protocol.messages import Hello, LeaseNotice, LinkReport, StiffnessUpdate, Telemetry
from common.skipped import Part, shares
from common.status.codes import LinkState
from common.status.statuses import OperatorStatus
from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState
from operator_side.core_settings import CoreSettings
from operator_side.events import Input, Listener
from operator_side.feel.blindness import Blindness
from operator_side.feel.haptics import Haptics
from operator_side.hands.choices import Choices
from operator_side.hands.intent import OperatorIntent
from operator_side.hands.newest import NewestIntent
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.robot_link.commanding import HEARTBEAT_PERIOD_S, STOPPING, Commands, ToRobot
from operator_side.robot_link.lease_state import LeaseState
from operator_side.robot_link.marker import Marker
from operator_side.robot_link.newest import STIFFNESS_EXPIRES_S, NewestStiffness, overtakes
from operator_side.robot_link.tuner import Tuner


class OperatorSide:
    """Core of the operator side: turns stiffness messages into trigger effects, and travel into commands."""

    def __init__(
        self,
        epoch: int,
        clock_domain: str,
        settings: CoreSettings | None = None,
        listeners: Sequence[Listener] = (),
    ) -> None:
        """listeners: notified of the core's inputs and outputs."""
        self.settings = settings = settings or CoreSettings()
        link = settings.seed, settings.asymmetry_s, settings.tick_period_s
        self.link = LinkEnd("operator", epoch, clock_domain, *link)
        self.newest_stiffness = NewestStiffness(settings.seed)
        self.screen: Telemetry | None = None
        """Newest telemetry of the robot side; None before the first."""
        choices = Choices(settings.speed_scale, settings.stick_frame)
        self.hands = NewestIntent(
            settings.calibration, choices, swap_sides=settings.swap_sides, fixed_task=settings.fixed_task
        )
        self.haptics = Haptics(
            settings.rendering,
            settings.calibration,
            enabled=settings.haptics,
            swap_sides=settings.swap_sides,
            compensation=settings.compensation,
        )
        """Rendering of stiffness, and memory of the last write"""
        self.commands = Commands(self.link, settings.compensation, full_rate=settings.full_rate)
        self.tuner = Tuner()
        self.rejected = 0
        self._passes = 0
        """Number of calls of `feel_now` with a controller, or with something to write"""
        self._listeners = tuple(listeners)
        self._blindness = Blindness()
        self._standing = LeaseState()
        self.marker = Marker(self._standing, self._hear, fixed_task=settings.fixed_task)

    @property
    def lease(self) -> LeaseNotice | None:
        """Newest LeaseNotice; None before the first and once it has expired."""
        return self._standing.lease

    @property
    def intent(self) -> OperatorIntent | None:
        """Newest intent of the operator; None before the first and once the controller is lost."""
        return self.hands.intent

    @property
    def stiffness(self) -> StiffnessUpdate | None:
        """Newest stiffness message; None before the first and once it has expired."""
        return self.newest_stiffness.update

    def receive(self, payload: bytes, now_s: float) -> None:
        """Take one control payload from the robot side."""
        self._hear("received", payload, now_s)
        message = None
        with contextlib.suppress(RemoteProtocolError):
            try:
                message = decode(payload)
            except OtherVersionError as error:
                self._standing.other_version = str(error)
        if not isinstance(message, Hello | LeaseNotice | LinkReport | StiffnessUpdate):
            self.rejected += 1
            return
        self._standing.other_version = None
        if isinstance(message, LinkReport):
            # Link reports are numbered separately, so that their numbers do not show the order of stiffness messages.
            if message.header.epoch == self.link.peer_epoch:
                self._standing.note(message, now_s)
            return
        known_epoch = self.link.peer_epoch
        arrival = self.link.arrived(message, now_s)
        if self.link.peer_epoch != known_epoch:
            self._standing.forget()
            self.marker.forget()
        if isinstance(message, StiffnessUpdate):
            self._feel(message, arrival, now_s)
        elif isinstance(message, LeaseNotice) and arrival.fresh:
            self._read_notice(message, now_s)

    def _feel(self, update: StiffnessUpdate, arrival: Arrival, now_s: float) -> None:
        if not arrival.copy:
            self.newest_stiffness.note(update, arrival)
            self.haptics.keep_map(update)
        if arrival.fresh:
            self._expire(now_s)  # first, so that a field that has expired counts as lost even if a new one arrives now
            self._blindness.end()
            self.newest_stiffness.apply(update, arrival, now_s)
            self.hands.see(armed=update.state == "armed", now_s=now_s)

    def _read_notice(self, notice: LeaseNotice, now_s: float) -> None:
        if self._standing.read(notice, now_s):
            self.link.begin_epoch()
        if not self._standing.owns:
            self._blindness.end()
            self.commands.stop_button.forget()
        self.marker.read(notice, now_s)

    def receive_view(self, payload: bytes, now_s: float) -> None:
        """Take one view payload; keep it if it is the newest telemetry of the robot side's present epoch."""
        self._hear("seen", payload, now_s)
        message = None
        with contextlib.suppress(RemoteProtocolError):
            message = decode(payload)
        if not isinstance(message, Telemetry):
            self.rejected += 1
            return
        known = None if self.screen is None else self.screen.header
        if message.header.epoch == self.link.peer_epoch and overtakes(message.header, known):
            self.screen = message
            self.hands.choices.see(message, now_s)

    def read_state(self, state: ControllerState, now_s: float) -> None:
        """Take one state of the controller."""
        self._hear("state", state, now_s)
        intent = self.hands.read(state, now_s)
        self.haptics.scale(self.hands.choices.speed_scale)
        self._blindness.see_hands(released=intent.triggers_released)
        self.marker.press(intent.mark, now_s)

    def tune(self, probability: float | None, link: str | None, now_s: float) -> None:
        """Take a tuning request for another P, another emulated link, or both; None leaves a value unchanged."""
        self._hear("tuned", {"probability": probability, "link": link}, now_s)
        self.tuner.ask(probability, link, self._standing, now_s)

    def calibrate(self, calibration: TravelCalibration) -> None:
        """Use `calibration` for the newly found controller from now on."""
        if calibration != self.hands.calibration:
            self._hear("calibrated", calibration, None)
            self.hands.calibration = calibration
            self.haptics.calibrate(calibration)

    def controller_found(self, now_s: float) -> None:
        """Note that a controller was found. Its effects may be on: it is released first, then written again."""
        self._hear("found", b"", now_s)
        self.haptics.controller_found()

    def controller_lost(self, now_s: float) -> None:
        """Note that the controller was lost: drop the intent, and send no other before the arm has stopped."""
        self._hear("lost", b"", now_s)
        self.hands.lose(now_s)

    def press_stop(self, now_s: float) -> None:
        """Take an emergency stop that was pressed elsewhere than on the controller."""
        self._hear("stopped", b"", now_s)
        self.commands.stop_button.press(now_s)

    def _hear(self, what: Input, content: object, now_s: float | None) -> None:
        for one in self._listeners:
            one.on_input(what, content, now_s)

    def motion(self, now_s: float) -> list[ToRobot]:
        """Return the messages to send now: a command if one is due; Hellos if there is none or the link is down."""
        self._expire(now_s)
        self._standing.expire(now_s)
        linked = self.newest_stiffness.within(2 * HEARTBEAT_PERIOD_S, now_s)
        messages: list[ToRobot] = []
        lease, intent = self.lease, self._meant(now_s)
        if intent is None or lease is None:
            self.commands.held.forget()
            self.haptics.silent(now_s, owns=self._standing.owns)
        elif (due := self.commands.due(intent, lease.token, now_s)) is not None:
            message, command = due
            self.haptics.commanded(command)
            messages.append(message)
        if intent is None or not linked:
            messages += self.commands.hello(now_s)
        if (tune := self.tuner.due(self.lease, self.link, now_s)) is not None:
            messages.append(ToRobot(encode(tune)))
        if (mark := self.marker.due(self.link, now_s)) is not None:
            messages.append(ToRobot(encode(mark)))
        for one in self._listeners:
            one.on_motion(messages, now_s)
        return messages

    def _meant(self, now_s: float) -> OperatorIntent | None:
        """Return the intent to send; None without the lease, or with neither a controller nor a pressed stop."""
        if self.lease is None or not self._standing.owns:
            return None
        state = None if self.stiffness is None else self.stiffness.state
        intent = STOPPING if self.commands.stop_button.holds(now_s, state) else self.hands.present(now_s)
        # After a loss the arm may still be armed; sending nothing disarms it.
        if intent is None or (self.hands.lost_s is not None and not intent.emergency_stop):
            return None
        return intent.resting() if self._blindness.holds else self.hands.choices.commanded(intent, now_s)

    def _expire(self, now_s: float) -> None:
        """Forget an expired stiffness message; an operator with the lease is blind from then on."""
        if self.newest_stiffness.expired(now_s) and self._standing.owns:
            self._blindness.lose(now_s)

    def feel_now(self, now_s: float) -> Feel | None:
        """Return the effects to write to the controller now; None without a change, or while a change must wait."""
        self._expire(now_s)
        update, intent = self.stiffness, self.hands.present(now_s)
        if update is not None and update.state != "armed":
            update = None
        pulled = (0.0, 0.0) if intent is None else (intent.l2, intent.r2)
        feel = self.haptics.due(update, pulled, self._blindness, now_s)
        self._passes += intent is not None or feel is not None
        for one in self._listeners:
            one.on_output(feel, now_s)
        return feel

    def status(self, now_s: float) -> OperatorStatus:
        """Return the status, without the fields that only the process knows."""
        mean_s, screen, update, standing = self.link.delay.mean, self.screen, self.stiffness, self._standing
        intent, rendering = self.hands.present(now_s), self.haptics.rendering
        order, linked = -1 if self.settings.swap_sides else 1, self.newest_stiffness.within(STIFFNESS_EXPIRES_S, now_s)
        led = (None, None) if update is None else (update.l2.course_stiffness, update.r2.course_stiffness)
        left, right = led[::order]
        meets = (None, None) if intent is None else self.haptics.meets(intent.raw)
        left_pulled, right_pulled = ((None, None) if intent is None else (intent.l2, intent.r2))[::order]
        link = self._standing.status_fields(now_s, linked=linked, heard=self.newest_stiffness.count > 0)
        seen = screen if link["link"] is LinkState.UP else None
        centre_m = None if seen is None else seen.target_in_tool_m
        return OperatorStatus(
            **link,
            state=None if update is None else update.state,
            stopped_because=standing.stop_reason if self.newest_stiffness.stopped or standing.was_not_armed else None,
            l2_course_stiffness=left,
            r2_course_stiffness=right,
            l2_meets=meets[0],
            r2_meets=meets[1],
            l2_pulled=left_pulled,
            r2_pulled=right_pulled,
            l2_free=rendering.l2.free_travel,
            r2_free=rendering.r2.free_travel,
            haptics=self.settings.haptics,
            speed_scale=self.hands.choices.speed_scale,
            stick_frame=self.hands.choices.stick_frame,
            feel=self._blindness.sight,
            delay_ms=None if mean_s is None else 1e3 * mean_s,
            stands=None if update is None else update.stands,
            target=UNSET if seen is None else seen.target,
            target_centre_mm=None if centre_m is None else 1e3 * math.hypot(*centre_m),
            holding=None if seen is None else seen.holding,
            hindrance=None if seen is None else seen.hindrance,
            offset_s=self.link.clock_offset.offset_at(now_s),
        )

    def summary(self) -> dict[str, Any]:
        """Return the operator side's part of the run's summary."""
        return {
            "messages": {
                "stiffness_received": self.newest_stiffness.count,
                "motion_sent": self.commands.sent,
                "rejected": self.rejected,
                "stale": self.link.stale,
            },
            "skipped": shares(
                motion_messages=Part(self.commands.sent, self.commands.turns),
                writes=Part(self.haptics.writes, self._passes if self.settings.haptics else 0),
            ),
            "lease_states": self._standing.history,
            "stops_pressed_elsewhere": self.commands.stop_button.presses,
            "tuning": self.tuner.summary(),
            "episodes": self.marker.summary(),
            "zones": self.haptics.rendering.zones(),
            "rendering": self.haptics.summary() | {"blind": self._blindness.times},
            "delay_ms": {
                "to_operator": self.link.delay.summary_ms(),
                "round_trip": self.link.round_trip.summary_ms(),
            },
            "gaps": {"to_operator": self.link.gaps},
            "driving_delay_ms": {"to_operator": self.newest_stiffness.driving_delay.summary_ms()},
            "applied_age_ms": {"to_operator": self.newest_stiffness.applied_age.summary_ms()},
            "offset_ms": {"operator": self.link.offset_summary_ms()},
        }
