import sys
import types
from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from common.errors import DeviceError, NoDriverError
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, USUAL_LIGHT, WARNING_LIGHT, Feel, Rumble
from operator_side.controller.state import Button, ControllerState
from operator_side.dualsense.hid.device import HidDualSense, load_backend
from operator_side.dualsense.reports.input_report import build_input_report
from operator_side.dualsense.reports.output_report import parse_output_report
from operator_side.dualsense.reports.transport import Transport
from tests.helpers.fake_hid import (
    ADDRESS,
    BLUETOOTH,
    FIRMWARE,
    SIMPLE_REPORT,
    USB,
    FakeBackend,
    FakeHandle,
    valid_checksum,
)
from tests.helpers.messages import feedback

PATH = b"/dev/hidraw3"
TRANSPORTS = pytest.mark.parametrize("transport", [USB, BLUETOOTH])
STIFF = Feel(r2=feedback(3, 6))


def open_fake(handle: FakeHandle) -> HidDualSense:
    return HidDualSense(FakeBackend({0x0CE6: {PATH: handle}}), PATH)


@TRANSPORTS
def test_its_identity_is_read_and_nothing_is_written(transport: Transport) -> None:
    handle = FakeHandle(transport, garbled=3 if transport is BLUETOOTH else 0)  # asked again
    identity = open_fake(handle).identity
    assert (handle.opened, handle.nonblocking, handle.written) == (PATH, 1, [])
    assert (identity.transport, identity.address, identity.firmware) == (transport, ADDRESS, FIRMWARE)
    assert identity.first_report == handle.report()  # The question switches Bluetooth to full reports, too.
    identity = open_fake(FakeHandle(transport, answers=False)).identity
    assert (identity.transport, identity.address, identity.firmware) == (transport, None, None)


def test_bluetooth_is_told_from_short_reports_which_are_passed_over() -> None:
    assert open_fake(FakeHandle(BLUETOOTH, waiting=[SIMPLE_REPORT] * 9)).identity.transport is BLUETOOTH
    handle = FakeHandle(BLUETOOTH, waiting=[SIMPLE_REPORT] * 2)
    device = open_fake(handle)
    assert device.identity.first_report == handle.report()
    handle.waiting = [handle.report(1), SIMPLE_REPORT, SIMPLE_REPORT.ljust(78, b"\0")]
    assert (device.read(0.1), handle.waiting) == (ControllerState(), [])
    handle.waiting = [SIMPLE_REPORT]
    assert device.read(0.2) is None


@pytest.mark.parametrize(
    ("handle", "message"),
    [
        (FakeHandle(silent=True), "hidraw3 sends nothing: press its PS button"),
        (FakeHandle(waiting=[b"\x11" + bytes(63)]), r"does not speak as a DualSense does \(.*id 0x11, 64 bytes"),
        (FakeHandle(plugged_in=False), "gone"),
        (
            FakeHandle(opens=False, reason="Failed to open a device with path '/x': Permission denied"),
            "no permission to open the controller at /dev/hidraw3: `feelahead doctor`",
        ),
    ],
)
def test_what_cannot_be_used_is_let_go_and_named(handle: FakeHandle, message: str) -> None:
    with pytest.raises(DeviceError, match=message) as caught:
        open_fake(handle)
    assert "\n" not in str(caught.value)
    assert handle.closed == handle.times_opened


def test_permission_is_seen_even_where_hidapi_does_not_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    node = tmp_path / "hidraw3"
    node.touch()
    monkeypatch.setattr("os.access", lambda path, _mode: path != str(node))
    with pytest.raises(DeviceError, match="no permission"):
        HidDualSense(FakeBackend({0x0CE6: {bytes(node): FakeHandle(opens=False)}}), bytes(node))
    with pytest.raises(DeviceError, match=r"/dev/nowhere cannot be opened \(No such file or directory\)"):
        HidDualSense(FakeBackend({}), b"/dev/nowhere")


def test_the_installed_hidapi_is_taken() -> None:
    assert load_backend() is pytest.importorskip("hidraw")


def test_a_missing_hidapi_comes_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hidraw", None)
    with pytest.raises(NoDriverError, match=r"^hidapi is not installed: .*pip install .*\[operator\]"):
        load_backend()


def test_another_package_of_that_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hidraw", types.ModuleType("hidraw"))
    with pytest.raises(NoDriverError, match="is not hidapi's: uninstall the package that brings it"):
        load_backend()


