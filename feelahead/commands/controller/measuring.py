"""Guide through the measurement of a trigger's forces with a kitchen scale."""

import dataclasses
from typing import Final

from feelahead.commands.controller.keeping import Keeping
from feelahead.commands.controller.loop import Screen
from operator_side.calibration.force_measurement import BACK, ForceMeasurement
from operator_side.calibration.forces import (
    STRENGTHS,
    ControllerForces,
    TriggerForces,
    forces_in_words,
    stored_forces,
    write_forces,
)
from operator_side.controller.feel import Feel
from operator_side.controller.port import OpenController
from operator_side.controller.state import ControllerState
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.people.measuring_hands import MeasuringHands
from operator_side.people.settings import PersonSettings

_GUIDE: Final = (
    "Put the scale on a table and set it to zero. Hold the controller so that only {trigger} touches the scale, where"
    " your finger lies, and press down more slowly than the scale counts, until it yields. Nine presses: without an"
    f" effect, then strengths 1 to 8. Several readings on a line count by their median; {BACK!r} repeats the press"
    " before; Ctrl-C gives up."
)


class Measuring:
    """Activity of the loop: tells what to do, and takes typed grams, until all strengths are measured."""

    def __init__(
        self, measurement: ForceMeasurement, keeping: Keeping, screen: Screen, simulated: SimulatedDualSense | None
    ) -> None:
        self._measurement, self._keeping, self._screen = measurement, keeping, screen
        self._hands = None if simulated is None else MeasuringHands(simulated)
        self._known = ControllerForces()
        self._line = self._told = ""

    @property
    def feel(self) -> Feel:
        """Effects that the measurement needs now."""
        return self._measurement.feel

    def found(self, controller: OpenController) -> None:
        """Take the controller, and load what is stored for it."""
        if self._keeping.begin(controller):
            if self._keeping.path is not None and controller.address is not None:
                self._known = stored_forces(self._keeping.path, controller.address)
            self._screen.say(_GUIDE.format(trigger=self._measurement.trigger.upper()))

    def turn(self, state: ControllerState | None, typed: str | None, now_s: float) -> bool:
        """Feed the measurement, and tell what to do next; False at its end, or once nothing more can be typed."""
        measurement = self._measurement
        if state is not None:
            measurement.feed(state)
        if self._hands is not None:
            typed = self._hands.act(measurement, now_s)
        if typed is None or self._keeping.address is None:
            return typed is not None
        *lines, self._line = (self._line + typed).split("\n")
        for line in filter(str.strip, lines):
            if measurement.result is None and (complaint := measurement.enter(line)) is not None:
                self._screen.say(complaint)
        if measurement.result is None and measurement.instruction != self._told:
            self._told = measurement.instruction
            self._screen.say(self._told)
        return measurement.result is None

    def finish(self) -> list[str] | None:
        """Store the forces beside the other trigger's; return what they say."""
        if (result := self._measurement.result) is None or self._keeping.address is None:
            return None
        trigger = self._measurement.trigger
        if self._keeping.path is not None:
            forces = dataclasses.replace(self._known, **{trigger: result})
            write_forces(self._keeping.path, self._keeping.address, forces)
        return [*result_lines(trigger.upper(), result), self._keeping.stored()]


def result_lines(name: str, forces: TriggerForces) -> list[str]:
    """Return what the forces of the trigger `name` say, for people, and what they do not say."""
    assumed = PersonSettings()
    least, strongest_n = forces.least_noticed(assumed.noticeable_force), forces.added_n(STRENGTHS - 1)
    lines = [forces_in_words(name, forces)]
    if least is None:
        lines.append(
            "no strength was stronger than the spring alone by what a finger notices: was the scale read right?"
        )
        return lines
    return [
        *lines,
        f"noticed from strength {least} on, by a finger that notices {assumed.noticeable_force:.0%} (assumed)",
        f"at the middle of the travel strength 8 stops a finger of less than {forces.pulls_n[-1]:.1f} N; the tables of"
        " docs/measurements.md assume that it adds 2.0 N, and fingers of 2 and 3 N",
        f"tables for your controller: feelahead try approach --strongest-effect {strongest_n:.1f}",
        "this does not measure your reaction, how soon the effect comes, or other places of the travel",
    ]
