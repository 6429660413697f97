"""`feelahead calibrate`: measure the ranges of a controller's triggers and sticks, and store them."""

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from common.clock import Clock, MonotonicClock, VirtualClock
from common.command.command_line import parse_settings
from common.command.stop_signal import StopSignal
from common.errors import ConfigurationError, DeviceError
from common.files.output_file import require_folder, require_output_file
from operator_side.calibration.procedure import CalibrationProcedure, Step
from operator_side.calibration.store import calibration_path, write_calibration
from operator_side.controller.feel import RELEASED
from operator_side.controller.port import Controller, OpenController, check_choice
from operator_side.controller.state import ControllerState
from operator_side.dualsense.hid.device import load_backend
from operator_side.dualsense.hid.finding import find_controller
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel
from operator_side.people.calibrating_hands import CalibratingHands

_POLL_S = 0.002
_SHOW_S = 0.05
_SILENT_S = 5.0


@dataclass(frozen=True)
class CalibrateSettings:
    """Measure the ranges of one controller's triggers and sticks. This takes half a minute.

    The command says what to do, and shows what the controller reports. It stores the result in your configuration
    folder by the controller's address, which is the same on USB and Bluetooth. feelahead-operator finds it there.
    """

    device: Literal["hid", "simulated"] = "hid"
    """hid: a real controller. simulated: a simulated one with simulated hands; its result is stored only with --out."""
    controller: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Measure the controller with this address, as `feelahead doctor` prints it."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Store the result in this file instead of the configuration folder. The folder must exist; an existing file is
    replaced."""

    def __post_init__(self) -> None:
        check_choice(self.device, self.controller)
        require_output_file("--out", self.out)


def calibrate(arguments: Sequence[str]) -> int:
    """Run the calibration; return 1 if the person gave up, and then store nothing."""
    settings = parse_settings(CalibrateSettings, "feelahead calibrate", arguments)
    clock: Clock
    if settings.device == "simulated":
        clock, simulated = VirtualClock(), SimulatedDualSense()
        controller = OpenController(simulated, "simulated DualSense", simulated.address)
        hands: CalibratingHands | None = CalibratingHands(simulated)
        kept_at = settings.out
    else:
        clock, hands = MonotonicClock(), None
        controller = find_controller(load_backend(), settings.controller, others=False)
        kept_at = settings.out
        if kept_at is None and controller.address is not None:
            kept_at = calibration_path(controller.address)
    console = Console()
    procedure = CalibrationProcedure()
    with StopSignal() as stop:
        try:
            if controller.address is None:
                raise ConfigurationError(
                    f"{controller.name} does not report its address, under which a calibration is stored; valid: a"
                    " controller that reports its address"
                )
            if kept_at is not None:
                require_folder("calibration", kept_at)
            console.print(f"Calibrating {controller.name}", markup=False, highlight=False, soft_wrap=True)
            with _Screen(console) as show:
                done = _measure(controller.device, procedure, clock, hands, stop, show)
        finally:
            controller.device.close()
    if not done or procedure.result is None:
        sys.stdout.write("given up: nothing was stored\n")
        return 1
    sys.stdout.write("\n".join(calibration_lines(procedure.result)) + "\n")
    if kept_at is None:
        sys.stdout.write("simulated: nothing was stored (--out FILE.toml stores it)\n")
        return 0
    write_calibration(kept_at, controller.address, procedure.result)
    used = "feelahead-operator uses it from now on"
    if settings.out is not None:
        used = f"feelahead-operator uses it if it is copied to {calibration_path(controller.address)}"
    sys.stdout.write(f"stored: {kept_at}; {used}\n")
    return 0


Show = Callable[[CalibrationProcedure, ControllerState, float], None]


def _measure(
    device: Controller,
    procedure: CalibrationProcedure,
    clock: Clock,
    hands: CalibratingHands | None,
    stop: StopSignal,
    show: Show,
) -> bool:
    """Feed the controller's states to the procedure until it is done; return False if `stop` came first.

    Raises CalibrationError or DeviceError.
    """
    start_s = heard_s = clock.now()
    # With an effect still on, a finger could not reach the full travel.
    device.write(RELEASED, start_s)
    while procedure.step is not Step.DONE:
        if stop.is_set:
            return False
        now_s = clock.now()
        if hands is not None:
            hands.act(procedure.step, now_s)
        if (state := device.read(now_s)) is not None:
            heard_s = now_s
            procedure.feed(state, now_s)
            show(procedure, state, now_s)
        elif now_s - heard_s > _SILENT_S:
            raise DeviceError(
                f"the controller has sent nothing for {_SILENT_S:.0f} s: plug it in, then start the calibration again"
            )
        if isinstance(clock, VirtualClock):
            clock.advance_to(now_s + _POLL_S)
        else:
            time.sleep(_POLL_S)
    return True


class _Screen:
    """Display of the calibration: live bars on a terminal; elsewhere a line for each step and complaint."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live = Live(console=console, auto_refresh=False) if console.is_terminal else None
        self._next_s: float | None = None
        self._said: tuple[Step, str | None] | None = None

    def __enter__(self) -> Show:
        if self._live is not None:
            self._live.start()
        return self._show

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def _show(self, procedure: CalibrationProcedure, state: ControllerState, now_s: float) -> None:
        said = procedure.step, procedure.complaint
        if self._live is not None:
            if self._next_s is None or now_s >= self._next_s or said != self._said:
                self._next_s = now_s + _SHOW_S
                self._live.update(calibration_screen(procedure, state), refresh=True)
        elif said != self._said:
            sys.stdout.write(f"{procedure.complaint or procedure.step.value}\n")
            sys.stdout.flush()
        self._said = said


_BAR = 40
_STEPS = len(Step) - 1
"""Number of steps for the person, without the final `DONE`."""


def calibration_screen(procedure: CalibrationProcedure, state: ControllerState) -> RenderableType:
    """Draw the present step, and bars with the controller's present travel and sticks."""
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
    """Describe the result in words: a line for each trigger and each stick."""
    return [
        _trigger_line("L2", calibration.l2),
        _trigger_line("R2", calibration.r2),
        _stick_line("left stick", calibration.left_stick),
        _stick_line("right stick", calibration.right_stick),
    ]


def _trigger_line(name: str, trigger: TriggerTravel) -> str:
    return (
        f"{name:<12} released up to {trigger.dead_zone:.3f}, fully pulled from {trigger.saturation:.3f};"
        f" a full pull reaches {trigger.reachable_zones} of 10 zones"
    )


def _stick_line(name: str, stick: StickRest) -> str:
    return f"{name:<12} rests at ({stick.x:+.3f}, {stick.y:+.3f}), dead zone {stick.dead_zone:.3f}"


def _dot(x: float) -> Text:
    """Draw a stick's sideways deflection `x`, -1 to 1, as a dot on a line."""
    place = round(0.5 * (x + 1.0) * (_BAR - 1))
    return Text("─" * place + "●" + "─" * (_BAR - 1 - place))
