"""Calibration of a controller's triggers and sticks, step by step on the terminal."""

from typing import Final

from rich.console import Group, RenderableType
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from feelahead.commands.controller.keeping import Keeping
from feelahead.commands.controller.loop import Screen
from operator_side.calibration.procedure import CalibrationProcedure, Step
from operator_side.calibration.store import write_calibration
from operator_side.controller.feel import RELEASED, Feel
from operator_side.controller.port import OpenController
from operator_side.controller.state import ControllerState
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.calibrating_hands import CalibratingHands

_BAR: Final = 40
_STEPS: Final = len(Step) - 1
"""Number of steps for the person, without the final `DONE`"""


class Calibrating:
    """Activity of the loop: tells each step and each complaint, and shows what the controller reports."""

    feel: Feel = RELEASED
    """No effect, with which a finger could not reach the full travel"""

    def __init__(self, keeping: Keeping, screen: Screen, simulated: SimulatedDualSense | None) -> None:
        self._procedure = CalibrationProcedure()
        self._keeping, self._screen = keeping, screen
        self._hands = None if simulated is None else CalibratingHands(simulated)
        self._told: str | None = None

    def found(self, controller: OpenController) -> None:
        """Take the controller, or take it again: the wait for the present step begins again."""
        if not self._keeping.begin(controller):
            self._procedure.resume()

    def turn(self, state: ControllerState | None, typed: str | None, now_s: float) -> bool:
        """Feed the procedure; CalibrationError once it has failed."""
        del typed
        if self._hands is not None:
            self._hands.act(self._procedure.step, now_s)
        if state is not None:
            self._procedure.feed(state, now_s)
            told = self._procedure.complaint or self._procedure.step.value
            if told != self._told and not self._screen.draws:
                self._screen.say(told)
            self._told = told
            self._screen.draw(lambda: self._drawing(state), now_s)
        return self._procedure.step is not Step.DONE

    def finish(self) -> list[str] | None:
        """Store the calibration; return a line for each trigger and each stick."""
        if (result := self._procedure.result) is None or self._keeping.address is None:
            return None
        if self._keeping.path is not None:
            write_calibration(self._keeping.path, self._keeping.address, result)
        return [*calibration_lines(result), self._keeping.stored()]

    def _drawing(self, state: ControllerState) -> RenderableType:
        """Draw the present step, and bars with the controller's present travel and sticks."""
        procedure, table = self._procedure, Table.grid(padding=(0, 2))
        for name, raw in (("L2", state.l2), ("R2", state.r2)):
            table.add_row(name, ProgressBar(total=1.0, completed=raw, width=_BAR), f"{raw:.2f}")
        for name, (x, y) in (("left stick", state.left_stick), ("right stick", state.right_stick)):
            place = round(0.5 * (x + 1.0) * (_BAR - 1))
            table.add_row(name, Text("─" * place + "●" + "─" * (_BAR - 1 - place)), f"{x:+.2f} {y:+.2f}")
        table.add_row("this step", ProgressBar(total=1.0, completed=procedure.progress, width=_BAR), "")
        number = min(list(Step).index(procedure.step) + 1, _STEPS)
        heading = Text(f"{number}/{_STEPS}  {procedure.step.value}", style="bold")
        return Group(heading, Text(procedure.complaint or " ", style="yellow"), table)


def calibration_lines(calibration: TravelCalibration) -> list[str]:
    """Describe the result in words: a line for each trigger and each stick."""
    triggers = {"L2": calibration.l2, "R2": calibration.r2}
    sticks = {"left stick": calibration.left_stick, "right stick": calibration.right_stick}
    return [
        f"{name:<12} released up to {one.dead_zone:.3f}, fully pulled from {one.saturation:.3f};"
        f" a full pull reaches {one.reachable_zones} of 10 zones"
        for name, one in triggers.items()
    ] + [
        f"{name:<12} rests at ({one.x:+.3f}, {one.y:+.3f}), dead zone {one.dead_zone:.3f}"
        for name, one in sticks.items()
    ]
