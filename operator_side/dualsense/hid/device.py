"""Real DualSense over HID. Only this file imports hidapi, and only when a controller is searched for."""

import contextlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from common.errors import DeviceError, NoDeviceError, NoDriverError, RemoteProtocolError
from common.extras import installing
from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState
from operator_side.dualsense.reports.feature_report import (
    ADDRESS_ID,
    FEATURE_LENGTHS,
    FIRMWARE_ID,
    Firmware,
    parse_address,
)
from operator_side.dualsense.reports.input_report import parse_input_report, stamp_of
from operator_side.dualsense.reports.output_report import build_output_report
from operator_side.dualsense.reports.transport import Transport, is_simple_report, transport_of_input

Read = TypeVar("Read")
HidHandle = Any
"""A `device` object of hidapi, which has no types"""
HidBackend = Any
"""A module of hidapi, `hidraw` or `hid`"""

_INSTALL: Final = "pip install --force-reinstall hidapi"
"""Remedy: reinstalls hidapi over another package's module. It works also if feelahead itself is not installed."""
_WITHOUT: Final = "run without a controller: --device simulated"

_READ_LENGTH: Final = 128  # longer than any report, so that none is cut
_MAX_DRAINED: Final = 64  # size of the kernel's hidraw queue; more is left for the next read
_FIRST_REPORT_MS: Final = 100
_FIRST_REPORT_ATTEMPTS: Final = 5
_MOST_REPEATS: Final = 64
"""Number of equal reports after which a controller counts as absent; a dongle may send each of its own several times"""
_FEATURE_ATTEMPTS: Final = 3
"""Number of attempts to read a feature report, as radio may garble one (Linux hid-playstation also repeats)"""


def load_backend() -> HidBackend:
    """Import hidapi; NoDriverError if hidapi is missing or broken, or if another package has replaced its module.

    Of the two modules of hidapi's wheel, this imports `hidraw`, for the kernel's hidraw devices; `hid` uses libusb.
    """
    try:
        import hidraw as module  # noqa: PLC0415
    except Exception as error:  # another package's module may raise anything
        if isinstance(error, ModuleNotFoundError) and error.name == "hidraw":
            raise NoDriverError("hidapi is not installed", f"{_WITHOUT}; or {installing('operator')}") from error
        raise NoDriverError(
            f"hidapi cannot be imported ({type(error).__name__}: {error})",
            f"{_INSTALL}, after pip uninstall hid if that other package is there; or {_WITHOUT}",
        ) from error
    if not hasattr(module, "device") or not hasattr(module, "enumerate"):
        place = getattr(module, "__file__", None)
        raise NoDriverError(
            f"the module {module.__name__} at {place} is not hidapi's",
            f"uninstall the package that brings it, then {_INSTALL}",
        )
    return module


@dataclass(frozen=True)
class Identity:
    """Facts that a controller reports about itself; None for those that it does not report."""

    transport: Transport
    address: str | None
    """Bluetooth address, "aa:bb:cc:dd:ee:ff", which the controller also reports on USB"""
    firmware: Firmware | None
    first_report: bytes
    """Input report whose id and length show the transport"""


class HidDualSense:
    """Open DualSense on USB or Bluetooth, as a `Controller`. One thread may read while another one writes."""

    def __init__(self, backend: HidBackend, path: bytes) -> None:
        """Open the controller at `path` and read its facts, which takes the time of a few reports.

        On Bluetooth, this also makes the controller send full reports. DeviceError gives the fault and the remedy.
        """
        self._place = os.fsdecode(path)
        self._reading, self._writing = _open(backend, path)
        try:
            self.identity: Final = _ask(self._reading, path)
            self._reading.set_nonblocking(1)
        except OSError as error:
            self._close_handles()
            raise _gone(str(error)) from error
        except DeviceError:
            self._close_handles()
            raise
        self._closed = False
        self._stamp = stamp_of(self.identity.first_report)
        self._sequence = 0
        self._written = False
        self._released = True
        self._commanded = Feel()

    @property
    def released(self) -> bool:
        """Whether the last effects written neither resist nor rumble; False after a failed write."""
        return self._released

    def read(self, now_s: float) -> ControllerState | None:
        """Return the state in the newest valid report, without waiting; None if no new one came since the last call.

        A report that repeats the one before is not new: a dongle repeats the last report of a controller that is off,
        for ever. DeviceError if the controller is gone.
        """
        del now_s  # a real controller has its own clock
        self._require_open()
        drained: list[list[int]] = []
        try:
            for _ in range(_MAX_DRAINED):
                report = self._reading.read(_READ_LENGTH)
                if not report:
                    break
                drained.append(report)
        except OSError as error:
            raise _gone(str(error)) from error
        for report in map(bytes, reversed(drained)):
            # Bluetooth may have sent simple reports before full ones were requested.
            with contextlib.suppress(RemoteProtocolError):
                state, before = parse_input_report(report), self._stamp
                self._stamp = stamp_of(report)
                return None if self._stamp == before else state
        return None

    def check_presence(self) -> None:
        """Wait for a report that does not repeat the first one; if none comes, close and raise NoDeviceError.

        Bluetooth's simple reports are taken for present, as nothing in them shows a repetition. DeviceError if the
        controller is gone.
        """
        left = 0 if self._stamp is None else _MOST_REPEATS
        try:
            while left > 0:
                report = bytes(self._reading.read(_READ_LENGTH, _FIRST_REPORT_MS))
                if (stamp := stamp_of(report)) not in (None, self._stamp):
                    self._stamp = stamp
                    return
                left -= 1 if report else _MOST_REPEATS // _FIRST_REPORT_ATTEMPTS
        except OSError as error:
            self.close()
            raise _gone(str(error)) from error
        if self._stamp is not None:
            self.close()
            raise NoDeviceError(
                f"the controller at {self._place} repeats one report, as a dongle does whose controller is off or out"
                " of reach",
                "press its PS button",
            )

    def write(self, feel: Feel, now_s: float) -> None:
        """Send an output report that sets the effects of `feel`; DeviceError if the controller is gone.

        ValueError from `build_output_report`, and nothing is sent, if the report would have a forbidden effect code.
        """
        del now_s
        self._require_open()
        report = self._packed(feel)
        self._written, self._released = True, False
        _write(self._writing, report)
        self._commanded = feel.completed_from(self._commanded)
        self._released = self._commanded.releases

    def close(self) -> None:
        """Switch off resistance, rumble and a warning light, if anything was written, and close the controller."""
        if self._closed:
            return
        self._closed = True
        try:
            if self._written:
                _write(self._writing, self._packed(self._commanded.farewell))
                self._released = True
        except DeviceError:
            pass  # the controller is gone: nothing can be written
        finally:
            self._close_handles()

    def _close_handles(self) -> None:
        self._reading.close()
        self._writing.close()

    def _require_open(self) -> None:
        if self._closed:
            raise DeviceError("the controller is closed; open a new one")

    def _packed(self, feel: Feel) -> bytes:
        report = build_output_report(feel, self.identity.transport, self._sequence)
        self._sequence += 1
        return report


