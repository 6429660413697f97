"""The HID driver against a stand-in for hidapi."""

import builtins
import sys
import types
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from common.errors import ConfigurationError, DeviceError, NoDriverError
from operator_side.dualsense.effects.official import Feedback, Off
from operator_side.dualsense.hid.device import HidDualSense, load_backend, write_once
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.dualsense.reports.input_report import build_simple_input_report
from operator_side.dualsense.reports.motion_sensors import NOMINAL_MOTION, MotionCalibration
from operator_side.dualsense.reports.output_report import (
    RELEASED,
    USUAL_LIGHT,
    WARNING_LIGHT,
    OutputReport,
    Rumble,
    build_output_report,
    parse_output_report,
)
from operator_side.dualsense.reports.transport import Transport
from tests.helpers.fake_hid import (
    ADDRESS,
    BLUETOOTH,
    CALIBRATION,
    FIRMWARE,
    USB,
    FakeBackend,
    FakeHandle,
    valid_checksum,
)

PATH = b"/dev/hidraw3"
BOTH = [USB, BLUETOOTH]
STIFF = OutputReport(r2=Feedback(3, 6))


def open_fake(handle: FakeHandle) -> HidDualSense:
    return HidDualSense(FakeBackend({0x0CE6: {PATH: handle}}), PATH)


@pytest.mark.parametrize("transport", BOTH)
def test_what_it_is_is_asked_and_nothing_is_written(transport: Transport) -> None:
    handle = FakeHandle(transport)
    identity = open_fake(handle).identity
    assert handle.opened == PATH
    assert handle.nonblocking == 1
    assert handle.written == []
    assert (identity.transport, identity.address, identity.firmware) == (transport, ADDRESS, FIRMWARE)
    assert identity.motion == MotionCalibration.of(CALIBRATION)
    assert identity.first_report == handle.report()


def test_bluetooth_is_switched_to_full_reports_by_asking() -> None:
    handle = FakeHandle(BLUETOOTH)
    open_fake(handle)
    assert handle.full_mode


def test_bluetooth_is_told_even_from_a_short_report() -> None:
    handle = FakeHandle(BLUETOOTH, waiting=[build_simple_input_report(ControllerState())])
    assert open_fake(handle).identity.transport is BLUETOOTH


def test_a_feature_that_comes_garbled_is_asked_for_again() -> None:
    identity = open_fake(FakeHandle(BLUETOOTH, garbled=3)).identity
    assert (identity.address, identity.firmware) == (ADDRESS, FIRMWARE)


@pytest.mark.parametrize("transport", BOTH)
def test_a_controller_that_tells_nothing_of_itself_works(transport: Transport) -> None:
    identity = open_fake(FakeHandle(transport, answers=False)).identity
    assert (identity.transport, identity.address, identity.firmware) == (transport, None, None)
    assert identity.motion == NOMINAL_MOTION


def test_one_that_sends_nothing() -> None:
    handle = FakeHandle(silent=True)
    with pytest.raises(DeviceError, match="hidraw3 sends nothing: press its PS button"):
        open_fake(handle)
    assert handle.closed == handle.times_opened > 0


def test_one_that_is_no_dualsense() -> None:
    handle = FakeHandle(waiting=[b"\x11" + bytes(63)])
    with pytest.raises(DeviceError, match=r"does not speak as a DualSense does \(.*id 0x11, 64 bytes"):
        open_fake(handle)
    assert handle.closed == handle.times_opened > 0


def test_one_that_goes_away_while_it_is_asked() -> None:
    handle = FakeHandle(plugged_in=False)
    with pytest.raises(DeviceError, match="gone"):
        open_fake(handle)
    assert handle.closed == handle.times_opened > 0


def test_permission_denied() -> None:
    handle = FakeHandle(opens=False, reason="Failed to open a device with path '/x': Permission denied")
    with pytest.raises(DeviceError) as caught:
        open_fake(handle)
    if sys.platform == "linux":
        assert "no permission to open the controller at /dev/hidraw3: `feelahead doctor`" in str(caught.value)


@pytest.mark.skipif(sys.platform != "linux", reason="device nodes of Linux")
def test_permission_is_seen_even_where_hidapi_does_not_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    node = tmp_path / "hidraw3"
    node.touch()
    monkeypatch.setattr("os.access", lambda path, _mode: path != str(node))
    with pytest.raises(DeviceError, match="no permission"):
        HidDualSense(FakeBackend({0x0CE6: {bytes(node): FakeHandle(opens=False)}}), bytes(node))


def test_another_reason_for_not_opening() -> None:
    with pytest.raises(DeviceError, match=r"/dev/nowhere cannot be opened \(No such file or directory\)"):
        HidDualSense(FakeBackend({}), b"/dev/nowhere")


@pytest.mark.parametrize("transport", BOTH)
def test_reading_drains_to_the_newest(transport: Transport) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    assert device.read(0.0) is None
    handle.waiting = [handle.report(number) for number in range(5)]
    assert device.read(0.1) == handle.report(4)
    assert device.read(0.2) is None


@pytest.mark.parametrize(
    ("transport", "bad"),
    [
        (USB, b"\x01" + bytes(62)),
        (USB, b"\x05" + bytes(63)),
        (BLUETOOTH, b"\x31" + bytes(77)),
        (BLUETOOTH, b"\x31" + bytes(10)),
    ],
)
def test_a_bad_report_does_not_hide_the_good_ones_before_it(transport: Transport, bad: bytes) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    handle.waiting = [handle.report(1), bad, handle.report(2), bad, bad]
    assert device.read(0.0) == handle.report(2)
    assert device.bad_reports == 2
    handle.waiting = [bad]
    assert device.read(0.1) == bad  # for whoever parses it to say what is wrong
    assert device.bad_reports == 3


