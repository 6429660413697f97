"""The driver of a real controller against a stand-in for hidapi, and its writes by a thread."""

import sys
import threading
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import operator_side.dualsense.hid.background_writes
from common.errors import DeviceError, NoDriverError
from operator_side.dualsense.effects.official import Off, OtherEffect
from operator_side.dualsense.hid.background_writes import CLOSE_TIMEOUT_S, STALL_S, BackgroundWrites
from operator_side.dualsense.hid.device import HidDualSense, load_backend
from operator_side.dualsense.reports.output_report import (
    RELEASED,
    USUAL_LIGHT,
    WARNING_LIGHT,
    OutputReport,
    Rumble,
    parse_output_report,
)
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
from tests.helpers.felt import feedback

PATH = b"/dev/hidraw3"
TRANSPORTS = pytest.mark.parametrize("transport", [USB, BLUETOOTH])
STIFF = OutputReport(r2=feedback(3, 6))
LIMIT_S = 600.0


def open_fake(handle: FakeHandle) -> HidDualSense:
    return HidDualSense(FakeBackend({0x0CE6: {PATH: handle}}), PATH)


# Opening it


@TRANSPORTS
def test_what_it_is_is_asked_and_nothing_is_written(transport: Transport) -> None:
    handle = FakeHandle(transport, garbled=3 if transport is BLUETOOTH else 0)  # asked for again
    identity = open_fake(handle).identity
    assert (handle.opened, handle.nonblocking, handle.written) == (PATH, 1, [])
    assert (identity.transport, identity.address, identity.firmware) == (transport, ADDRESS, FIRMWARE)
    assert identity.first_report == handle.report()  # over Bluetooth, too: asking switches it to full reports
    identity = open_fake(FakeHandle(transport, answers=False)).identity
    assert (identity.transport, identity.address, identity.firmware) == (transport, None, None)


def test_bluetooth_is_told_from_short_reports_which_are_passed_over() -> None:
    assert open_fake(FakeHandle(BLUETOOTH, waiting=[SIMPLE_REPORT] * 9)).identity.transport is BLUETOOTH
    handle = FakeHandle(BLUETOOTH, waiting=[SIMPLE_REPORT] * 2)
    device = open_fake(handle)
    assert device.identity.first_report == handle.report()
    handle.waiting = [handle.report(1), SIMPLE_REPORT, SIMPLE_REPORT.ljust(78, b"\0")]
    assert (device.read(0.1), handle.waiting) == (handle.report(1), [])
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


def test_another_package_of_that_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hidraw", types.ModuleType("hidraw"))
    with pytest.raises(NoDriverError, match="is not hidapi's: uninstall the package that brings it"):
        load_backend()


def test_the_installed_hidapi_has_what_is_used() -> None:
    hidraw = pytest.importorskip("hidraw")
    backend = load_backend()
    assert backend is hidraw
    handle = backend.device()
    for name in ("open_path", "set_nonblocking", "read", "write", "get_feature_report", "close", "error"):
        assert callable(getattr(handle, name))
    assert backend.enumerate(0x054C, 0xFFFF) == []
    with pytest.raises(OSError, match="open failed"):
        handle.open_path(b"/dev/no-such-hidraw")
    assert "No such file" in handle.error()


# Reading


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
    handle.waiting = [handle.report(1), bad, handle.report(2), bad, bad]
    assert device.read(0.1) == handle.report(2)
    assert device.read(0.2) is None
    handle.waiting = [bad]
    assert device.read(0.3) == bad  # parsing it says what is wrong
    handle.waiting = [handle.report()] * 1000
    assert device.read(0.4) == handle.report()
    assert len(handle.waiting) > 900
    handle.plugged_in = False
    with pytest.raises(DeviceError, match=r"gone \(read error\): plug it in"):
        device.read(0.5)


# Writing


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


@TRANSPORTS
def test_no_debug_code_leaves(transport: Transport) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    for code in (0xFC, 0xFD, 0xFE):
        with pytest.raises(ValueError, match="valid"):
            device.write(OutputReport(r2=OtherEffect(bytes([code]).ljust(11, b"\0"))), 0.0)
        foreign: Any = types.SimpleNamespace(encode=lambda code=code: bytes([code]).ljust(11, b"\0"))
        output: Any = types.SimpleNamespace(l2=foreign, r2=None, rumble=None, lightbar=None)
        with pytest.raises(ValueError, match=f"0x{code:02x}"):
            device.write(output, 0.0)
    assert handle.written == []
    assert device.released