def _open(backend: HidBackend, path: bytes) -> tuple[HidHandle, HidHandle]:
    """Open the controller twice; return the handle to read from and the handle to write to.

    Two handles are needed, because two threads use them (background_writes.py): hidapi keeps an error text with each
    handle and frees it in every call. Both are opened now, as the path may belong to another device later.
    """
    handles: list[HidHandle] = []
    for _ in range(2):
        handle = backend.device()
        try:
            handle.open_path(path)
        except OSError as error:
            for opened in handles:
                opened.close()
            raise _not_opened(path, handle.error() or str(error)) from error
        handles.append(handle)
    return handles[0], handles[-1]


def _write(handle: HidHandle, report: bytes) -> None:
    try:
        written = handle.write(report)
    except OSError as error:
        raise _gone(str(error)) from error
    if written < len(report):
        raise _gone(handle.error() or f"only {written} of {len(report)} bytes were written")


def _ask(handle: HidHandle, path: bytes) -> Identity:
    """Read the controller's facts; OSError if the controller disappears meanwhile."""
    # On Bluetooth a controller first sends short reports; reading a feature makes it send full ones.
    _feature(handle, FIRMWARE_ID, bytes)
    first_report = _first_report(handle, path)
    try:
        transport = transport_of_input(first_report)
    except RemoteProtocolError as error:
        raise DeviceError(
            f"the controller at {os.fsdecode(path)} does not speak as a DualSense does ({error})",
            "plug it in again; imitations are not supported",
        ) from error
    return Identity(
        transport=transport,
        address=_feature(handle, ADDRESS_ID, lambda report: parse_address(report, transport)),
        firmware=_feature(handle, FIRMWARE_ID, lambda report: Firmware.parse(report, transport)),
        first_report=first_report,
    )


def _first_report(handle: HidHandle, path: bytes) -> bytes:
    """Return the first full input report, or a simple one if no full one comes; DeviceError if none comes."""
    newest = b""
    for _ in range(_FIRST_REPORT_ATTEMPTS):
        newest = bytes(handle.read(_READ_LENGTH, _FIRST_REPORT_MS)) or newest
        if newest and not is_simple_report(newest):
            return newest
    if not newest:
        raise DeviceError(
            f"the controller at {os.fsdecode(path)} sends nothing",
            "press its PS button, and plug it in again if that does not help",
        )
    return newest


def _feature(handle: HidHandle, report_id: int, parse: Callable[[bytes], Read]) -> Read | None:
    """Read a feature report and decode it by `parse`; None without a valid answer after several attempts."""
    for _ in range(_FEATURE_ATTEMPTS):
        try:
            return parse(bytes(handle.get_feature_report(report_id, FEATURE_LENGTHS[report_id])))
        except (OSError, RemoteProtocolError):
            continue
    return None


def _not_opened(path: bytes, reason: str) -> DeviceError:
    """Make the error for a controller that cannot be opened, with the remedy."""
    name = os.fsdecode(path)
    denied = os.path.exists(name) and not os.access(name, os.R_OK | os.W_OK)  # noqa: PTH110  # hidapi's names need not be paths
    if denied or "permission denied" in reason.lower():
        return DeviceError(
            f"no permission to open the controller at {name}",
            "`feelahead doctor` prints the udev rule that grants it, and the command that puts it in place",
        )
    return DeviceError(
        f"the controller at {name} cannot be opened ({reason})",
        "close other programs that use it (Steam Input), plug it in again, or run without one: --device simulated",
    )


def _gone(reason: str) -> DeviceError:
    """Make the error for a controller that no longer answers, with the remedy."""
    return DeviceError(f"the controller is gone ({reason})", "plug it in again, or press its PS button")
