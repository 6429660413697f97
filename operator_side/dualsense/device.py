"""A real DualSense over HID: the only file that imports hidapi, and only when a controller is opened."""

import os
import sys
from pathlib import Path
from typing import Any, Final, Protocol, cast

from common.errors import DeviceError, RemoteProtocolError
from operator_side.dualsense.output_report import RELEASED, build_output_report, parse_output_report
from operator_side.dualsense.transport import Transport, transport_of_input

SONY_VENDOR_ID: Final = 0x054C
PRODUCT_IDS: Final = {0x0CE6: "DualSense", 0x0DF2: "DualSense Edge"}

_READ_LENGTH = 128  # longer than any report, so that Bluetooth's 78 bytes are seen as what they are
_MAX_DRAINED = 64  # what the kernel's hidraw queue holds; more than that is left for the next read

_INSTALL = "install it with: pip install 'feelahead[operator]'"
_WITHOUT = "or run without a controller: --device simulated"
_UDEV_RULES = "\n".join(
    f'  KERNEL=="hidraw*", ATTRS{{idVendor}}=="{SONY_VENDOR_ID:04x}", ATTRS{{idProduct}}=="{product:04x}", '
    'MODE="0660", TAG+="uaccess"'
    for product in PRODUCT_IDS
)


class HidHandle(Protocol):
    """What is used of hidapi's `device` objects."""

    def open_path(self, path: bytes) -> None:
        """Open; OSError when that fails."""
        ...

    def set_nonblocking(self, flag: int) -> object:
        """1: `read` returns an empty list rather than wait."""
        ...

    def read(self, max_length: int) -> list[int]:
        """One report; OSError when the device is gone."""
        ...

    def write(self, data: bytes) -> int:
        """The number of bytes written; -1 when the device is gone."""
        ...

    def close(self) -> None:
        """Let the device go."""
        ...

    def error(self) -> str:
        """What the last failure was."""
        ...


class HidBackend(Protocol):
    """What is used of hidapi's modules `hidraw` and `hid`."""

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        """The devices that are there."""
        ...

    def device(self) -> HidHandle:
        """A handle that is not open yet."""
        ...


def load_backend() -> HidBackend:
    """Import hidapi; DeviceError when it is missing, broken or shadowed by the other package called `hid`.

    hidapi's wheel for Linux has two modules: `hidraw`, which sees the kernel's hidraw devices, and `hid`, which
    goes through libusb and does not. Elsewhere there is only `hid`.
    """
    try:
        if sys.platform == "linux":
            import hidraw as module  # noqa: PLC0415
        else:
            import hid as module  # noqa: PLC0415
    except ImportError as error:
        raise DeviceError(
            f"hidapi cannot be imported ({error}): uninstall the other package called hid if it is there, and"
            f" {_INSTALL}, {_WITHOUT}"
        ) from error
    if not hasattr(module, "device") or not hasattr(module, "enumerate"):
        raise DeviceError(
            f"the module {module.__name__} is not hidapi's but another package's: pip uninstall hid, then {_INSTALL}"
        )
    return cast(HidBackend, module)


