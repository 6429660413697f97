"""Guide through the measurement of a trigger's forces with a kitchen scale."""

from collections.abc import Callable
from typing import Final

from common.errors import ConfigurationError
from operator_side.calibration.force_measurement import BACK, ForceMeasurement
from operator_side.calibration.forces import STRENGTHS, TriggerForces, forces_in_words
from operator_side.controller.feel import Feel
from operator_side.controller.port import OpenController
from operator_side.controller.state import ControllerState
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
        self,
        measurement: ForceMeasurement,
        say: Callable[[str], None],
        prepare: Callable[[str], None] = lambda _: None,
    ) -> None:
        """prepare: called once, before the first press, with the controller's address."""
        self.address: str | None = None
        """Address of the measured controller; None before it is found."""
        self._measurement, self._say, self._prepare = measurement, say, prepare
        self._line = self._told = ""
        self.note = say

    @property
    def feel(self) -> Feel:
        """Effects that the measurement needs now."""
        return self._measurement.feel

    def found(self, controller: OpenController) -> None:
        """Take the controller to be measured; ConfigurationError for one without an address, or another one."""
        if controller.address is None:
            raise ConfigurationError(f"{controller.name} does not tell its address; valid: a controller that does")
        if self.address not in (None, controller.address):
            raise ConfigurationError(f"another controller, {controller.address}; valid: the same, {self.address}")
        if self.address is None:
            self._prepare(controller.address)
            self._say(_GUIDE.format(trigger=self._measurement.trigger.upper()))
        self.address = controller.address

    def turn(self, state: ControllerState | None, typed: str | None, now_s: float) -> bool:
        """Feed the measurement, and tell what to do next; False at its end, or once nothing more can be typed."""
        del now_s
        if typed is None:
            return False
        if self.address is None:
            return True
        *lines, self._line = (self._line + typed).split("\n")
        for line in filter(str.strip, lines):
            if self._measurement.result is None and (complaint := self._measurement.enter(line)) is not None:
                self._say(complaint)
        if state is not None:
            self._measurement.feed(state)
        if self._measurement.result is not None:
            return False
        if (instruction := self._measurement.instruction) != self._told:
            self._told = instruction
            self._say(instruction)
        return True


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
