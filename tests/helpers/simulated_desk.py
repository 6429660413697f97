"""Simulated person with a simulated controller, who sees telemetry that the test makes up."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec

from common.protocol.messages import Header, Telemetry, Vector3
from common.status.codes import Doing
from operator_side.controller.feel import FREE_TRIGGER, SENSED_TRAVEL, Feel, Strengths
from operator_side.controller.state import Button, Stick
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import SPRING_PRELOAD_N, SPRING_RISE_N
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.person import SimulatedOperator
from operator_side.people.settings import PersonSettings
from tests.helpers.messages import telemetry

TICK_S, FRAME_S = 0.004, 0.02
CALIBRATION = TravelCalibration()
GRASP_M = 0.02
CLEAR_SIGHTED = PersonSettings(depth_error_sd_m=0.0, grasp_depth_m=GRASP_M)
"""Person who makes no error in judging distances, and so sees the target where it is"""
VIEW = telemetry(
    Header(epoch=1, sequence=1, sent_s=0.0),
    tool_position_m=(0.5, 0.0, 0.3),
    target="target",
    target_in_tool_m=(0.0, 0.0, 0.3),
    gripper_opening_m=0.08,
    enlargement_m=0.01,
)
IN_REACH: Vector3 = (0.0, 0.0, -GRASP_M)


def view(**changes: Any) -> Telemetry:
    return msgspec.structs.replace(VIEW, **changes)


def armed(target_in_tool_m: Vector3 | None = IN_REACH, **changes: Any) -> Telemetry:
    return view(state="armed", target_in_tool_m=target_in_tool_m, **changes)


@dataclass(frozen=True)
class PersonInput:
    """The simulated person's inputs after one tick: forces on the triggers in newtons, sticks and buttons."""

    now_s: float
    phase: Doing
    l2_n: float
    r2_n: float
    left: Stick
    right: Stick
    buttons: frozenset[Button]


class WatchedDualSense(SimulatedDualSense):
    """Simulated controller that keeps the newest forces, sticks and buttons."""

    def __init__(self) -> None:
        super().__init__()
        self.forces_n = (0.0, 0.0)
        self.sticks: tuple[Stick, Stick] = ((0.0, 0.0), (0.0, 0.0))
        self.buttons: frozenset[Button] = frozenset()

    def set_finger_force(self, l2_n: float, r2_n: float) -> None:
        super().set_finger_force(l2_n, r2_n)
        self.forces_n = (l2_n, r2_n)

    def set_sticks(self, left: Stick = (0.0, 0.0), right: Stick = (0.0, 0.0)) -> None:
        super().set_sticks(left, right)
        self.sticks = (left, right)

    def set_buttons(self, pressed: frozenset[Button]) -> None:
        super().set_buttons(pressed)
        self.buttons = pressed


class Desk:
    """Simulated person with a controller, before a screen that shows the telemetry of the test."""

    def __init__(self, settings: PersonSettings = CLEAR_SIGHTED, seed: int = 0, start_s: float = 0.0) -> None:
        self.device = WatchedDualSense()
        self.person = SimulatedOperator(self.device, settings, seed, CALIBRATION)
        self.start_s = start_s
        self.ticks = 0
        self.hands: list[PersonInput] = []

    @property
    def now_s(self) -> float:
        return self.start_s + self.ticks * TICK_S

    def tick(self, screen: Telemetry | None, delay_s: float = 0.0) -> PersonInput:
        self.person.tick(self.now_s, screen, delay_s)
        self.device.read(self.now_s)
        left, right = self.device.sticks
        done = PersonInput(self.now_s, self.person.phase, *self.device.forces_n, left, right, self.device.buttons)
        self.hands.append(done)
        self.ticks += 1
        return done

    def watch(self, screen: Telemetry | None, duration_s: float, delay_s: float = 0.0) -> list[PersonInput]:
        """Show the same telemetry for `duration_s`, as a stream of frames; return the person's inputs in each tick."""
        seen = []
        frames = self._frames(screen)
        for _ in range(round(duration_s / TICK_S)):
            seen.append(self.tick(next(frames), delay_s))
        return seen

    def until(self, phase: Doing, screen: Telemetry, at_most_s: float, delay_s: float = 0.0) -> float:
        """Show `screen` until the person is in `phase`; return the seconds taken. AssertionError after `at_most_s`."""
        start_s, frames = self.now_s, self._frames(screen)
        while self.person.phase != phase:
            assert self.now_s - start_s <= at_most_s, f"still in {self.person.phase} after {at_most_s} s"
            self.tick(next(frames), delay_s)
        return self.now_s - start_s

    def arm(self, screen: Telemetry | None = None) -> None:
        """Run until the person has armed the arm and begins to advance; once armed, the person sees `screen`."""
        self.until(Doing.ARMING, VIEW, 3.0)
        self.until(Doing.ADVANCING, screen or armed((0.0, 0.0, 0.3)), 1.0)

    def resist(self, r2: Strengths, l2: Strengths | None = None) -> None:
        self.tell(Feel(l2=l2 or FREE_TRIGGER, r2=r2))

    def tell(self, output: Feel) -> None:
        self.device.write(output, self.now_s)

    def _frames(self, screen: Telemetry | None) -> Iterator[Telemetry | None]:
        sequence = self.ticks
        while True:
            sequence += 1
            frame = None
            if screen is not None:
                frame = msgspec.structs.replace(screen, header=Header(epoch=1, sequence=sequence, sent_s=0.0))
            for _ in range(round(FRAME_S / TICK_S)):
                yield frame


def habitual_force_n(meant: float) -> float:
    """Return the force in newtons that holds a free trigger at the calibrated travel `meant`."""
    raw = CALIBRATION.r2.raw(meant)
    return SPRING_PRELOAD_N + SPRING_RISE_N * raw * SENSED_TRAVEL


def crossover(lag_s: float, settings: PersonSettings = CLEAR_SIGHTED) -> float:
    return min(4.5, (math.pi / 2 - settings.phase_margin_rad) / lag_s)
