"""The HID driver against a stand-in for hidapi that behaves as measured: [] and OSError, -1 on a dead write."""

import builtins
import sys
import types
from pathlib import Path
from typing import Any

import pytest

from common.errors import DeviceError
from operator_side.dualsense.controller_state import ControllerState
from operator_side.dualsense.device import HidDualSense, HidHandle, load_backend
from operator_side.dualsense.effects import Feedback, Off
from operator_side.dualsense.input_report import build_input_report
from operator_side.dualsense.output_report import RELEASED, OutputReport, build_output_report

IDLE = build_input_report(ControllerState())


class FakeHandle:
    def __init__(self, opens: bool = True, reason: str = "") -> None:
        self.opens = opens
        self.reason = reason
        self.opened: bytes | None = None
        self.nonblocking = 0
        self.waiting: list[bytes] = []
        self.written: list[bytes] = []
        self.plugged_in = True
        self.closed = False

    def open_path(self, path: bytes) -> None:
        if not self.opens:
            raise OSError("open failed")
        self.opened = path

    def set_nonblocking(self, flag: int) -> int:
        self.nonblocking = flag
        return 0

    def read(self, max_length: int) -> list[int]:
        assert self.nonblocking == 1
        if not self.plugged_in:
            raise OSError("read error")
        return list(self.waiting.pop(0)[:max_length]) if self.waiting else []

    def write(self, data: bytes) -> int:
        if not self.plugged_in:
            return -1
        self.written.append(data)
        return len(data)

    def close(self) -> None:
        self.closed = True

    def error(self) -> str:
        return self.reason


class FakeBackend:
    def __init__(self, handle: FakeHandle, found: dict[int, list[bytes]]) -> None:
        self.handle = handle
        self.found = found

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        assert vendor_id == 0x054C
        return [{"path": path} for path in self.found.get(product_id, [])]

    def device(self) -> HidHandle:
        return self.handle


def open_fake(handle: FakeHandle) -> HidDualSense:
    return HidDualSense(FakeBackend(handle, {0x0CE6: [b"/dev/hidraw3"]}))


@pytest.mark.parametrize("product_id", [0x0CE6, 0x0DF2])
def test_either_model_is_found_and_opened_without_waiting(product_id: int) -> None:
    handle = FakeHandle()
    HidDualSense(FakeBackend(handle, {product_id: [b"/dev/hidraw3", b"/dev/hidraw4"]}))
    assert handle.opened == b"/dev/hidraw3"
    assert handle.nonblocking == 1
    assert handle.written == []


def test_no_controller() -> None:
    with pytest.raises(DeviceError, match=r"no DualSense .*054C:0CE6.*0DF2.*USB cable.*--device simulated"):
        HidDualSense(FakeBackend(FakeHandle(), {}))


def test_permission_denied_gives_the_udev_rule() -> None:
    handle = FakeHandle(opens=False, reason="Failed to open a device with path '/x': Permission denied")
    with pytest.raises(DeviceError) as caught:
        open_fake(handle)
    text = str(caught.value)
    if sys.platform == "linux":
        assert "no permission" in text
        for product in ("0ce6", "0df2"):
            assert f'ATTRS{{idVendor}}=="054c", ATTRS{{idProduct}}=="{product}", MODE="0660", TAG+="uaccess"' in text
        assert "udevadm" in text


@pytest.mark.skipif(sys.platform != "linux", reason="device nodes of Linux")
def test_permission_is_seen_even_where_hidapi_does_not_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    node = tmp_path / "hidraw3"
    node.touch()
    monkeypatch.setattr("os.access", lambda path, _mode: path != str(node))
    with pytest.raises(DeviceError, match="no permission"):
        HidDualSense(FakeBackend(FakeHandle(opens=False), {0x0CE6: [bytes(node)]}))


def test_another_reason_for_not_opening() -> None:
    with pytest.raises(DeviceError, match=r"/dev/nowhere cannot be opened \(open failed\)"):
        HidDualSense(FakeBackend(FakeHandle(opens=False), {0x0CE6: [b"/dev/nowhere"]}))


def test_reading_drains_to_the_newest() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    assert device.read(0.0) is None
    handle.waiting = [build_input_report(ControllerState(sequence=number)) for number in range(5)]
    assert device.read(0.1) == build_input_report(ControllerState(sequence=4))
    assert device.read(0.2) is None


def test_draining_is_bounded() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    handle.waiting = [IDLE] * 1000
    assert device.read(0.0) == IDLE
    assert len(handle.waiting) > 900


@pytest.mark.parametrize("report", [b"\x31" + bytes(77), b"\x01" + bytes(9)])
def test_bluetooth_is_recognised_by_id_and_length(report: bytes) -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    handle.waiting = [report]
    with pytest.raises(DeviceError, match=rf"Bluetooth \(report id 0x{report[0]:02x}, {len(report)} bytes\)"):
        device.read(0.0)


def test_writing() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    report = build_output_report(OutputReport(r2=Feedback(3, 6)))
    device.write(report, 0.0)
    assert handle.written == [report]


def test_no_debug_code_and_no_nonsense_leaves() -> None:
    handle = FakeHandle()
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


def test_unplugged_while_reading() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    handle.plugged_in = False
    with pytest.raises(DeviceError, match=r"gone \(read error\): plug it in"):
        device.read(0.0)


def test_unplugged_while_writing() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    handle.plugged_in = False
    with pytest.raises(DeviceError, match=r"gone .*: plug it in"):
        device.write(build_output_report(OutputReport(Off())), 0.0)
    device.close()
    assert handle.closed


def test_close_releases_what_was_written() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    device.write(build_output_report(OutputReport(r2=Feedback(0, 8))), 0.0)
    device.close()
    device.close()
    assert handle.written[1:] == [build_output_report(RELEASED)]
    assert handle.closed
    with pytest.raises(DeviceError, match="closed"):
        device.read(1.0)
    with pytest.raises(DeviceError, match="closed"):
        device.write(build_output_report(OutputReport()), 1.0)


def test_close_leaves_a_controller_alone_that_was_only_read() -> None:
    handle = FakeHandle()
    device = open_fake(handle)
    device.read(0.0)
    device.close()
    assert handle.written == []
    assert handle.closed


def test_hidapi_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    real_import = builtins.__import__

    def without_hidapi(name: str, *args: Any, **kwargs: Any) -> Any:
        if name in {"hid", "hidraw"}:
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
        return real_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_hidapi)
    with pytest.raises(DeviceError, match=r"No module named .*pip install 'feelahead\[operator\]'"):
        load_backend()


def test_the_other_package_called_hid(monkeypatch: pytest.MonkeyPatch) -> None:
    module = types.ModuleType("hid")
    module.enumerate = list  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "hid", module)
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(DeviceError, match="pip uninstall hid"):
        load_backend()


@pytest.mark.skipif(sys.platform != "linux", reason="hidraw is Linux's")
def test_the_installed_hidapi_has_what_is_used() -> None:
    hidraw = pytest.importorskip("hidraw")
    backend = load_backend()
    assert backend is hidraw
    handle = backend.device()
    for name in ("open_path", "set_nonblocking", "read", "write", "close", "error"):
        assert callable(getattr(handle, name))
    assert backend.enumerate(0x054C, 0xFFFF) == []
    with pytest.raises(OSError, match="open failed"):
        handle.open_path(b"/dev/no-such-hidraw")
    assert "No such file" in handle.error()
