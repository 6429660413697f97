"""A finger on an adaptive trigger, as mechanics: where it comes to rest, and how fast it gets there.

Travel here is mechanical, 0 at rest to 1 at the stop. Every force is an assumption of this model, chosen so
that a steadily pressing finger feels the whole range of effects: no public measurement of the DualSense's
trigger forces exists.
"""

import math
from typing import Final

from operator_side.dualsense.effects.official import (
    MAX_STRENGTH,
    ZONE_COUNT,
    AnyEffect,
    Feedback,
    MultiPositionFeedback,
    MultiPositionVibration,
    Off,
    SlopeFeedback,
    Vibration,
    Weapon,
)
from operator_side.dualsense.reports.controller_state import SENSED_TRAVEL, TriggerFeedback

SPRING_PRELOAD_N: Final = 0.5
"""What it takes to move the trigger at all (assumed)."""
SPRING_RISE_N: Final = 4.0
"""How much more it takes at the end of the travel, growing linearly (assumed)."""
STRENGTH_STEP_N: Final = 0.25
"""The resistance that one strength of an effect adds within its zone (assumed)."""
FINGER_TIME_CONSTANT_S: Final = 0.04
"""How fast a finger gets to where its force balances (assumed)."""
NORMAL_FINGER_FORCE_N: Final = 3.7
"""A normal pull (assumed): it rests at 80 % of the travel against the bare spring, which the controller reports
as full, and at 30 %, reported as 40 %, against the strongest effect: it overcomes any stiffness."""

_TOUCHING_TRAVEL = 0.005
"""How near to a resisting zone the trigger lies against it."""


def equilibrium_travel(
    finger_force_n: float, zone_strengths: tuple[float, ...], strength_step_n: float = STRENGTH_STEP_N
) -> float:
    """Where a finger that presses from rest with a constant force comes to a stop, 0 to 1.

    It is the first travel at which spring and effect together hold the force. The effect is constant within a
    zone, so this may be the very boundary of a stiffer zone. Never grows with any strength, never falls with
    the force. `zone_strengths`: ten, 0 to 8. ValueError for a negative or non-finite force or step.
    """
    if not (math.isfinite(finger_force_n) and finger_force_n >= 0.0):
        raise ValueError(f"finger_force_n = {finger_force_n}; valid: finite, 0 or more")
    if len(zone_strengths) != ZONE_COUNT or not all(0 <= k <= MAX_STRENGTH for k in zone_strengths):
        raise ValueError(f"zone_strengths = {zone_strengths}; valid: {ZONE_COUNT} from 0 to {MAX_STRENGTH}")
    if not (math.isfinite(strength_step_n) and strength_step_n >= 0.0):
        raise ValueError(f"strength_step_n = {strength_step_n}; valid: finite, 0 or more")
    for zone, strength in enumerate(zone_strengths):
        balance = (finger_force_n - SPRING_PRELOAD_N - strength * strength_step_n) / SPRING_RISE_N
        if balance < (zone + 1) / ZONE_COUNT:
            return max(balance, zone / ZONE_COUNT)
    return 1.0


def zone_of(travel: float) -> int:
    """The zone, 0 to 9, of a mechanical travel, 0 to 1."""
    return min(int(travel * ZONE_COUNT), ZONE_COUNT - 1)


