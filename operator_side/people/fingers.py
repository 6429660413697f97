"""The person's hands on the controller: forces by habit, and what the fingers notice of it."""

import math
from collections import deque
from collections.abc import Set as AbstractSet
from typing import Final

import numpy as np

from common.protocol.messages import Vector2
from operator_side.controller.feel import SENSED_TRAVEL
from operator_side.controller.state import Button
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import (
    NORMAL_FINGER_FORCE_N,
    SPRING_PRELOAD_N,
    SPRING_RISE_N,
    SimulatedTrigger,
)
from operator_side.hands.button_map import Action, button_of
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.settings import PersonSettings

_SAME_CUE_S: Final = 0.5
"""A cue that comes back within this time is the same one: believed or not as before."""


class Fingers:
    """Pull and push what the person means, hold-to-run held, and tell when a trigger gives way less than it would."""

    def __init__(self, device: SimulatedDualSense, calibration: TravelCalibration, *, swap_sides: bool) -> None:
        self._device = device
        self._calibration = calibration
        self._swap_sides = swap_sides
        # How the same finger would move a trigger that nothing stiffens: known by habit.
        self._free = (SimulatedTrigger(), SimulatedTrigger())
        self._forces_n = (0.0, 0.0)
        self._now_s: float | None = None

    def let_pass(self, now_s: float) -> None:
        """Time goes on until `now_s`, with the forces as they are."""
        for trigger in self._free:
            trigger.advance(0.0 if self._now_s is None else now_s - self._now_s)
        self._now_s = now_s

    def resisted_share(self) -> float:
        """By how much of the finger's force a pulled trigger resists beyond its spring, the greater of both; 0 to 1."""
        shares = [
            SPRING_RISE_N * (free.travel - travel) / force_n
            for free, travel, force_n in zip(self._free, self._device.travel, self._forces_n, strict=True)
            if force_n > SPRING_PRELOAD_N
        ]
        return max(0.0, *shares) if shares else 0.0

    def do(self, advance: float, stick: Vector2, buttons: AbstractSet[Button] = frozenset()) -> None:
        """Pull R2 (advance > 0) or L2 as far as the person means to, 0 to 1; hold-to-run is always held.

        With the sides swapped, it is the other one of everything. They know by habit which force that takes on a free
        trigger, and push with that one, whatever the trigger does.
        """
        meant = min(1.0, abs(advance))
        trigger = int((advance > 0) != self._swap_sides)
        force_n = 0.0
        if meant > 0.0:
            calibrated = self._calibration.r2 if trigger == 1 else self._calibration.l2
            force_n = SPRING_PRELOAD_N + SPRING_RISE_N * SENSED_TRAVEL * calibrated.raw(meant)
            force_n = min(force_n, NORMAL_FINGER_FORCE_N)
        self._forces_n = (force_n if trigger == 0 else 0.0, force_n if trigger == 1 else 0.0)
        self._device.set_finger_force(*self._forces_n)
        for free, pressed_n in zip(self._free, self._forces_n, strict=True):
            free.set_finger_force(pressed_n)
        # A hand learns where a stick begins to act.
        side = "right" if self._swap_sides else "left"
        self._device.set_sticks(**{side: getattr(self._calibration, f"{side}_stick").raw(stick)})
        run = button_of(swap_sides=self._swap_sides)[Action.RUN]
        self._device.set_buttons(frozenset({run, *buttons}))


def within_unit_circle(x: float, y: float) -> Vector2:
    """The stick position nearest to (x, y)."""
    radius = max(1.0, math.hypot(x, y))
    return (x / radius, y / radius)


class Cue:
    """Something felt: acted on a reaction after it began until a reaction after it ended, if it is believed."""

    def __init__(self, settings: PersonSettings, generator: np.random.Generator) -> None:
        self._trust = settings.trust
        variance = math.log1p((settings.touch_reaction_sd_s / settings.touch_reaction_s) ** 2)
        self._log_mean, self._log_sd = math.log(settings.touch_reaction_s) - 0.5 * variance, math.sqrt(variance)
        self._generator = generator
        self._present = False
        self._ended_s = -math.inf
        self._believed = False
        self._to_come: deque[tuple[float, bool]] = deque()
        self._acted_on = False

    def acted_on(self, now_s: float, present: bool) -> bool:
        """Whether the hand acts on it at `now_s`, when it is `present` or not."""
        if present != self._present:
            self._present = present
            if not present:
                self._ended_s = now_s
            elif now_s - self._ended_s > _SAME_CUE_S:
                self._believed = bool(self._generator.random() < self._trust)
            due_s = now_s + float(self._generator.lognormal(self._log_mean, self._log_sd))
            # Nothing overtakes what was felt before.
            due_s = max(due_s, self._to_come[-1][0] if self._to_come else due_s)
            self._to_come.append((due_s, present and self._believed))
        while self._to_come and self._to_come[0][0] <= now_s:
            self._acted_on = self._to_come.popleft()[1]
        return self._acted_on