def test_it_is_released_when_everything_that_was_written_is_off() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    steps: list[tuple[OutputReport, bool]] = [
        (OutputReport(lightbar=(1, 2, 3)), True),
        (STIFF, False),
        (OutputReport(l2=Off()), False),
        (OutputReport(rumble=Rumble(left=0.5)), False),
        (OutputReport(r2=Off()), False),
        (OutputReport(rumble=Rumble()), True),
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
    ("told", "farewell"),
    [
        ([], []),
        ([STIFF], [RELEASED]),
        ([OutputReport(lightbar=WARNING_LIGHT), STIFF], [OutputReport(Off(), Off(), Rumble(), USUAL_LIGHT)]),
    ],
)
def test_close_undoes_what_was_written(
    transport: Transport, told: list[OutputReport], farewell: list[OutputReport]
) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    device.read(0.0)
    for output in told:
        device.write(output, 0.0)
    device.close()
    device.close()
    assert [parse_output_report(report) for report in handle.written] == told + farewell
    assert handle.closed == handle.times_opened > 0
    assert device.released
    with pytest.raises(DeviceError, match="closed"):
        device.read(1.0)
    with pytest.raises(DeviceError, match="closed"):
        device.write(OutputReport(), 1.0)


# Writing by a thread


class SlowDevice:
    """A device whose writes take until they are let through."""

    def __init__(self) -> None:
        self.written: list[OutputReport] = []
        self.released = True
        self.fails: Exception | None = None
        self.entered = threading.Semaphore(0)
        self.let = threading.Semaphore(0)
        self.done = threading.Semaphore(0)

    def read(self, now_s: float) -> bytes | None:
        del now_s
        return b"report"

    def write(self, output: OutputReport, now_s: float) -> None:
        del now_s
        self.entered.release()
        assert self.let.acquire(timeout=LIMIT_S)
        if self.fails is not None:
            self.done.release()
            raise self.fails
        self.written.append(output)
        self.released = False
        self.done.release()

    def close(self) -> None:
        self.written.append(RELEASED)
        self.released = True


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowDevice]:
    # However late the machine lets the thread end.
    monkeypatch.setattr(operator_side.dualsense.hid.background_writes, "CLOSE_TIMEOUT_S", LIMIT_S)
    made = SlowDevice()
    yield made
    made.let.release(1000)


def test_what_waits_is_merged_and_the_newest_wins(slow: SlowDevice) -> None:
    writes = BackgroundWrites(slow)
    assert writes.released
    assert not writes.stalls(100.0)
    writes.write(STIFF, 0.0)
    assert slow.entered.acquire(timeout=LIMIT_S)
    assert (writes.released, writes.stalls(STALL_S), writes.stalls(2 * STALL_S)) == (False, False, True)
    # The first write hangs; neither reading nor writing waits for it.
    writes.write(OutputReport(l2=feedback(0, 1), r2=feedback(5, 2)), 0.1)
    writes.write(OutputReport(rumble=Rumble(left=1.0)), 0.2)
    writes.write(OutputReport(l2=Off()), 0.3)
    assert writes.read(0.3) == b"report"
    slow.let.release(2)
    for _ in range(2):
        assert slow.done.acquire(timeout=LIMIT_S)
    assert slow.written == [STIFF, OutputReport(l2=Off(), r2=feedback(5, 2), rumble=Rumble(left=1.0))]
    assert not writes.released
    writes.close()
    assert writes.released
    assert not writes.stalls(100.0)


def test_a_close_drops_what_waits_and_releases(slow: SlowDevice) -> None:
    writes = BackgroundWrites(slow)
    writes.write(STIFF, 0.0)
    assert slow.entered.acquire(timeout=LIMIT_S)
    writes.write(OutputReport(r2=feedback(5, 2)), 0.1)
    slow.let.release()
    assert slow.done.acquire(timeout=LIMIT_S)
    slow.let.release(10)
    writes.close()
    assert slow.written[-1] == RELEASED
    assert writes.released


def test_a_write_that_never_returns_keeps_nobody_and_is_not_called_released(
    slow: SlowDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(operator_side.dualsense.hid.background_writes, "CLOSE_TIMEOUT_S", CLOSE_TIMEOUT_S)
    writes = BackgroundWrites(slow)
    writes.write(STIFF, 0.0)
    assert slow.entered.acquire(timeout=LIMIT_S)
    writes.close()
    assert not writes.released
    assert slow.written == []


@pytest.mark.parametrize("kind", [DeviceError, RuntimeError])
def test_a_failed_write_is_told_by_the_next_call(slow: SlowDevice, kind: type[Exception]) -> None:
    slow.fails = kind("gone")
    writes = BackgroundWrites(slow)
    slow.let.release()
    writes.write(STIFF, 0.0)
    assert slow.done.acquire(timeout=LIMIT_S)
    writes._thread.join(LIMIT_S)
    with pytest.raises(kind, match="gone"):
        writes.read(0.1)
    with pytest.raises(kind, match="gone"):
        writes.write(STIFF, 0.1)
    writes.close()
