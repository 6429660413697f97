"""`feelahead feel`: the ten zones in the hand with only a controller, and their forces on a kitchen scale."""

import contextlib
import dataclasses
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import tyro
from msgspec import Meta
from rich.console import Console

from common.clock import Clock, MonotonicClock, VirtualClock
from common.command.command_line import parse_settings
from common.command.stop_signal import StopSignal
from common.files.output_file import require_folder, require_output_file
from common.limits import check_limits
from feelahead.commands.feel.loop import Activity, Desk, Effects, Typed, live, typing
from feelahead.commands.feel.measuring import Measuring, result_lines
from feelahead.commands.feel.patterns import PatternName, Walk
from feelahead.commands.feel.trying import Trying
from feelahead.commands.virtual_dualsense import pulling
from operator_side.calibration.force_measurement import ForceMeasurement, TriggerName
from operator_side.calibration.forces import ControllerForces, TriggerForces, forces_path, stored_forces, write_forces
from operator_side.controller.connection import Connection
from operator_side.controller.port import OpenController, check_choice
from operator_side.controller.search import BackgroundSearch, Ready
from operator_side.controllers import dualsense_search
from operator_side.dualsense.hid.device import HidBackend
from operator_side.dualsense.hid.release_guard import ReleaseGuard
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.people.measuring_hands import MeasuringHands

_MEANWHILE: Final = "it goes on when the controller is back"


@dataclass(frozen=True)
class FeelSettings:
    """Feel the triggers' zones with a DualSense alone: free, a wall at the middle, a rising ramp, eight strengths.

    It shows the strengths that are written and the travel of both triggers. Ctrl-C ends it. The triggers are released
    however it ends.

    With --measure: measure the forces of a trigger with a kitchen scale, in ten minutes. They are stored for this
    controller beside its travel calibration.
    """

    device: Literal["hid", "simulated"] = "hid"
    """A real DualSense, or a simulated one with simulated hands in virtual time, which stores only with --out."""
    controller: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Take only the DualSense with this address, as `feelahead doctor` prints it."""
    pattern: Annotated[PatternName | None, tyro.conf.arg(metavar="{free,wall,ramp,strengths}")] = None
    """Stay in one pattern; by default all in turn. On a terminal, keys choose, too."""
    duration: Annotated[Annotated[float, Meta(gt=0.0, lt=1e6)] | None, tyro.conf.arg(metavar="SECONDS")] = None
    """End after this time from the controller's first report; by default at Ctrl-C, simulated after one round."""
    measure: bool = False
    """Measure forces with a kitchen scale instead."""
    trigger: TriggerName = "r2"
    """With --measure: the trigger to measure. The other one's forces stay as they are stored."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """With --measure: store in this file instead: a new one in an existing folder, or one of this controller's forces,
    in which the other trigger's stay."""

    def __post_init__(self) -> None:
        check_limits(self)
        check_choice(self.device, self.controller)
        require_output_file("--out", self.out)
        if self.measure and (self.pattern is not None or self.duration is not None):
            raise ValueError("--measure excludes --pattern and --duration; valid: --measure alone, or without it")
        if (self.out is not None or self.trigger != "r2") and not self.measure:
            given = "--out" if self.out is not None else f"--trigger {self.trigger}"
            raise ValueError(f"{given} without --measure; valid: both")


def feel(arguments: Sequence[str], backend: HidBackend | None = None) -> int:
    """Run the command. backend: used instead of hidapi, if given. Exit code 1 if a measurement was given up."""
    settings = parse_settings(FeelSettings, "feelahead feel", arguments)
    console = Console()
    if settings.measure:
        return _measure(settings, console, backend)
    walk = Walk(settings.pattern)
    rounds = 1 if settings.device == "simulated" and settings.duration is None else None

    def until(now_s: float, walked: Walk) -> bool:
        late = settings.duration is not None and now_s >= settings.duration
        return late or (rounds is not None and walked.rounds >= rounds)

    simulated = SimulatedDualSense() if settings.device == "simulated" else None
    clock = MonotonicClock() if simulated is None else VirtualClock()

    def hands() -> str:
        if simulated is not None:
            simulated.set_finger_force(*pulling(clock.now())[:2])
        return ""

    source = typing(keys=True) if simulated is None else contextlib.nullcontext(hands)
    with source as typed, Trying(walk, console, until=until, keys=simulated is None) as trying:
        _use(settings, trying, clock, typed, simulated, backend)
    return 0


def _measure(settings: FeelSettings, console: Console, backend: HidBackend | None) -> int:
    measurement = ForceMeasurement(settings.trigger)
    simulated = SimulatedDualSense() if settings.device == "simulated" else None
    clock = MonotonicClock() if simulated is None else VirtualClock()
    hands = None if simulated is None else MeasuringHands(simulated)

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=not console.is_terminal)

    store = _Store(settings)
    measuring = Measuring(measurement, say, store.prepare)
    scripted = None if hands is None else contextlib.nullcontext(lambda: hands.act(measurement, clock.now()))
    with scripted or typing(keys=False) as typed:
        _use(settings, measuring, clock, typed, simulated, backend)
    if (result := measurement.result) is None or measuring.address is None:
        sys.stdout.write("given up: nothing was stored\n")
        return 1
    sys.stdout.write("\n".join(result_lines(settings.trigger.upper(), result)) + "\n")
    sys.stdout.write(f"{store.keep(measuring.address, result)}\n")
    return 0


class _Store:
    """Place where measured forces are stored. Its faults show before the first press, not after the last."""

    def __init__(self, settings: FeelSettings) -> None:
        self._settings = settings
        self._path = settings.out
        self._known = ControllerForces()

    def prepare(self, address: str) -> None:
        """Load what is stored for the controller; ConfigurationError if forces cannot be stored there."""
        if self._path is None and self._settings.device != "simulated":
            self._path = forces_path(address)
            require_folder("forces", self._path)
        if self._path is not None:
            self._known = stored_forces(self._path, address)

    def keep(self, address: str, result: TriggerForces) -> str:
        """Store the result beside the other trigger's forces; return in words where."""
        if self._path is None:
            return "simulated: nothing was stored (--out FILE.toml stores it)"
        write_forces(self._path, address, dataclasses.replace(self._known, **{self._settings.trigger: result}))
        return f"stored: {self._path}"


def _use(
    settings: FeelSettings,
    activity: Activity,
    clock: Clock,
    typed: Typed,
    simulated: SimulatedDualSense | None,
    backend: HidBackend | None,
) -> None:
    """Connect to the controller, live with it, and release it however this ends."""
    with contextlib.ExitStack() as stack:
        stop = stack.enter_context(StopSignal())
        effects = Effects()
        if simulated is not None:
            guard = None
            search: BackgroundSearch = Ready(OpenController(simulated, "simulated DualSense", simulated.address))
        else:
            guard = stack.enter_context(ReleaseGuard())
            search = dualsense_search(backend, settings.controller)
        connection = Connection(search, effects, guard, _MEANWHILE)
        stack.callback(connection.close)
        live(Desk(connection, effects, guard), activity, typed, clock, stop)