class SimulatedTrigger:
    """A trigger and the finger on it, relaxing exponentially towards the equilibrium travel.

    The finger's force and the effect are constant between the calls that set them, so that `advance` is
    exact: one long step and many short ones agree to rounding. A weapon holds until the trigger has come to its
    second zone, then it holds nothing until the trigger is back before its first one. Vibration moves nothing.
    """

    def __init__(self, strength_step_n: float = STRENGTH_STEP_N) -> None:
        """`strength_step_n`: what one strength resists; 0 for a trigger whose effects are told and not felt."""
        self._strength_step_n = strength_step_n
        self._finger_force_n = 0.0
        self._held: float | None = None
        self._effect: AnyEffect = Off()
        self._power = 1.0
        self._fired = False
        self._equilibrium = 0.0
        self._travel = 0.0

    @property
    def travel(self) -> float:
        """Mechanical travel, 0 to 1."""
        return self._travel

    @property
    def sensed_travel(self) -> float:
        """What the controller measures of it, 0 to 1, before rounding to a byte."""
        return min(self._travel / SENSED_TRAVEL, 1.0)

    @property
    def zone(self) -> int:
        """The zone the trigger is in, 0 to 9."""
        return zone_of(self._travel)

    @property
    def loaded(self) -> bool:
        """The finger presses the trigger into, or against the edge of, a zone that resists."""
        reach = zone_of(self._travel + _TOUCHING_TRAVEL)
        strengths = self._strengths()
        return self._finger_force_n > 0.0 and (strengths[self.zone] > 0 or strengths[reach] > 0)

    @property
    def effect(self) -> AnyEffect:
        """The effect in force."""
        return self._effect

    @property
    def feedback(self) -> TriggerFeedback:
        """What the trigger reports of itself; that its stop location is the present zone is assumed."""
        match self._effect:
            case Feedback() | MultiPositionFeedback() | SlopeFeedback():
                return TriggerFeedback(self.zone, int(self.loaded), active_effect=1)
            case Weapon():
                return TriggerFeedback(self.zone, 2 if self._fired else int(self.loaded), active_effect=2)
            case Vibration() | MultiPositionVibration():
                shaken = self._finger_force_n > 0.0 and self._effect.zone_amplitudes[self.zone] > 0
                return TriggerFeedback(self.zone, int(shaken), active_effect=3)
        return TriggerFeedback()

    def set_finger_force(self, finger_force_n: float) -> None:
        """Press with a constant force from now on; ValueError for a negative or non-finite one."""
        self._equilibrium = equilibrium_travel(finger_force_n, self._strengths(), self._strength_step_n)
        self._finger_force_n, self._held = finger_force_n, None

    def hold_at(self, travel: float) -> None:
        """Be at this travel from now on, whatever resists, until a force is set; ValueError outside 0 to 1."""
        if not 0.0 <= travel <= 1.0:
            raise ValueError(f"travel = {travel}; valid: 0 to 1")
        self._finger_force_n = 0.0
        self._held = self._travel = travel

    def set_effect(self, effect: AnyEffect, power: float = 1.0) -> None:
        """Act like `effect` from now on; `power`: what is left of every strength, 0 to 1 (assumed linear).

        A weapon that is set again stays as fired as it was.
        """
        if not 0.0 <= power <= 1.0:
            raise ValueError(f"power = {power}; valid: 0 to 1")
        if effect != self._effect:
            self._fired = isinstance(effect, Weapon) and self._travel >= effect.end / ZONE_COUNT
        self._effect, self._power = effect, power
        self._balance()

    def advance(self, step_s: float) -> None:
        """Let `step_s` pass; ValueError for a negative or non-finite step."""
        if not (math.isfinite(step_s) and step_s >= 0.0):
            raise ValueError(f"step_s = {step_s}; valid: finite, 0 or more")
        if self._held is None:
            remaining = math.exp(-step_s / FINGER_TIME_CONSTANT_S)
            self._travel = self._equilibrium + (self._travel - self._equilibrium) * remaining
        if isinstance(self._effect, Weapon):
            # Nothing is held beyond either end, so neither firing nor getting ready changes the way.
            zones = self._travel * ZONE_COUNT
            self._fired = zones >= self._effect.start if self._fired else zones >= self._effect.end

    def _strengths(self) -> tuple[float, ...]:
        if self._fired:
            return (0.0,) * ZONE_COUNT
        return tuple(strength * self._power for strength in self._effect.zone_strengths)

    def _balance(self) -> None:
        self._equilibrium = equilibrium_travel(self._finger_force_n, self._strengths(), self._strength_step_n)
