import random
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import pytest

from common.errors import DeviceError
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, WARNING_LIGHT, Feel, Rumble
from operator_side.controller.state import Button
from operator_side.evdev.pad import BUTTONS, LENGTH_S, EvdevPad
from tests.helpers.messages import feedback
from tests.operator_side.evdev.fake_node import ABS, DROPPED, KEY, REPORT, FakeNode, state_of

L1, R2_AXIS = 0x136, 5


@pytest.fixture
def node() -> Iterator[FakeNode]:
    made = FakeNode()
    yield made
    made.close()


@pytest.fixture
def pad(node: FakeNode) -> EvdevPad:
    return EvdevPad(node.descriptor, node.ioctl)


def test_what_is_held_already_is_known_and_a_hand_that_holds_still_is_told_again(node: FakeNode) -> None:
    node.values |= {0: 255, 5: 51, 17: -1}
    node.down = {0x136, 0x120}
    pad = EvdevPad(node.descriptor, node.ioctl)
    assert (pad.is_pad, pad.name, pad.address) == (True, "Pad", "aa:bb:cc:00:00:01")
    for _ in range(2):
        state = state_of(pad)
        assert (state.left_stick[0], state.r2, state.l2) == (1.0, 0.2, 0.0)
        assert state.pressed == {Button.L1, Button.UP}


def test_each_axis_and_button_has_its_place_and_the_newest_wins(node: FakeNode, pad: EvdevPad) -> None:
    node.happen((ABS, 1, 255), (ABS, 2, 255))
    node.happen((ABS, 1, 0), (ABS, 3, 0), (ABS, 4, 255), (ABS, 5, 102), (KEY, 0x130, 1), (KEY, 0x131, 1), (ABS, 16, 1))
    node.happen((KEY, 0x130, 0), (KEY, 0x13B, 1), (KEY, 0x13A, 1))
    state = state_of(pad)
    assert state.left_stick == pytest.approx((0.0, 1.0), abs=0.005)
    assert state.right_stick == (-1.0, -1.0)
    assert (state.l2, state.r2) == (1.0, 0.4)
    assert state.pressed == {Button.CIRCLE, Button.OPTIONS, Button.CREATE, Button.RIGHT}


@pytest.mark.parametrize("room", [8, 64, 256])
def test_whatever_is_dropped_each_read_gives_what_the_kernel_knows(room: int) -> None:
    generator = random.Random(room)  # noqa: S311  # repeatable, not secret
    node = FakeNode(room=room)

    def goes_on(busy: int) -> None:
        for _ in range(generator.randrange(busy)):
            axis, key = generator.choice([0, 5, 16]), generator.choice([L1, 0x131])
            value = generator.randrange(1, 256) if axis < 16 else generator.randrange(-1, 2)
            events = [(ABS, axis, value), (KEY, key, generator.randrange(2))]
            node.happen(*generator.sample(events, generator.randrange(1, 3)))

    def ioctl(*request: Any) -> int:
        goes_on(3 if generator.random() < 0.2 else 1)  # While the driver asks, too.
        return node.ioctl(*request)

    pad = EvdevPad(node.descriptor, ioctl)
    for _ in range(300):
        goes_on(generator.choice([2, room, 2 * room]))
        state = state_of(pad)
        moved = {16: {-1: {Button.LEFT}, 0: frozenset[Button](), 1: {Button.RIGHT}}[node.values[16]]}
        assert state.pressed == {BUTTONS[key] for key in node.down} | moved[16]
        assert state.r2 == node.values[5] / 255
        assert state.left_stick[0] == pytest.approx((node.values[0] - 127.5) / 127.5, abs=0.005)
    node.close()


def test_a_packet_with_a_gap_is_dropped_to_its_end_however_it_is_read(node: FakeNode, pad: EvdevPad) -> None:
    gone_on, run = [(KEY, L1, 1), (ABS, R2_AXIS, 255)], frozenset({Button.L1})
    for down, sent, r2, pressed in (
        (set[int](), [(KEY, 0x131, 1), DROPPED, gone_on[0], DROPPED, gone_on[1]], 0.0, frozenset[Button]()),
        (set[int](), gone_on, 0.0, frozenset[Button]()),
        ({L1}, [*gone_on, REPORT], 0.0, run),
        ({L1}, [*gone_on, REPORT], 1.0, run),
    ):
        node.down = down
        node.send(*sent)
        state = state_of(pad)
        assert (state.r2, state.pressed) == (r2, pressed)
    node.send(DROPPED, REPORT)
    node.unplug()
    with pytest.raises(DeviceError, match="gamepad is gone"):
        pad.read(0.0)


def test_a_pulled_trigger_is_felt_where_it_is_and_the_greater_rumble_counts(node: FakeNode, pad: EvdevPad) -> None:
    pad.write(Feel(l2=feedback(0, 4), r2=feedback(3, 8), rumble=Rumble(0.25, 0.0), light=WARNING_LIGHT), 0.0)
    assert node.uploaded.pop() == (3, round(1e3 * LENGTH_S), round(0.25 * 0xFFFF), 0)
    assert not pad.released
    node.happen((ABS, 2, 128), (ABS, 5, 100))  # R2 is before its first stiff zone.
    pad.read(0.01)
    assert node.uploaded.pop()[2:] == (round(0.5 * 0xFFFF), 0)
    node.happen((ABS, 5, 110))
    pad.read(0.02)
    assert node.uploaded.pop()[2:] == (round(0.5 * 0xFFFF), 0xFFFF)
    node.plays()
    node.happen((ABS, 2, 0), (ABS, 5, 0))
    pad.read(0.03)
    assert (node.uploaded.pop()[2:], node.plays()) == ((round(0.25 * 0xFFFF), 0), [(3, 1)])
    pad.write(RELEASED, 0.04)
    assert pad.released
    assert (node.uploaded, node.plays()) == ([], [(3, 0)])


def test_rumble_is_said_again_before_it_ends_and_no_more_once_it_is_over(node: FakeNode, pad: EvdevPad) -> None:
    pad.write(Feel(rumble=Rumble(left=1.0)), 0.0)
    node.plays()
    said_s = [0.0]
    for turn in range(1, 251):
        pad.read(0.004 * turn)
        if node.plays():
            said_s.append(0.004 * turn)
    assert len(said_s) == 10
    assert max(later - earlier for earlier, later in pairwise(said_s)) < 0.6 * LENGTH_S
    pad.write(Feel(rumble=Rumble()), 1.0)
    assert node.plays()[-1] == (3, 0)
    for turn in range(100):
        pad.read(1.0 + 0.004 * turn)
    assert node.plays() == []


@pytest.mark.parametrize("unplugged", [False, True])
def test_closed_it_is_released_unless_it_was_unplugged_with_motors_on(
    node: FakeNode, pad: EvdevPad, unplugged: bool
) -> None:
    pad.write(Feel(l2=FREE_TRIGGER, rumble=Rumble(right=1.0)), 0.0)
    assert node.plays() == [(3, 1)]
    if unplugged:
        node.unplug()
        with pytest.raises(DeviceError, match=r"gamepad is gone .*: plug it in again"):
            pad.read(0.1)
    pad.close()
    pad.close()
    assert pad.released is not unplugged
    assert unplugged or node.plays() == [(3, 0)]
    with pytest.raises(DeviceError, match="closed"):
        pad.read(0.2)
