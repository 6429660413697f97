"""The screen while a controller is calibrated."""

from rich.console import Group, RenderableType
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from operator_side.calibration.procedure import CalibrationProcedure, Step
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel

_BAR = 40
_STEPS = len(Step) - 1
"""The steps that a person has to do."""


def calibration_screen(procedure: CalibrationProcedure, state: ControllerState) -> RenderableType:
    """Draw the present step, and live bars of the controller's report."""
    number = list(Step).index(procedure.step) + 1
    table = Table.grid(padding=(0, 2))
    for name, raw in (("L2", state.l2), ("R2", state.r2)):
        table.add_row(name, ProgressBar(total=1.0, completed=raw, width=_BAR), f"{raw:.2f}")
    for name, (x, y) in (("left stick", state.left_stick), ("right stick", state.right_stick)):
        table.add_row(name, _dot(x), f"{x:+.2f} {y:+.2f}")
    table.add_row("this step", ProgressBar(total=1.0, completed=procedure.progress, width=_BAR), "")
    heading = Text(f"{min(number, _STEPS)}/{_STEPS}  {procedure.step.value}", style="bold")
    complaint = Text(procedure.complaint or " ", style="yellow")
    return Group(heading, complaint, table)


def calibration_lines(calibration: TravelCalibration) -> list[str]:
    """The result for people, a line each."""
    return [
        _trigger_line("L2", calibration.l2),
        _trigger_line("R2", calibration.r2),
        _stick_line("left stick", calibration.left_stick),
        _stick_line("right stick", calibration.right_stick),
    ]


def _trigger_line(name: str, trigger: TriggerTravel) -> str:
    return (
        f"{name:<12} released to {trigger.dead_zone:.3f}, full from {trigger.saturation:.3f}; a full pull reaches"
        f" {trigger.reachable_zones} of 10 zones"
    )


def _stick_line(name: str, stick: StickRest) -> str:
    return f"{name:<12} rests at ({stick.x:+.3f}, {stick.y:+.3f}), dead zone {stick.dead_zone:.3f}"


def _dot(x: float) -> Text:
    """A stick's sideways deflection, -1 to 1, as a mark on a line."""
    place = round(0.5 * (x + 1.0) * (_BAR - 1))
    return Text("─" * place + "●" + "─" * (_BAR - 1 - place))
