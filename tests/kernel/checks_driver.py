"""What the kernel's own driver makes of the virtual controller, seen as games see it."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

from operator_side.dualsense.effects.official import Off
from operator_side.dualsense.reports.controller_state import Button
from operator_side.dualsense.reports.output_report import OutputReport, Rumble, build_output_report
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from tests.helpers.felt import feedback
from tests.kernel.evdev import (
    ABS_HAT0X,
    ABS_HAT0Y,
    ABS_RX,
    ABS_RY,
    ABS_RZ,
    ABS_X,
    ABS_Y,
    ABS_Z,
    BTN_SOUTH,
    BTN_TL,
    InputDevice,
)
from tests.kernel.kernel_view import KernelView, seen_device
from tests.kernel.plugged import Plugged
from tests.kernel.waiting import require, wait_until


def bound(plugged: Plugged) -> KernelView:
    """Plug the controller in; what the kernel shows of it once its driver has finished with it."""
    plugged.plug_in()
    view = wait_until("the kernel shows the controller", lambda: seen_device(plugged.identity))
    wait_until("three input devices", lambda: len(view.inputs()) == 3)
    return view


@contextlib.contextmanager
def opened(plugged: Plugged, suffix: str = "") -> Iterator[InputDevice]:
    """One of the controller's input devices."""
    with InputDevice(bound(plugged).inputs()[plugged.identity.name + suffix]) as device:
        yield device


def binds(plugged: Plugged) -> str:
    """hid-playstation takes it, and its input devices appear."""
    view = bound(plugged)
    require(view.driver == "playstation", f"the driver is {view.driver}")
    name = plugged.identity.name
    inputs = set(view.inputs())
    require(inputs == {name, f"{name} Motion Sensors", f"{name} Touchpad"}, f"input devices: {sorted(inputs)}")
    hidraw = view.hidraw()
    require(hidraw is not None and hidraw.exists(), f"hidraw device: {hidraw}")
    counts = plugged.offered.counts
    require(counts.features >= 3, f"the driver read {counts.features} features")
    require(counts.outputs >= 1, "the driver has not set the lights")
    require(counts.refused == 0, f"{counts.refused} reports were refused")
    require(not plugged.ask(lambda controller: controller.simple_mode), "it still sends Bluetooth's simple reports")
    lights = plugged.ask(lambda controller: controller.output.lightbar)
    require(lights is not None, "the driver has not lit the lightbar")
    return f"{view.driver}, {hidraw}, {counts.features} features read, lightbar {lights}"


def sees_the_hands(plugged: Plugged) -> str:
    """The kernel sees sticks, triggers, buttons and the directional pad."""
    plugged.ask(lambda controller: controller.set_sticks(left=(1.0, 1.0), right=(-1.0, -0.5)))
    plugged.ask(lambda controller: controller.set_buttons(frozenset({Button.CROSS, Button.UP, Button.RIGHT})))
    plugged.ask(lambda controller: controller.set_finger_force(0.0, NORMAL_FINGER_FORCE_N))
    with opened(plugged) as device:
        expected = (255, 0, 0, 0, 192, 255)
        wait_until(
            f"the axes stand at {expected}",
            lambda: device.axes(ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ) == expected,
        )
        require(device.axes(ABS_HAT0X, ABS_HAT0Y) == (1, -1), "the pad does not point up and right")
        require(device.is_down(BTN_SOUTH) and not device.is_down(BTN_TL), "cross alone is not what is down")
        plugged.hands_off()
        wait_until("the axes rest", lambda: device.axes(ABS_X, ABS_Y, ABS_Z, ABS_RZ) == (128, 128, 0, 0))
        wait_until("cross is up", lambda: not device.is_down(BTN_SOUTH))
    return "six axes, the pad and cross"


def lies_flat(plugged: Plugged) -> str:
    """The kernel's calibrated motion sensors say that the controller lies flat and does not turn."""
    with opened(plugged, " Motion Sensors") as device:
        per_g = device.axis(ABS_X).resolution
        wait_until("one gravity along y", lambda: device.axes(ABS_X, ABS_Y, ABS_Z) == (0, per_g, 0))
        require(device.axes(ABS_RX, ABS_RY, ABS_RZ) == (0, 0, 0), "it turns")
    return f"{per_g} counts a gravity"


def rumble_spares_the_triggers(plugged: Plugged) -> str:
    """A rumble by the kernel's force feedback leaves the trigger effects alone."""
    effects = (feedback(position=2, strength=5), feedback(position=4, strength=8))
    write_raw(bound(plugged).hidraw(), plugged, OutputReport(l2=effects[0], r2=effects[1]))
    wait_until("the effects arrive", lambda: plugged.ask(lambda controller: controller.effects) == effects)
    with opened(plugged) as device:
        device.rumble(1.0, 0.5, 5000)
        wait_until(
            "both motors turn", lambda: plugged.ask(lambda c: c.rumble.left > 0.9 and 0.4 < c.rumble.right < 0.6)
        )
        require(plugged.ask(lambda controller: controller.effects) == effects, "the rumble changed the triggers")
    wait_until("the motors rest", lambda: plugged.ask(lambda controller: controller.rumble) == Rumble())
    require(plugged.ask(lambda controller: controller.effects) == effects, "the rumble's end changed the triggers")
    write_raw(bound(plugged).hidraw(), plugged, OutputReport(l2=Off(), r2=Off()))
    wait_until("the triggers are free", lambda: plugged.ask(lambda controller: controller.released))
    return "effects stayed through it"


def write_raw(hidraw: Path | None, plugged: Plugged, output: OutputReport) -> None:
    """Write an output report to the raw device file, as another program would."""
    require(hidraw is not None, "there is no hidraw device")
    assert hidraw is not None
    hidraw.write_bytes(build_output_report(output, plugged.variant.transport))


DRIVER_CHECKS = (binds, sees_the_hands, lies_flat, rumble_spares_the_triggers)
