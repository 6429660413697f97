"""Gamepads by what the kernel says of their axes, as its drivers and `evtest` show them: taken, or refused by name."""

import contextlib
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import pytest

from common.errors import NoDeviceError
from feelahead.commands.doctor.controllers import gamepads_seen
from feelahead.commands.doctor.finding import Verdict
from operator_side.controller.state import Button
from operator_side.evdev import pad as pad_module
from operator_side.evdev.pad import EvdevPad
from tests.operator_side.evdev.fake_node import ABS, AXES, HATS, KEY, FakeNode, state_of

Span = tuple[int, ...]
Axes = Mapping[int, Span]
NUMBERED = tuple(range(0x130, 0x13F))  # By HID, with BTN_C and BTN_Z.
NAMED = tuple(code for code in NUMBERED if code not in (0x132, 0x135))  # By a kernel driver.
SIGNED, BYTE, TRIGGER, PEDAL, WIDE = (-32768, 32767, 0), (0, 255, 128), (0, 255, 0), (0, 1023, 0), (0, 65535, 32768)
OLD, HID, SPECIFIED = (2, 5), (10, 9), (21, 20)


def axes(sticks: Iterable[int], stick: Span, triggers: Iterable[int], trigger: Span, more: Axes = HATS) -> Axes:
    return {**dict.fromkeys(sticks, stick), **dict.fromkeys(triggers, trigger), **more}


PADS: dict[str, tuple[Iterable[int], Axes, tuple[int, int], tuple[int, int]]] = {
    "DualSense, DualShock 4 (hid-playstation)": (NAMED, AXES, (3, 4), OLD),
    "Xbox 360 (xpad)": (NAMED, axes((0, 1, 3, 4), (*SIGNED, 128), OLD, TRIGGER), (3, 4), OLD),
    "Xbox One by Bluetooth (xpadneo)": (
        NAMED,
        axes((0, 1, 3, 4), (*SIGNED, 3072), OLD, PEDAL, HATS | {40: (-1023, 1023, 0, 63)}),
        (3, 4),
        OLD,
    ),
    "Xbox by Bluetooth (HID)": (NUMBERED, axes((0, 1, 2, 5), (*WIDE, 4095), HID, (*PEDAL, 63)), (2, 5), HID),
    "old Xbox One S by Bluetooth": (NUMBERED, axes((0, 1, 3, 4), (*SIGNED, 4095), OLD, PEDAL), (3, 4), OLD),
    "Stadia, 8BitDo": (NUMBERED, axes((0, 1, 2, 5), (*BYTE, 15), HID, (*TRIGGER, 15)), (2, 5), HID),
    "Steam Deck": (
        (*NAMED, *range(0x220, 0x224)),
        axes((0, 1, 3, 4), SIGNED, SPECIFIED, (0, 32767, 0), dict.fromkeys((16, 17, 18, 19), (-32767, 32767, 0))),
        (3, 4),
        SPECIFIED,
    ),
    "one pair of triggers, as specified": (NAMED, axes((0, 1, 3, 4), SIGNED, (19, 18), TRIGGER), (3, 4), (19, 18)),
    "DualShock 4 without its driver": (NUMBERED, axes((0, 1, 2, 5), BYTE, (3, 4), TRIGGER), (2, 5), (3, 4)),
    "triggers with a signed range": (NAMED, axes((0, 1, 3, 4), SIGNED, OLD, (-32768, 32767, -32768)), (3, 4), OLD),
    "sticks of unequal ranges": (
        NAMED,
        {0: (0, 255, 128), 1: (-100, 127, 0), 3: (0, 1023, 512), 4: (-512, 511, 0)} | dict.fromkeys(OLD, TRIGGER),
        (3, 4),
        OLD,
    ),
}


