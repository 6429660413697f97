"""`feelahead controller`: feel the zones with a controller alone, calibrate its travel, or measure its forces."""

import contextlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from msgspec import Meta
from rich.console import Console

from common.clock import MonotonicClock, VirtualClock
from common.command.command_line import parse_settings
from common.command.stop_signal import StopSignal
from common.files.output_file import require_output_file
from common.limits import check_limits
from feelahead.commands.controller.calibrating import Calibrating
from feelahead.commands.controller.keeping import Keeping
from feelahead.commands.controller.loop import Activity, Desk, Screen, typing
from feelahead.commands.controller.measuring import Measuring
from feelahead.commands.controller.patterns import PatternName, Walk
from feelahead.commands.controller.trying import Trying
from operator_side.calibration.force_measurement import ForceMeasurement, TriggerName
from operator_side.calibration.forces import forces_path
from operator_side.calibration.store import calibration_path
from operator_side.controller.port import OpenController, check_choice
from operator_side.controller.search import Ready
from operator_side.controllers import dualsense_search
from operator_side.dualsense.hid.device import HidBackend
from operator_side.dualsense.hid.release_guard import ReleaseGuard
from operator_side.dualsense.simulated.controller import SimulatedDualSense


@dataclass(frozen=True)
class ControllerSettings:
    """Feel the triggers' zones with a DualSense alone: free, a wall at the middle, a rising ramp, eight strengths.

    It shows the strengths that are written and the travel of both triggers. Ctrl-C ends it. The triggers are released
    however it ends.

    With --calibrate: measure where the triggers and sticks begin and end, in half a minute. With --measure-forces:
    measure the forces of a trigger with a kitchen scale, in ten minutes. Both are stored in your configuration folder
    by the controller's address, which is the same on USB and Bluetooth. feelahead-operator finds them there.
    """

    calibrate: bool = False
    """Measure where the triggers and sticks begin and end."""
    measure_forces: bool = False
    """Measure the forces of a trigger with a kitchen scale."""
    device: Literal["hid", "simulated"] = "hid"
    """A real DualSense, or a simulated one with simulated hands in virtual time, which stores only with --out."""
    controller: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Take only the DualSense with this address, as `feelahead doctor` prints it."""
    pattern: Annotated[PatternName | None, tyro.conf.arg(metavar="{free,wall,ramp,strengths}")] = None
    """Stay in one pattern; by default all in turn. On a terminal, keys choose, too."""
    duration: Annotated[Annotated[float, Meta(gt=0.0, lt=1e6)] | None, tyro.conf.arg(metavar="SECONDS")] = None
    """End after this time from the controller's first report; by default at Ctrl-C, simulated after one round."""
    trigger: TriggerName = "r2"
    """With --measure-forces: the trigger to measure. The other one's forces stay as they are stored."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Store a measurement in this file instead. A calibration replaces it. Forces need a new file, or one of this
    controller's forces, in which the other trigger's stay."""

    def __post_init__(self) -> None:
        check_limits(self)
        check_choice(self.device, self.controller)
        require_output_file("--out", self.out)
        measured = [name for name in ("calibrate", "measure_forces") if getattr(self, name)]
        if len(measured) == 2:
            raise ValueError("--calibrate and --measure-forces exclude each other; valid: one after the other")
        if measured and (self.pattern is not None or self.duration is not None):
            flag = "--" + measured[0].replace("_", "-")
            raise ValueError(f"{flag} excludes --pattern and --duration; valid: {flag} alone, or without it")
        if self.trigger != "r2" and not self.measure_forces:
            raise ValueError(f"--trigger {self.trigger} without --measure-forces; valid: both")
        if self.out is not None and not measured:
            raise ValueError("--out without --calibrate or --measure-forces; valid: with one of them")


def controller(arguments: Sequence[str], backend: HidBackend | None = None) -> int:
    """Run the command. backend: used instead of hidapi, if given. Exit code 1 if a measurement was given up."""
    settings = parse_settings(ControllerSettings, "feelahead controller", arguments)
    simulated = SimulatedDualSense() if settings.device == "simulated" else None
    screen = Screen(Console())
    activity = _activity(settings, screen, simulated)
    with contextlib.ExitStack() as stack:
        stack.callback(screen.close)
        stop = stack.enter_context(StopSignal())
        if simulated is not None:
            found = OpenController(simulated, "simulated DualSense", simulated.address)
            Desk(Ready(found), None, screen).live(activity, lambda: "", VirtualClock(), stop)
        else:
            typed = stack.enter_context(typing(keys=not settings.measure_forces))
            guard = stack.enter_context(ReleaseGuard())
            search = dualsense_search(backend, settings.controller)
            Desk(search, guard, screen).live(activity, typed, MonotonicClock(), stop)
    result = activity.finish()
    sys.stdout.write("".join(f"{line}\n" for line in result or ["given up: nothing was stored"] * (result is None)))
    return int(result is None)


def _activity(settings: ControllerSettings, screen: Screen, simulated: SimulatedDualSense | None) -> Activity:
    place = settings.out, simulated is not None
    if settings.calibrate:
        return Calibrating(Keeping("calibration", calibration_path, *place), screen, simulated)
    if settings.measure_forces:
        keeping = Keeping("forces", forces_path, *place)
        return Measuring(ForceMeasurement(settings.trigger), keeping, screen, simulated)
    return Trying(Walk(settings.pattern), screen, simulated, settings.duration)
