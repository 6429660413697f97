"""`feelahead virtual-dualsense`: a controller that every program on this machine sees, with no hardware."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from common.clock import Clock, MonotonicClock
from common.command.command_line import parse_settings
from common.command.stop_signal import StopSignal, ignore_broken_output
from common.limits import Limited
from operator_side.controller.feel import FREE_TRIGGER
from operator_side.dualsense.effects.official import decode_effect, encode_effect
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.output_report import encoded_effects
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import INPUT_REPORT_PERIOD_S, SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from operator_side.dualsense.uhid.controller import UhidController, UhidIdentity
from operator_side.dualsense.uhid.file import UhidFile, offer

PULL_PERIOD_S = 4.0
"""Period of the hands `pulling`, in seconds: R2 goes down and up, then L2, and the left stick goes round once."""
DRIVER_PATIENCE_S = 5.0
"""Time after which a hint is shown if no driver has taken the controller, in seconds."""
_STICK_RADIUS = 0.8

Say = Callable[[str], None]


@dataclass(frozen=True)
class VirtualDualSenseSettings(Limited):
    """Offer a virtual DualSense through /dev/uhid (Linux): games, drivers and feelahead-operator see a real controller.

    The command prints what programs send to the controller. Ctrl-C unplugs the controller.
    """

    transport: Literal["usb", "bluetooth"] = "usb"
    """Transport by which the controller seems to be connected."""
    edge: bool = False
    """Offer a DualSense Edge instead of a DualSense."""
    duration: Annotated[Annotated[float, Meta(gt=0.0, lt=1e6)] | None, tyro.conf.arg(metavar="SECONDS")] = None
    """Unplug the controller after this time; unless given, at Ctrl-C."""
    hands: Literal["none", "pulling"] = "none"
    """none: nobody touches the controller. pulling: R2 and L2 are pulled in turn, and the left stick goes round."""


def virtual_dualsense(arguments: Sequence[str]) -> int:
    """Offer a controller until --duration is over, or Ctrl-C or SIGTERM comes.

    Raises ConfigurationError if /dev/uhid cannot be used.
    """
    settings = parse_settings(VirtualDualSenseSettings, "feelahead virtual-dualsense", arguments)
    try:
        with UhidFile() as file, StopSignal() as stop:
            live(settings, file, MonotonicClock(), lambda: stop.is_set, lambda line: print(line, flush=True))
    except BrokenPipeError:
        ignore_broken_output()
    return 0


def live(
    settings: VirtualDualSenseSettings, file: UhidFile, clock: Clock, stopped: Callable[[], bool], say: Say
) -> None:
    """Plug one controller in, run it until `stopped` or the duration is over, and unplug it.

    Raises DeviceError if the kernel removes the controller.
    """
    transport = Transport.USB if settings.transport == "usb" else Transport.BLUETOOTH
    controller = _Narrated(transport, Model.EDGE if settings.edge else Model.DUALSENSE, say)
    identity = UhidIdentity(transport, controller.model, controller.address)
    offered = UhidController(controller, identity)
    start_s = clock.now()
    driven, patient = False, True

    def going(now_s: float) -> bool:
        nonlocal driven, patient
        if offered.driven != driven:
            driven, patient = offered.driven, False
            say("a driver has taken it" if driven else "its driver has let it go")
        if patient and now_s > start_s + DRIVER_PATIENCE_S:
            patient = False
            say("no driver has taken it so far: sudo modprobe hid-playstation")
        if settings.hands == "pulling":
            l2_n, r2_n, stick = pulling(now_s - start_s)
            controller.set_finger_force(l2_n, r2_n)
            controller.set_sticks(left=stick)
        return not stopped() and (settings.duration is None or now_s - start_s < settings.duration)

    say(f"plugging in: {identity.name} on {transport.value}, {controller.address}")
    offer(file, offered, clock, INPUT_REPORT_PERIOD_S, going)
    counts = offered.counts
    say(f"unplugged: {counts.inputs} reports sent, {counts.outputs} taken, {counts.refused} refused")


class _Narrated(SimulatedDualSense):
    """Simulated controller that prints what each output report changes."""

    def __init__(self, transport: Transport, model: Model, say: Say) -> None:
        super().__init__(transport, model)
        self._say = say
        self._effects = dict.fromkeys(("L2", "R2"), encode_effect(FREE_TRIGGER))
        self._last_words = self._state_in_words()

    def apply_report(self, report: bytes, now_s: float) -> None:
        """Apply an output report, and print the changes."""
        super().apply_report(report, now_s)
        l2, r2 = encoded_effects(report)
        self._effects = {"L2": l2 or self._effects["L2"], "R2": r2 or self._effects["R2"]}
        words = self._state_in_words()
        for part, doing in words.items():
            if doing != self._last_words[part]:
                self._say(f"{part}: {doing}")
        self._last_words = words

    def _state_in_words(self) -> dict[str, str]:
        light = self.commanded.light
        return {name: described(encoded) for name, encoded in self._effects.items()} | {
            "rumble": f"left {self.rumble.left:.0%}, right {self.rumble.right:.0%}",
            "lightbar": "as it was" if light is None else "red {}, green {}, blue {}".format(*light),
        }


def pulling(time_s: float) -> tuple[float, float, tuple[float, float]]:
    """Return the inputs of the hands `pulling` at `time_s`: forces on L2 and R2 in N, and the left stick (x, y)."""
    turns = time_s / PULL_PERIOD_S
    pull_n = NORMAL_FINGER_FORCE_N * (1.0 - math.cos(2.0 * math.tau * turns)) / 2.0
    stick = (_STICK_RADIUS * math.cos(math.tau * turns), _STICK_RADIUS * math.sin(math.tau * turns))
    return (0.0, pull_n, stick) if turns % 1.0 < 0.5 else (pull_n, 0.0, stick)


def described(encoded: bytes) -> str:
    """Describe a trigger effect: "Off", "strengths 0 0 0 6 6 6 6 6 6 6", or its bytes if feelahead never sends it."""
    if (strengths := decode_effect(encoded)) is None:
        return f"another effect, {encoded.hex(' ')}"
    return f"strengths {' '.join(map(str, strengths))}" if any(strengths) else "Off"
