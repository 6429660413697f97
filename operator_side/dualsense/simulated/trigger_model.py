"""Mechanics of a finger that presses a trigger: the travel at which it stops, and how fast it gets there.

Travel in this file is mechanical, 0 at rest to 1 at the stop. Every force is an assumption, as no public measurement of
the DualSense's trigger forces exists. A normal finger's force lies within the range of the effects.
"""

import math
from typing import Final

from operator_side.controller.feel import FREE_TRIGGER, MAX_STRENGTH, SENSED_TRAVEL, ZONE_COUNT, Strengths

SPRING_PRELOAD_N: Final = 0.5
"""Force at which the trigger begins to move, in newtons (assumed)"""
SPRING_RISE_N: Final = 4.0
"""Force that the spring adds from rest to the end of the travel, growing linearly (assumed)"""
STRENGTH_STEP_N: Final = 0.25
"""Force that each step of strength, 0 to 8, adds within its zone (assumed)"""
FINGER_TIME_CONSTANT_S: Final = 0.04
"""Time constant with which a finger approaches the equilibrium of forces, in seconds (assumed)"""
NORMAL_FINGER_FORCE_N: Final = 3.7
"""Force of a normal pull of a trigger (assumed).

Against the spring alone the finger stops at 80 % of the travel, reported as a full pull. Against strength 8 in all
zones it stops at 30 %, reported as 40 %: a normal pull overcomes any stiffness."""


def equilibrium_travel(
    finger_force_n: float, zone_strengths: tuple[float, ...], strength_step_n: float = STRENGTH_STEP_N
) -> float:
    """Return the travel, 0 to 1, at which a finger that presses from rest with a constant force stops.

    There the spring and the strength of the zone balance the force for the first time. Resistance jumps between zones,
    so the result may be the boundary of a stiffer zone. The result never grows with a strength, and never falls with
    the force. zone_strengths: ten, 0 to 8. ValueError for a negative or non-finite force or step.
    """
    for name, value in (("finger_force_n", finger_force_n), ("strength_step_n", strength_step_n)):
        if not (math.isfinite(value) and value >= 0.0):
            raise ValueError(f"{name} = {value}; valid: finite, 0 or more")
    if len(zone_strengths) != ZONE_COUNT or not all(0 <= k <= MAX_STRENGTH for k in zone_strengths):
        raise ValueError(f"zone_strengths = {zone_strengths}; valid: {ZONE_COUNT} strengths from 0 to {MAX_STRENGTH}")
    for zone, strength in enumerate(zone_strengths):
        balance = (finger_force_n - SPRING_PRELOAD_N - strength * strength_step_n) / SPRING_RISE_N
        if balance < (zone + 1) / ZONE_COUNT:
            return max(balance, zone / ZONE_COUNT)
    return 1.0


def zone_of(travel: float) -> int:
    """Return the zone, 0 to 9, of a mechanical travel, 0 to 1."""
    return min(int(travel * ZONE_COUNT), ZONE_COUNT - 1)


class SimulatedTrigger:
    """Trigger and the finger on it, whose travel approaches the equilibrium travel exponentially.

    Force and strengths are constant between the calls that set them. `advance` is exact: one long step and many short
    steps give the same travel, except for rounding.
    """

    def __init__(
        self, strength_step_n: float = STRENGTH_STEP_N, time_constant_s: float = FINGER_TIME_CONSTANT_S
    ) -> None:
        """strength_step_n: force that each step of strength adds; with 0, effects are stored but not felt.

        time_constant_s: the finger's, above 0.
        """
        self.strengths = FREE_TRIGGER
        """Present strengths of the zones; `set_strengths` changes them."""
        self.travel = 0.0
        """Present mechanical travel, 0 to 1."""
        self._strength_step_n = strength_step_n
        self._time_constant_s = time_constant_s
        self._finger_force_n = 0.0
        self._equilibrium = 0.0

    @property
    def sensed_travel(self) -> float:
        """Travel as the controller measures it, 0 to 1, before rounding to a byte."""
        return min(self.travel / SENSED_TRAVEL, 1.0)

    def set_finger_force(self, finger_force_n: float) -> None:
        """Press with a constant force from now on; ValueError for a negative or non-finite force."""
        self._equilibrium = equilibrium_travel(finger_force_n, self.strengths, self._strength_step_n)
        self._finger_force_n = finger_force_n

    def set_strengths(self, strengths: Strengths) -> None:
        """Resist with these strengths of the zones from now on."""
        self.strengths = strengths
        self._equilibrium = equilibrium_travel(self._finger_force_n, strengths, self._strength_step_n)

    def advance(self, step_s: float) -> None:
        """Move the trigger during `step_s`; ValueError for a negative or non-finite step."""
        if not (math.isfinite(step_s) and step_s >= 0.0):
            raise ValueError(f"step_s = {step_s}; valid: finite, 0 or more")
        remaining = math.exp(-step_s / self._time_constant_s)
        self.travel = self._equilibrium + (self.travel - self._equilibrium) * remaining
