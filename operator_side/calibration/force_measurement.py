"""Measure the forces of one trigger with a kitchen scale, strength by strength, without I/O.

    trigger released ─▶ pressed on the scale until it yields ─▶ grams typed ─▶ next strength, 0 to 8

The strength begins at zone 3 of 10. A press yields when the reported travel passes the middle, in all strengths alike,
so that the difference to strength 0 is the effect's own force at that place.
"""

import math
from statistics import median
from typing import Final, Literal

from operator_side.calibration.forces import STRENGTHS, TriggerForces
from operator_side.controller.feel import FREE_TRIGGER, ZONE_COUNT, Feel, Strengths
from operator_side.controller.state import ControllerState

TriggerName = Literal["l2", "r2"]
BACK: Final = "back"
"""Typed instead of grams to measure the strength before once more"""
YIELDS_AT: Final = 0.5
"""Reported travel at which a press counts as having yielded; the zone begins at about 0.4"""
_FIRST_ZONE: Final = 3
_RELEASED: Final = 0.1
_LEAST_G, _LARGEST_G = 1.0, 5000.0
_NEWTONS_PER_GRAM: Final = 9.80665e-3


class ForceMeasurement:
    """Measurement of one trigger, from the first press to the result."""

    def __init__(self, trigger: TriggerName) -> None:
        self.trigger: Final = trigger
        self.yielded = False
        """Whether the press with the present strength has yielded: grams may be typed."""
        self._released = False
        self._pulls_n: list[float] = []

    @property
    def strength(self) -> int:
        """Strength that is measured now, 0 to 8; 9 once all are done."""
        return len(self._pulls_n)

    @property
    def result(self) -> TriggerForces | None:
        """Forces of all strengths; None before the end."""
        return TriggerForces(tuple(self._pulls_n)) if self.strength == STRENGTHS else None

    @property
    def feel(self) -> Feel:
        """Effects of this moment: the strength on the measured trigger, none on the other."""
        strengths: Strengths = FREE_TRIGGER
        if self.strength < STRENGTHS:
            strengths = tuple(self.strength if zone >= _FIRST_ZONE else 0 for zone in range(ZONE_COUNT))
        return Feel(strengths, FREE_TRIGGER) if self.trigger == "l2" else Feel(FREE_TRIGGER, strengths)

    @property
    def instruction(self) -> str:
        """Text that tells the person what to do now."""
        name = self.trigger.upper()
        if self.yielded:
            return f"{name} yielded: type the grams that the scale showed just before, then Enter"
        effect = f"strength {self.strength} of 8" if self.strength else "without an effect"
        return f"{name} {effect}: let go, then press it slowly on the scale until it yields"

    def feed(self, state: ControllerState) -> None:
        """Take one state of the controller."""
        travel = state.l2 if self.trigger == "l2" else state.r2
        self._released |= travel < _RELEASED
        self.yielded |= self._released and travel > YIELDS_AT

    def enter(self, line: str) -> str | None:
        """Take a typed line: grams, several readings of which the median counts, or "back". Return a complaint."""
        if line.strip().lower() == BACK:
            self._pulls_n = self._pulls_n[:-1]
        elif not self.yielded:
            return f"{self.trigger.upper()} has not yielded yet: press it until it does"
        else:
            try:
                grams = [float(word.replace(",", ".")) for word in line.split()]
            except ValueError:
                grams = []
            if not grams or not all(math.isfinite(g) and _LEAST_G <= g <= _LARGEST_G for g in grams):
                return f"{line.strip()[:40]!r}; valid: grams, {_LEAST_G:.0f} to {_LARGEST_G:.0f}, or {BACK}"
            self._pulls_n.append(median(grams) * _NEWTONS_PER_GRAM)
        self.yielded = self._released = False
        return None