@pytest.mark.parametrize(
    ("transport", "bad"),
    [
        (USB, b"\x01" + bytes(62)),
        (USB, b"\x05" + bytes(63)),
        (BLUETOOTH, b"\x31" + bytes(77)),
        (BLUETOOTH, b"\x31" + bytes(10)),
    ],
)
def test_reading_drains_to_the_newest_good_report(transport: Transport, bad: bytes) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    assert device.read(0.0) is None
    pulled = ControllerState(r2=1.0)
    handle.waiting = [handle.report(1), bad, build_input_report(pulled, transport), bad, bad]
    assert device.read(0.1) == pulled
    assert device.read(0.2) is None
    handle.waiting = [bad]
    assert device.read(0.3) is None
    handle.waiting = [handle.report()] * 1000
    assert device.read(0.4) == ControllerState()
    assert len(handle.waiting) > 900
    handle.plugged_in = False
    with pytest.raises(DeviceError, match=r"gone \(read error\): plug it in"):
        device.read(0.5)


HELD = ControllerState(r2=1.0, pressed=frozenset({Button.L1, Button.R2}))


@pytest.mark.parametrize(
    "made",
    [
        pytest.param(lambda k: build_input_report(HELD, USB, k % 256), id="an imitation without sensor time"),
        pytest.param(lambda k: build_input_report(HELD, USB, 7, 0.004 * k), id="an imitation without numbers"),
        pytest.param(lambda k: build_input_report(HELD, USB, k % 256, 0.004 * k), id="at rest on USB"),
        pytest.param(lambda k: build_input_report(HELD, BLUETOOTH, 1, 0.004 * k), id="at rest on Bluetooth"),
        pytest.param(lambda k: build_input_report(replace(HELD, r2=k % 256 / 255)), id="hands that move"),
    ],
)
def test_a_report_is_new_while_number_time_or_hands_move_and_a_repetition_is_not(made: Callable[[int], bytes]) -> None:
    handle = FakeHandle(waiting=[made(0)])
    device = open_fake(handle)
    for k in range(1, 600):  # Numbers have one byte.
        handle.waiting = [made(k)] * (1 + k % 4)  # A dongle asks more often than its controller sends.
        assert device.read(0.0) is not None
        handle.waiting = [made(k)] * (k % 3)
        assert device.read(0.0) is None
    handle.waiting = [made(600), made(601), made(601)]  # After a stall of ours.
    assert device.read(0.0) is not None


@TRANSPORTS
def test_each_report_goes_out_in_its_framing_with_the_next_number_and_a_checksum(transport: Transport) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    for _ in range(20):
        device.write(STIFF, 0.0)
    assert {parse_output_report(report) for report in handle.written} == {STIFF}
    if transport is BLUETOOTH:
        assert [report[1] >> 4 for report in handle.written] == [number % 16 for number in range(20)]
        assert all(valid_checksum(report) for report in handle.written)
    assert {(report[0], len(report)) for report in handle.written} == {(0x02, 48) if transport is USB else (0x31, 78)}


def test_it_is_released_when_everything_that_was_written_is_off() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    steps: list[tuple[Feel, bool]] = [
        (Feel(light=(1, 2, 3)), True),
        (STIFF, False),
        (Feel(l2=FREE_TRIGGER), False),
        (Feel(rumble=Rumble(left=0.5)), False),
        (Feel(r2=FREE_TRIGGER), False),
        (Feel(rumble=Rumble()), True),
        (STIFF, False),
        (RELEASED, True),
    ]
    for output, released in steps:
        device.write(output, 0.0)
        assert device.released is released
    handle.plugged_in = False
    with pytest.raises(DeviceError, match=r"gone .*: plug it in"):
        device.write(RELEASED, 0.0)
    device.close()
    assert not device.released
    assert handle.closed == handle.times_opened > 0


@TRANSPORTS
@pytest.mark.parametrize(
    ("commanded", "farewell"),
    [
        ([], []),
        ([STIFF], [RELEASED]),
        ([Feel(light=WARNING_LIGHT), STIFF], [Feel(FREE_TRIGGER, FREE_TRIGGER, Rumble(), USUAL_LIGHT)]),
    ],
)
def test_close_undoes_what_was_written(transport: Transport, commanded: list[Feel], farewell: list[Feel]) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    device.read(0.0)
    for output in commanded:
        device.write(output, 0.0)
    device.close()
    device.close()
    assert [parse_output_report(report) for report in handle.written] == commanded + farewell
    assert handle.closed == handle.times_opened > 0
    assert device.released
    with pytest.raises(DeviceError, match="closed"):
        device.read(1.0)
    with pytest.raises(DeviceError, match="closed"):
        device.write(Feel(), 1.0)
