"""Fingers of the scripted person: the forces that they apply, and the resistance that they feel."""

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
"""Seconds within which a cue that returns counts as the same cue, believed or not as before"""


class Fingers:
    """Fingers that apply forces to triggers and sticks, hold hold-to-run, and feel how much a trigger resists."""

    def __init__(self, device: SimulatedDualSense, calibration: TravelCalibration, *, swap_sides: bool) -> None:
        self._device = device
        self._calibration = calibration
        self._swap_sides = swap_sides
        # Free triggers under the same force: the travel that the person expects by habit.
        self._free = (SimulatedTrigger(), SimulatedTrigger())
        self._forces_n = (0.0, 0.0)
        self._now_s: float | None = None
        self.also: AbstractSet[Button] = frozenset()
        """Buttons that are pressed besides those of `do`"""

    def let_pass(self, now_s: float) -> None:
        """Move the expected, free triggers until `now_s` under the present forces."""
        for trigger in self._free:
            trigger.advance(0.0 if self._now_s is None else now_s - self._now_s)
        self._now_s = now_s

    def resisted_share(self) -> float:
        """Return the share of the finger's force, 0 to 1, that the stiffer trigger resists beyond its spring."""
        shares = [
            SPRING_RISE_N * (free.travel - travel) / force_n
            for free, travel, force_n in zip(self._free, self._device.travel, self._forces_n, strict=True)
            if force_n > SPRING_PRELOAD_N
        ]
        return max(0.0, *shares) if shares else 0.0

    def do(self, advance: float, stick: Vector2, buttons: AbstractSet[Button] = frozenset()) -> None:
        """Press R2 (advance > 0) or L2 (advance < 0), the stick, the buttons, and hold-to-run.

        |advance| is the intended travel, 0 to 1. The force is the one that a free trigger would need for this travel,
        whatever the trigger's resistance is. With swapped sides, left and right are exchanged.
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
        # The person knows the stick's dead zone, and deflects it by as much more.
        side = "right" if self._swap_sides else "left"
        self._device.set_sticks(**{side: getattr(self._calibration, f"{side}_stick").raw(stick)})
        run = button_of(swap_sides=self._swap_sides)[Action.RUN]
        self._device.set_buttons(frozenset({run, *buttons, *self.also}))


def within_unit_circle(x: float, y: float) -> Vector2:
    """Return the point within the unit circle that is nearest to (x, y)."""
    radius = max(1.0, math.hypot(x, y))
    return (x / radius, y / radius)


class Cue:
    """Cue that the fingers feel, such as rumble.

    If the person believes it, they act on it from one reaction after its begin to one reaction after its end.
    """

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
        """Return whether the person acts on the cue at `now_s`. present: whether the cue is felt now."""
        if present != self._present:
            self._present = present
            if not present:
                self._ended_s = now_s
            elif now_s - self._ended_s > _SAME_CUE_S:
                self._believed = bool(self._generator.random() < self._trust)
            due_s = now_s + float(self._generator.lognormal(self._log_mean, self._log_sd))
            # The reaction to a later change does not come before that to an earlier one.
            due_s = max(due_s, self._to_come[-1][0] if self._to_come else due_s)
            self._to_come.append((due_s, present and self._believed))
        while self._to_come and self._to_come[0][0] <= now_s:
            self._acted_on = self._to_come.popleft()[1]
        return self._acted_on