def test_writing_once(monkeypatch: pytest.MonkeyPatch) -> None:
    handle = FakeHandle()
    backend = FakeBackend({0x0CE6: {PATH: handle}})
    monkeypatch.setattr("operator_side.dualsense.hid.device.load_backend", lambda: backend)
    write_once(PATH, b"report")
    assert (handle.written, handle.closed) == ([b"report"], 1)
    handle.plugged_in = False
    with pytest.raises(DeviceError, match="gone"):
        write_once(PATH, b"report")
    assert (handle.written, handle.closed) == ([b"report"], 2)
    with pytest.raises(DeviceError, match="cannot be opened"):
        write_once(b"/dev/nowhere", b"report")


def test_draining_is_bounded() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    handle.waiting = [handle.report()] * 1000
    assert device.read(0.0) == handle.report()
    assert len(handle.waiting) > 900


@pytest.mark.parametrize("given", BOTH)
@pytest.mark.parametrize("transport", BOTH)
def test_what_is_written_goes_out_in_its_own_framing(transport: Transport, given: Transport) -> None:
    handle = FakeHandle(transport)
    open_fake(handle).write(build_output_report(STIFF, given), 0.0)
    [report] = handle.written
    assert (report[0], len(report)) == ((0x02, 48) if transport is USB else (0x31, 78))
    assert parse_output_report(report) == STIFF


def test_each_report_over_bluetooth_has_the_next_number_and_a_checksum() -> None:
    handle = FakeHandle(BLUETOOTH)
    device = open_fake(handle)
    for _ in range(20):
        device.write(build_output_report(STIFF), 0.0)
    assert [report[1] >> 4 for report in handle.written] == [number % 16 for number in range(20)]
    assert all(valid_checksum(report) for report in handle.written)


@pytest.mark.parametrize("transport", BOTH)
def test_no_debug_code_and_no_nonsense_leaves(transport: Transport) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    for place in (11, 22):
        for code in (0xFC, 0xFD, 0xFE):
            report = bytearray(build_output_report(OutputReport(Off(), Off())))
            report[place] = code
            with pytest.raises(ValueError, match=f"0x{code:02x}"):
                device.write(bytes(report), 0.0)
    with pytest.raises(ValueError, match="no bytes"):
        device.write(b"", 0.0)
    assert handle.written == []
    assert device.released


def test_unplugged_while_reading() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    handle.plugged_in = False
    with pytest.raises(DeviceError, match=r"gone \(read error\): plug it in"):
        device.read(0.0)


def test_unplugged_while_writing_it_is_not_released() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    handle.plugged_in = False
    with pytest.raises(DeviceError, match=r"gone .*: plug it in"):
        device.write(build_output_report(STIFF), 0.0)
    device.close()
    assert handle.closed == handle.times_opened > 0
    assert not device.released


@pytest.mark.parametrize("transport", BOTH)
def test_close_releases_what_was_written(transport: Transport) -> None:
    handle = FakeHandle(transport)
    device = open_fake(handle)
    device.write(build_output_report(STIFF), 0.0)
    assert not device.released
    device.close()
    device.close()
    assert handle.written[1:] == [build_output_report(RELEASED, transport, 1)]
    assert handle.closed == handle.times_opened > 0
    assert device.released
    with pytest.raises(DeviceError, match="closed"):
        device.read(1.0)
    with pytest.raises(DeviceError, match="closed"):
        device.write(build_output_report(OutputReport()), 1.0)


def test_close_puts_back_a_light_that_was_changed() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    device.write(build_output_report(OutputReport(lightbar=WARNING_LIGHT)), 0.0)
    device.write(build_output_report(STIFF), 0.0)
    device.close()
    assert handle.written[2:] == [build_output_report(replace(RELEASED, lightbar=USUAL_LIGHT))]


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
    for report, released in steps:
        device.write(build_output_report(report), 0.0)
        assert device.released is released
    handle.plugged_in = False
    with pytest.raises(DeviceError, match="gone"):
        device.write(build_output_report(RELEASED), 0.0)
    assert not device.released


def test_close_leaves_a_controller_alone_that_was_only_read() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    device.read(0.0)
    device.close()
    assert handle.written == []
    assert handle.closed == handle.times_opened > 0
    assert device.released


def test_hidapi_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    real_import = builtins.__import__

    def without_hidapi(name: str, *args: Any, **kwargs: Any) -> Any:
        if name in {"hid", "hidraw"}:
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
        return real_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_hidapi)
    with pytest.raises(NoDriverError, match=r"No module named .*pip install --force-reinstall hidapi") as caught:
        load_backend()
    assert isinstance(caught.value, ConfigurationError)  # no waiting mends it: the command ends with code 2
    assert "\n" not in str(caught.value)


def test_the_other_package_called_hid(monkeypatch: pytest.MonkeyPatch) -> None:
    module = types.ModuleType("hid")
    module.enumerate = list  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "hid", module)
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(NoDriverError, match="pip uninstall hid"):
        load_backend()


@pytest.mark.skipif(sys.platform != "linux", reason="hidraw is Linux's")
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
