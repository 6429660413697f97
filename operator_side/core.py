"""The operator side without I/O: bytes in, bytes out, and `now` with every call.

control payloads ─▶ receive ─▶ newest stiffness ─▶ output_report ─▶ controller
controller reports ─▶ read_report ─▶ newest intent ─▶ motion ─▶ control payloads
view payloads ─▶ receive_view ─▶ screen
"""

from typing import Any

from common.codec import decode, encode
from common.errors import RemoteProtocolError
from common.link_end import LinkEnd
from common.messages import Hello, MotionCommand, StiffnessUpdate, Telemetry
from common.statistics import RunningStatistics
from operator_side.dualsense.effects import Off, TriggerEffect
from operator_side.dualsense.report import Rumble, build_output_report, parse_input_report
from operator_side.trigger_effect import EffectSelector
from operator_side.trigger_motion import OperatorIntent, TravelCalibration, operator_intent

STIFFNESS_EXPIRES_S = 0.2
"""Triggers are released this long after the last stiffness that was received."""
INTENT_EXPIRES_S = 0.1
"""Without a controller report for this long nothing is sent, so that the robot stops."""
_HELLO_PERIOD_S = 0.25


class OperatorSide:
    """Turns stiffness into trigger effects and travel into motion commands, towards one robot."""

    def __init__(
        self,
        epoch: int,
        clock_domain: str,
        *,
        haptics: bool = True,
        calibration: TravelCalibration | None = None,
        seed: int = 0,
    ) -> None:
        self.link = LinkEnd("operator", epoch, clock_domain, seed)
        self.screen: Telemetry | None = None
        """The newest view of the robot; None before the first."""
        self.stiffness: StiffnessUpdate | None = None
        """The newest stiffness; None before the first and once it has expired."""
        self.rejected = 0
        self.stiffness_received = 0
        self.motion_sent = 0
        self.applied_age = RunningStatistics(seed)
        self._haptics = haptics
        self._calibration = calibration or TravelCalibration()
        self._intent: OperatorIntent | None = None
        self._intent_s = 0.0
        self._stiffness_s = 0.0
        self._hello_s: float | None = None
        self._screen_order = (-1, -1)
        self._selectors = (EffectSelector(), EffectSelector())
        self._written: tuple[TriggerEffect, TriggerEffect, Rumble] = (Off(), Off(), Rumble())

    def receive(self, payload: bytes, now_s: float) -> None:
        """Take one control payload from the robot side."""
        try:
            message = decode(payload)
        except RemoteProtocolError:
            self.rejected += 1
            return
        if not isinstance(message, Hello | StiffnessUpdate):
            self.rejected += 1
            return
        arrival = self.link.arrived(message, now_s)
        if isinstance(message, StiffnessUpdate):
            self.stiffness_received += 1
            if arrival.fresh:
                self.stiffness, self._stiffness_s = message, now_s
                if arrival.one_way_s is not None:
                    self.applied_age.add(arrival.one_way_s)

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
        self._intent, self._intent_s = operator_intent(state, self._calibration), now_s

    def motion(self, now_s: float) -> list[bytes]:
        """What to send to the robot side now: a motion command, and a Hello while the robot does not answer."""
        payloads = []
        linked = self.stiffness is not None and now_s - self._stiffness_s < 2 * _HELLO_PERIOD_S
        if not linked and (self._hello_s is None or now_s - self._hello_s >= _HELLO_PERIOD_S):
            self._hello_s = now_s
            payloads.append(encode(self.link.hello(now_s)))
        intent = self._intent
        # Before the robot side has answered, it would not know whose motion this is.
        if self.link.peer_epoch is None or intent is None or now_s - self._intent_s > INTENT_EXPIRES_S:
            return payloads
        command = MotionCommand(
            self.link.stamp(now_s),
            l2=intent.l2,
            r2=intent.r2,
            lateral=intent.lateral,
            turning=intent.turning,
            gripper=float(intent.gripper),
            run=intent.run,
            arm=intent.arm,
            emergency_stop=intent.emergency_stop,
            next_target=intent.next_target,
        )
        self.motion_sent += 1
        payloads.append(encode(command))
        return payloads

    def output_report(self, now_s: float) -> bytes | None:
        """What the controller has to be told now; None while nothing changes."""
        if self.stiffness is not None and now_s - self._stiffness_s > STIFFNESS_EXPIRES_S:
            self.stiffness = None
        felt = self.stiffness if self._haptics else None
        if felt is None or felt.state != "armed":
            effects: tuple[TriggerEffect, TriggerEffect] = (Off(), Off())
            for selector in self._selectors:
                selector.select(0.0)
            rumble = Rumble()
        else:
            effects = (self._selectors[0].select(felt.l2), self._selectors[1].select(felt.r2))
            drive = round(felt.rumble * 8) / 8  # coarse steps: a motor needs no more, and each is a write
            rumble = Rumble(left=drive)
        written = (*effects, rumble)
        if written == self._written:
            return None
        l2, r2, motors = (new if new != old else None for new, old in zip(written, self._written, strict=True))
        self._written = written
        return build_output_report(l2=l2, r2=r2, rumble=motors)  # type: ignore[arg-type]

    def status(self, now_s: float) -> dict[str, float | str | None]:
        """A few figures for the status line."""
        linked = self.stiffness is not None and now_s - self._stiffness_s <= STIFFNESS_EXPIRES_S
        mean_s = self.link.delay.mean
        return {
            "link": "up" if linked else "waiting for the robot side",
            "state": None if self.stiffness is None else self.stiffness.state,
            "L2": None if self.stiffness is None else self.stiffness.l2,
            "R2": None if self.stiffness is None else self.stiffness.r2,
            "delay_ms": None if mean_s is None else 1e3 * mean_s,
        }

    def summary(self) -> dict[str, Any]:
        """This side's part of the run's summary."""
        return {
            "messages": {
                "stiffness_received": self.stiffness_received,
                "motion_sent": self.motion_sent,
                "rejected": self.rejected,
                "stale": self.link.stale,
            },
            "delay_ms": {
                "to_operator": self.link.delay.summary_ms(),
                "round_trip": self.link.round_trip.summary_ms(),
            },
            "applied_age_ms": {"to_operator": self.applied_age.summary_ms()},
            "offset_ms": {"operator": self.link.offset_summary_ms()},
        }