class HidDualSense:
    """The Device port on the first DualSense or DualSense Edge that is found on USB."""

    def __init__(self, backend: HidBackend | None = None) -> None:
        """Find and open a controller; DeviceError says what to do when there is none or it may not be opened.

        `backend`: hidapi unless given.
        """
        if backend is None:
            backend = load_backend()
        path = _find(backend)
        handle = backend.device()
        try:
            handle.open_path(path)
            handle.set_nonblocking(1)
        except OSError as error:
            raise DeviceError(_why_not_opened(path, handle.error() or str(error))) from error
        self._handle: HidHandle | None = handle
        self._written = False
        self._released = True

    @property
    def released(self) -> bool:
        """Nothing was ever written, or the triggers have been released by `close`."""
        return self._released

    def read(self, now_s: float) -> bytes | None:
        """The newest input report, or None when there is no new one; never waits.

        DeviceError when the controller is gone, or on Bluetooth.
        """
        del now_s  # a real controller has a clock of its own
        handle = self._require_open()
        newest: list[int] = []
        try:
            for _ in range(_MAX_DRAINED):
                report = handle.read(_READ_LENGTH)
                if not report:
                    break
                newest = report
        except OSError as error:
            raise DeviceError(_gone(str(error))) from error
        if not newest:
            return None
        if _is_bluetooth(bytes(newest)):
            raise DeviceError(
                f"the controller is connected by Bluetooth (report id 0x{newest[0]:02x}, {len(newest)} bytes), "
                f"which is not supported yet: connect it by USB cable (64-byte reports)"
            )
        return bytes(newest)

    def write(self, report: bytes, now_s: float) -> None:
        """Send a USB output report.

        ValueError, and nothing sent, for bytes that parse_output_report refuses: this is the last gate before
        the controller, and no debug effect code passes it. DeviceError when the controller is gone.
        """
        del now_s
        handle = self._require_open()
        try:
            parse_output_report(report)
        except RemoteProtocolError as error:
            raise ValueError(f"report: {error}") from error
        self._written, self._released = True, False
        self._send(handle, report)

    def close(self) -> None:
        """Take effects and rumble off if any were written and the controller still answers; let it go."""
        handle, self._handle = self._handle, None
        if handle is None:
            return
        try:
            if self._written:
                self._send(handle, build_output_report(RELEASED))
                self._released = True
        except DeviceError:
            pass  # it is gone: nothing more can be told to it
        finally:
            handle.close()

    def _require_open(self) -> HidHandle:
        if self._handle is None:
            raise DeviceError("the controller is closed; open a new one")
        return self._handle

    @staticmethod
    def _send(handle: HidHandle, report: bytes) -> None:
        try:
            written = handle.write(report)
        except OSError as error:
            raise DeviceError(_gone(str(error))) from error
        if written < len(report):
            raise DeviceError(_gone(handle.error() or f"{written} of {len(report)} bytes written"))


def _is_bluetooth(report: bytes) -> bool:
    try:
        return transport_of_input(report) is Transport.BLUETOOTH
    except RemoteProtocolError:
        return False  # whoever parses it says what is wrong


def write_once(path: bytes, report: bytes) -> None:
    """Open the controller at `path`, send an output report as it is, and let go; DeviceError when that fails."""
    handle = load_backend().device()
    try:
        handle.open_path(path)
        handle.write(report)
    except OSError as error:
        raise DeviceError(_why_not_opened(path, handle.error() or str(error))) from error
    finally:
        handle.close()


def _find(backend: HidBackend) -> bytes:
    for product_id in PRODUCT_IDS:
        for found in backend.enumerate(SONY_VENDOR_ID, product_id):
            path = found["path"]
            if isinstance(path, bytes) and path:
                return path
    wanted = " or ".join(f"{name} ({SONY_VENDOR_ID:04X}:{pid:04X})" for pid, name in PRODUCT_IDS.items())
    raise DeviceError(
        f"no {wanted} found: connect one by USB cable (a cable that carries data), {_WITHOUT};"
        " in a container or virtual machine, pass the device through"
    )


def _why_not_opened(path: bytes, reason: str) -> str:
    name = os.fsdecode(path)
    denied = Path(name).exists() and not os.access(name, os.R_OK | os.W_OK)
    if sys.platform == "linux" and (denied or "permission denied" in reason.lower()):
        return (
            f"no permission to open the controller at {name}: put these lines into"
            f" /etc/udev/rules.d/70-dualsense.rules\n{_UDEV_RULES}\n"
            "then run: sudo udevadm control --reload && sudo udevadm trigger; and plug the controller in again"
        )
    return (
        f"the controller at {name} cannot be opened ({reason}): close other programs that use it (Steam Input),"
        f" plug it in again, {_WITHOUT}"
    )


def _gone(reason: str) -> str:
    return f"the controller is gone ({reason}): plug it in again and start anew"