@pytest.mark.parametrize("moved_before", [True, False])
@pytest.mark.parametrize("name", PADS)
def test_each_known_layout_is_taken_and_read(name: str, moved_before: bool) -> None:
    keys, spans, right, triggers = PADS[name]
    node = FakeNode(keys, axes=spans)
    if not moved_before:
        # The kernel's value of an axis that has not moved since it was plugged in.
        node.values = dict.fromkeys(spans, 0)
    pad = EvdevPad(node.descriptor, node.ioctl)
    assert pad.is_pad, pad.lacks
    state = state_of(pad)
    assert (state.l2, state.r2, state.pressed) == (0.0, 0.0, frozenset())
    assert max(map(abs, state.left_stick + state.right_stick)) < 0.005
    middle = [sum(spans[code][:2]) // 2 for code in triggers]
    if not moved_before:  # A first report moves all axes to where they rest.
        node.happen(*((ABS, code, span[2]) for code, span in spans.items() if span[2]))
    node.happen((ABS, 0, spans[0][0]), (ABS, right[1], spans[right[1]][0]), (ABS, triggers[0], middle[0]))
    node.happen((ABS, triggers[1], spans[triggers[1]][1]), (ABS, 1, spans[1][1]), (ABS, right[0], spans[right[0]][1]))
    state = state_of(pad)
    assert (state.left_stick, state.right_stick) == ((-1.0, -1.0), (1.0, 1.0))
    assert state.l2 == pytest.approx(0.5, abs=0.002)
    assert state.r2 == 1.0
    node.happen((ABS, 16, 1))
    state = state_of(pad)
    assert state.pressed == ({Button.RIGHT} if HATS.items() <= spans.items() else set()), (
        "a touchpad at the hat's place"
    )
    node.happen(*((ABS, code, span[2] + (span[3] if len(span) > 3 else 0)) for code, span in spans.items()))
    state = state_of(pad)
    assert (state.l2, state.r2) == (0.0, 0.0)
    assert max(map(abs, state.left_stick + state.right_stick)) < 0.005, "the kernel's zone of rest does not rest"
    node.close()


def test_a_directional_pad_of_four_keys_presses_no_opposites() -> None:
    node = FakeNode((*NAMED, *range(0x220, 0x224)))
    pad = EvdevPad(node.descriptor, node.ioctl)
    for code, seen in ((0x222, {Button.LEFT}), (0x220, {Button.LEFT, Button.UP}), (0x223, {Button.UP})):
        node.happen((KEY, code, 1))
        state = state_of(pad)
        assert state.pressed == seen
    node.close()


@pytest.fixture
def closing() -> Iterator[contextlib.ExitStack]:
    with contextlib.ExitStack() as stack:
        yield stack


DUALSENSE_AXES = "ABS_X, ABS_Y, ABS_Z, ABS_RX, ABS_RY, ABS_RZ, ABS_HAT0X, ABS_HAT0Y"
REFUSED = {
    "Switch Pro (hid-nintendo)": (
        (NAMED, axes((0, 1, 3, 4), SIGNED, (), TRIGGER)),
        r"no triggers with a travel, only buttons \(ABS_HAT2Y and ABS_HAT2X or .*\); its axes: ABS_X, ABS_Y, ABS_RX,",
    ),
    "triggers without a range": (
        (NAMED, axes((0, 1, 3, 4), SIGNED, OLD, (0, 0, 0))),
        "no triggers .*; without a range: ABS_Z from 0 to 0, ABS_RZ from 0 to 0$",
    ),
    "one stick": ((NAMED, axes((0, 1), SIGNED, HID, PEDAL)), r"no right stick \(ABS_RX and ABS_RY or ABS_Z and ABS_RZ"),
    "wheel": ((range(0x120, 0x12C), axes((0, 5), WIDE, HID, TRIGGER)), "no buttons of a gamepad .*, no left stick"),
    "no axes": ((NAMED, {}), "no left stick .*, no right stick .*; its axes: none"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_is_named_with_its_axes(
    name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, closing: contextlib.ExitStack
) -> None:
    (keys, spans), lacks = REFUSED[name]
    monkeypatch.setattr(pad_module, "NODES", tmp_path)
    for number in range(3):
        (tmp_path / f"event{number}").touch()

    def plug_in(*nodes: FakeNode) -> None:
        left = iter(nodes)

        def opened(descriptor: int) -> EvdevPad:
            os.close(descriptor)
            node = next(left)
            closing.callback(node.close)
            return EvdevPad(node.descriptor, node.ioctl)

        monkeypatch.setattr(pad_module, "EvdevPad", opened)

    plug_in(FakeNode(keys, axes=spans), FakeNode((0x110,)), FakeNode(effects=(0x51,)))  # The second is a mouse.
    with pytest.raises(NoDeviceError) as caught:
        pad_module.find_pad(None)
    _, first, second = str(caught.value).split("; Pad at ")
    assert re.match(f"{tmp_path}/event0: {lacks}", first)
    assert second == f"{tmp_path}/event2: no rumble; its axes: {DUALSENSE_AXES}"
    plug_in(FakeNode(keys, axes=spans), FakeNode((0x110,)), FakeNode())
    refused, taken = gamepads_seen()
    assert (refused.verdict, refused.said) == (Verdict.NOTE, f"Pad at {first}")
    layout = "sticks ABS_X, ABS_Y, ABS_RX, ABS_RY; triggers ABS_Z, ABS_RZ"
    assert (taken.verdict, taken.said) == (Verdict.OK, f"Pad at {tmp_path}/event2: {layout}")
    plug_in(FakeNode(keys, axes=spans), FakeNode((0x110,)), FakeNode())
    found = pad_module.find_pad(None)
    assert found.name == f"Pad at {tmp_path}/event2, rumble in place of stiffness"
    found.device.close()
