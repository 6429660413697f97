"""Tests of our evdev driver on gamepads of other layouts, and on the kernel's own queue when it overflows."""

import random

import pytest

from common.errors import DeviceError, NoDeviceError
from operator_side.evdev.pad import BUTTONS, find_pad
from tests.kernel.inside.uinput_pad import ABS, KEY, UinputPad

_KEYS = range(0x130, 0x13F)
_STICKS = dict.fromkeys((0, 1, 2, 5), (0, 65535))
_PEDALS = dict.fromkeys((9, 10), (0, 1023))
_HATS = dict.fromkeys((16, 17), (-1, 1))
_L1, _EAST = 0x136, 0x131


def test_whatever_the_queue_drops_each_read_gives_what_the_kernel_knows() -> None:
    generator = random.Random(3)  # noqa: S311  # repeatable, not secret
    with UinputPad("Xbox by Bluetooth", _KEYS, _STICKS | _PEDALS | _HATS) as theirs:
        pad = find_pad(None)
        assert pad.name.startswith("Xbox by Bluetooth at /dev/input/event")
        state = pad.device.read(0.0)
        assert state is not None
        assert (state.left_stick, state.right_stick, state.l2, state.r2) == ((0.0, 0.0), (0.0, 0.0), 0.0, 0.0)
        values, down = {2: 32768, 9: 0}, set[int]()
        for burst in (1, 10, 100, 1000) * 10:
            for _ in range(generator.randrange(1, burst + 1)):
                values = {2: generator.randrange(1, 65536), 9: generator.randrange(1, 1024)}
                down = set(generator.sample((_L1, _EAST), generator.randrange(3)))
                keys = [(KEY, key, int(key in down)) for key in (_L1, _EAST)]
                theirs.send(*((ABS, code, value) for code, value in values.items()), *keys)
            state = pad.device.read(0.0)
            assert state is not None
            assert state.pressed == {BUTTONS[key] for key in down}
            assert state.r2 == values[9] / 1023
            assert state.right_stick[0] == pytest.approx(values[2] / 32767.5 - 1.0, abs=1e-4)
        theirs.send((ABS, 16, -1), (KEY, _L1, 0), (KEY, _EAST, 0))
    with pytest.raises(DeviceError, match="gamepad is gone"):
        pad.device.read(0.0)
    pad.device.close()


def test_what_is_refused_is_named_with_its_axes() -> None:
    axes = dict.fromkeys((0, 1, 3, 4), (-32767, 32767)) | _HATS
    with UinputPad("Switch Pro", _KEYS, axes), pytest.raises(NoDeviceError) as caught:
        find_pad(None)
    text = str(caught.value)
    assert "; Switch Pro at /dev/input/event" in text
    assert "no triggers with a travel, only buttons" in text
    assert "its axes: ABS_X, ABS_Y, ABS_RX, ABS_RY, ABS_HAT0X, ABS_HAT0Y" in text
