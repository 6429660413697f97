"""Tests of our own driver, which reads and writes the kernel's raw device through the real hidapi."""

import contextlib
import os
from collections.abc import Iterator
from typing import Final

import pytest

from common.errors import DeviceError, NoDeviceError
from operator_side.controller.feel import FREE_TRIGGER, Feel, Rumble, Strengths
from operator_side.controller.state import Button, ControllerState
from operator_side.dualsense.hid.device import HidDualSense, load_backend
from operator_side.dualsense.hid.finding import find_controller, sightings
from operator_side.dualsense.simulated.controller import SIMULATED_FIRMWARE
from operator_side.dualsense.simulated.trigger_model import NORMAL_FINGER_FORCE_N
from tests.helpers.machines.waiting import wait_until
from tests.helpers.messages import feedback
from tests.kernel.inside.driver import bound
from tests.kernel.inside.plugged import ADDRESS, Plugged

_NOBODY: Final = 65534
_EFFECTS: Final[tuple[tuple[Strengths, Strengths], ...]] = (
    (feedback(position=3, strength=6), FREE_TRIGGER),
    (FREE_TRIGGER, feedback(position=0, strength=8)),
    ((0, 1, 2, 3, 4, 5, 6, 7, 8, 0), (8, 0, 8, 0, 1, 0, 2, 0, 3, 4)),
    (feedback(position=9, strength=1), feedback(position=1, strength=3)),
)


@contextlib.contextmanager
def our_device(plugged: Plugged) -> Iterator[HidDualSense]:
    """Our driver, open on the virtual controller during the context."""
    hidraw = bound(plugged).hidraw()
    assert hidraw is not None
    device = HidDualSense(load_backend(), os.fsencode(hidraw))
    try:
        yield device
    finally:
        device.close()


def newest_state(device: HidDualSense) -> ControllerState | None:
    """Return the state by the newest input report; None if no report came."""
    return device.read(0.0)


def test_it_is_found_and_says_what_it_is(plugged: Plugged) -> None:
    hidraw = bound(plugged).hidraw()
    seen = sightings(load_backend())
    assert [sighting.path for sighting in seen] == [str(hidraw).encode()]
    found = find_controller(load_backend())
    try:
        assert found.address == ADDRESS
        transport = plugged.variant.transport
        assert found.name == f"{plugged.variant.model.title} on {transport.value} ({ADDRESS})"
    finally:
        found.device.close()
    with our_device(plugged) as device:
        said = device.identity
        assert (said.transport, said.firmware) == (transport, SIMULATED_FIRMWARE)


def test_hands_are_read_as_sent(plugged: Plugged) -> None:
    with our_device(plugged) as device:
        plugged.ask(lambda controller: controller.set_sticks(left=(1.0, -1.0), right=(0.5, 0.25)))
        plugged.ask(lambda controller: controller.set_buttons(frozenset({Button.L1, Button.OPTIONS, Button.LEFT})))
        plugged.ask(lambda controller: controller.set_finger_force(NORMAL_FINGER_FORCE_N, 1.5))
        expected_r2 = plugged.ask(lambda controller: controller.travel[1])

        def arrived() -> ControllerState | None:
            state = newest_state(device)
            return state if state is not None and state.l2 == 1.0 and Button.OPTIONS in state.pressed else None

        state = wait_until("the hands are seen", arrived)
        assert state.left_stick == (1.0, -1.0)
        assert max(abs(a - b) for a, b in zip(state.right_stick, (0.5, 0.25), strict=True)) < 1 / 127, "right stick"
        pressed = {Button.L1, Button.OPTIONS, Button.LEFT, Button.L2, Button.R2}
        assert state.pressed == pressed
        assert 0.2 < state.r2 < 0.5
        assert expected_r2 >= 0.0
        plugged.hands_off()


def test_it_is_told_exactly_what_is_written_and_released_at_the_end(plugged: Plugged) -> None:
    with our_device(plugged) as device:
        before = plugged.offered.counts.outputs
        for l2, r2 in _EFFECTS:
            device.write(Feel(l2=l2, r2=r2), 0.0)
            wait_until(f"{l2}, {r2}", lambda l2=l2, r2=r2: plugged.ask(lambda c: c.strengths) == (l2, r2))  # type: ignore[misc]
        device.write(Feel(rumble=Rumble(left=1.0, right=0.2)), 0.0)
        wait_until("the motors turn", lambda: plugged.ask(lambda c: c.rumble) == Rumble(left=1.0, right=0.2))
        assert plugged.ask(lambda c: c.strengths) == _EFFECTS[-1], "the rumble changed the triggers"
        # Forty more, so that Bluetooth's sequence numbers wrap; the kernel keeps 32 for a slow reader.
        for number in range(40):
            device.write(Feel(l2=feedback(number % 10, 1 + number % 8)), 0.0)
            if number % 10 == 9:
                expected = before + len(_EFFECTS) + 2 + number
                wait_until("all arrive", lambda count=expected: plugged.offered.counts.outputs == count)  # type: ignore[misc]
        assert plugged.offered.counts.refused == 0
    wait_until("closing releases the triggers", lambda: plugged.ask(lambda controller: controller.released))
    assert plugged.ask(lambda controller: controller.rumble) == Rumble(), "closing leaves the motors on"


def test_without_permission_it_says_what_to_do(plugged: Plugged) -> None:
    bound(plugged)
    os.setresuid(_NOBODY, _NOBODY, 0)
    try:
        with pytest.raises(DeviceError, match=r"no permission.*feelahead doctor"):
            find_controller(load_backend())
    finally:
        os.setresuid(0, 0, 0)


def test_an_unplugged_one_is_gone_and_found_when_it_is_back(plugged: Plugged) -> None:
    for _ in range(2):
        with our_device(plugged) as device:
            device.write(Feel(l2=feedback(2, 2)), 0.0)
            plugged.unplug()
            wait_until("reading says that it is gone", lambda device=device: _is_gone(device))  # type: ignore[misc]
            with pytest.raises(DeviceError, match="gone"):
                device.write(Feel(l2=FREE_TRIGGER), 0.0)
        assert not device.released, "it claims to have released what is gone"
        wait_until("nothing is found", _finds_nothing)
        plugged.plug_in()
        bound(plugged)
        with our_device(plugged) as device:
            assert device.identity.address == ADDRESS
            wait_until("reports come again", lambda device=device: newest_state(device))  # type: ignore[misc]


def _is_gone(device: HidDualSense) -> bool:
    try:
        device.read(0.0)
    except DeviceError as error:
        return "the controller is gone" in str(error)
    return False


def _finds_nothing() -> bool:
    try:
        find_controller(load_backend()).device.close()
    except NoDeviceError:
        return True
    except DeviceError:
        return False  # Seen while it goes.
    return False
