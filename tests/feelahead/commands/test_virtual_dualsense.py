"""`feelahead virtual-dualsense` with a simulated kernel in virtual time, and on a machine without /dev/uhid."""

from collections import deque

import pytest

from common.clock import VirtualClock
from feelahead.commands.virtual_dualsense import DRIVER_PATIENCE_S, PULL_PERIOD_S, VirtualDualSenseSettings, live
from operator_side.controller.feel import FREE_TRIGGER, Feel, Rumble
from operator_side.controller.state import ControllerState
from operator_side.dualsense.reports.feature_report import parse_address
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.output_report import build_output_report
from operator_side.dualsense.reports.transport import Transport
from tests.helpers.fake_kernel import START, STOP, FakeKernel, get_report, output, said
from tests.helpers.messages import feedback

INPUT2, GET_REPORT_REPLY, DESTROY = 12, 10, 1


def lived(kernel: FakeKernel, settings: VirtualDualSenseSettings) -> list[str]:
    """Run one controller from plugging in to unplugging; return the lines that it prints."""
    lines: list[str] = []
    live(settings, kernel, kernel.clock, lambda: False, lines.append)
    return lines


def sent_states(kernel: FakeKernel) -> list[ControllerState]:
    """Return the states in the input reports that the kernel got; each report has 6 bytes in front."""
    return [parse_input_report(event[6:]) for _, event in kernel.heard_of(INPUT2)]


@pytest.mark.parametrize(
    ("transport", "edge", "first"),
    [
        ("usb", False, "Sony Interactive Entertainment DualSense Wireless Controller on USB"),
        ("bluetooth", True, "DualSense Edge Wireless Controller on Bluetooth"),
    ],
)
def test_it_says_what_it_is_told(transport: str, edge: bool, first: str) -> None:
    by = Transport.USB if transport == "usb" else Transport.BLUETOOTH
    told = [
        Feel(l2=feedback(position=3, strength=6), light=(0, 0, 64)),
        Feel(l2=feedback(position=3, strength=6), r2=FREE_TRIGGER),  # Nothing new.
        Feel(l2=FREE_TRIGGER, r2=feedback(position=0, strength=8), rumble=Rumble(left=1.0)),
    ]
    events = [(0.0, get_report(1, 0x09)), (0.01, said(START))]
    events += [(0.02, output(build_output_report(one, by))) for one in told]
    kernel = FakeKernel(VirtualClock(), deque([*events, (0.05, said(STOP))]))
    settings = VirtualDualSenseSettings(transport=transport, edge=edge, duration=0.1)  # type: ignore[arg-type]
    lines = lived(kernel, settings)
    address = parse_address(kernel.heard_of(GET_REPORT_REPLY)[0][1][12:], by)
    assert lines == [
        f"plugging in: {first}, {address}",
        "a driver has taken it",
        "L2: strengths 0 0 0 6 6 6 6 6 6 6",
        "lightbar: red 0, green 0, blue 64",
        "L2: Off",
        "R2: strengths 8 8 8 8 8 8 8 8 8 8",
        "rumble: left 100%, right 0%",
        "its driver has let it go",
        "unplugged: 10 reports sent, 3 taken, 0 refused",
    ]
    assert kernel.heard[-1][1][0] == DESTROY


def test_without_a_driver_it_says_so_once() -> None:
    kernel = FakeKernel(VirtualClock())
    lines = lived(kernel, VirtualDualSenseSettings(duration=2 * DRIVER_PATIENCE_S))
    assert lines[1:] == [
        "no driver has taken it so far: sudo modprobe hid-playstation",
        "unplugged: 0 reports sent, 0 taken, 0 refused",
    ]


def test_pulling_hands_are_seen_to_move() -> None:
    kernel = FakeKernel(VirtualClock(), deque([(0.0, said(START))]))
    lived(kernel, VirtualDualSenseSettings(duration=PULL_PERIOD_S, hands="pulling"))
    states = sent_states(kernel)
    assert len(states) == pytest.approx(PULL_PERIOD_S * 250, abs=2)
    for axis in (0, 1):
        moved = [state.left_stick[axis] for state in states]
        assert (min(moved), max(moved)) == pytest.approx((-0.8, 0.8), abs=0.01)
    assert max(state.l2 for state in states) == max(state.r2 for state in states) == 1.0
    middle = len(states) // 2
    assert all(state.l2 == 0.0 for state in states[:middle])
    assert all(state.r2 == 0.0 for state in states[middle + 50 :])
