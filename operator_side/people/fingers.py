"""Hands of the person on the controller: forces by habit, and what the fingers feel."""

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
"""Gap within which a returning cue is the same one, believed or not as before, in seconds."""


class Fingers:
    """Fingers that pull and push as intended, with hold-to-run held, and feel how much a trigger resists."""

    def __init__(self, device: SimulatedDualSense, calibration: TravelCalibration, *, swap_sides: bool) -> None:
        self._device = device
        self._calibration = calibration
        self._swap_sides = swap_sides
        # Triggers without stiffness under the same finger: known by habit.
        self._free = (SimulatedTrigger(), SimulatedTrigger())
        self._forces_n = (0.0, 0.0)
        self._now_s: float | None = None

    def let_pass(self, now_s: float) -> None:
        """Let time pass until `now_s`, with the present forces."""
        for trigger in self._free:
            trigger.advance(0.0 if self._now_s is None else now_s - self._now_s)
        self._now_s = now_s

    def resisted_share(self) -> float:
        """Return the share of the finger's force by which a trigger resists beyond its spring; the greater, 0 to 1."""
        shares = [
            SPRING_RISE_N * (free.travel - travel) / force_n
            for free, travel, force_n in zip(self._free, self._device.travel, self._forces_n, strict=True)
            if force_n > SPRING_PRELOAD_N
        ]
        return max(0.0, *shares) if shares else 0.0

    def do(self, advance: float, stick: Vector2, buttons: AbstractSet[Button] = frozenset()) -> None:
        """Pull R2 (advance > 0) or L2 to the intended travel, 0 to 1; hold-to-run is always held.

        Swapped sides exchange all. By habit the fingers apply the force that a free trigger would take, whatever the
        trigger does.
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
        # A hand learns a stick's dead zone.
        side = "right" if self._swap_sides else "left"
        self._device.set_sticks(**{side: getattr(self._calibration, f"{side}_stick").raw(stick)})
        run = button_of(swap_sides=self._swap_sides)[Action.RUN]
        self._device.set_buttons(frozenset({run, *buttons}))


def within_unit_circle(x: float, y: float) -> Vector2:
    """Return the stick position nearest to (x, y)."""
    radius = max(1.0, math.hypot(x, y))
    return (x / radius, y / radius)


class Cue:
    """Cue that is felt: acted on from a reaction after its begin to a reaction after its end, if believed."""

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
        """Return whether the hand acts on the cue at `now_s`; present: whether it is felt now."""
        if present != self._present:
            self._present = present
            if not present:
                self._ended_s = now_s
            elif now_s - self._ended_s > _SAME_CUE_S:
                self._believed = bool(self._generator.random() < self._trust)
            due_s = now_s + float(self._generator.lognormal(self._log_mean, self._log_sd))
            # A later cue does not overtake an earlier one.
            due_s = max(due_s, self._to_come[-1][0] if self._to_come else due_s)
            self._to_come.append((due_s, present and self._believed))
        while self._to_come and self._to_come[0][0] <= now_s:
            self._acted_on = self._to_come.popleft()[1]
        return self._acted_on
