"""Real DualSense over HID: the only file that imports hidapi, and only during a search for a controller."""

import contextlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from common.errors import DeviceError, NoDriverError, RemoteProtocolError
from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState
from operator_side.dualsense.reports.feature_report import (
    ADDRESS_ID,
    FEATURE_LENGTHS,
    FIRMWARE_ID,
    Firmware,
    parse_address,
)
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.output_report import build_output_report
from operator_side.dualsense.reports.transport import Transport, is_simple_report, transport_of_input

Read = TypeVar("Read")
HidHandle = Any
"""A `device` object of hidapi, which has no types"""
HidBackend = Any
"""A module of hidapi, `hidraw` or `hid`"""

_INSTALL: Final = "pip install --force-reinstall hidapi"
"""Forced, to replace another package's module; by its own name, as feelahead may run from a folder."""

_READ_LENGTH: Final = 128  # longer than any report, so that none is cut
_MAX_DRAINED: Final = 64  # size of the kernel's hidraw queue; more is left for the next read
_FIRST_REPORT_MS: Final = 100
_FIRST_REPORT_ATTEMPTS: Final = 5
_FEATURE_ATTEMPTS: Final = 3
"""Attempts to read a feature, which may be garbled by radio (Linux hid-playstation repeats, too)."""


def load_backend() -> HidBackend:
    """Import hidapi; NoDriverError if it is missing, broken or shadowed by the other package called `hid`.

    hidapi's wheel has two modules: `hidraw` for the kernel's hidraw devices, and `hid`, which uses libusb instead.
    """
    try:
        import hidraw as module  # noqa: PLC0415
    except Exception as error:  # another package's module may raise anything
        raise NoDriverError(
            f"hidapi cannot be imported ({type(error).__name__}: {error}): {_INSTALL}, after pip uninstall hid if that"
            " other package is there; or run without a controller: --device simulated"
        ) from error
    if not hasattr(module, "device") or not hasattr(module, "enumerate"):
        place = getattr(module, "__file__", None)
        raise NoDriverError(
            f"the module {module.__name__} at {place} is not hidapi's: uninstall the package that brings it, then"
            f" {_INSTALL}"
        )
    return module


@dataclass(frozen=True)
class Identity:
    """Facts that a controller reports about itself; None for missing ones."""

    transport: Transport
    address: str | None
    """Bluetooth address, "aa:bb:cc:dd:ee:ff", the same on USB."""
    firmware: Firmware | None
    first_report: bytes
    """Input report that reveals the transport."""


class HidDualSense:
    """Port on an open controller, on USB or Bluetooth: one thread may read, another one write."""

    def __init__(self, backend: HidBackend, path: bytes) -> None:
        """Open it and read its facts, which takes a few reports' time; DeviceError names the fault.

        On Bluetooth, this also switches it to full reports.
        """
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
        self._sequence = 0
        self._written = False
        self._released = True
        self._commanded = Feel()

    @property
    def released(self) -> bool:
        """Whether the effects written neither hold nor rumble; False after a write that failed."""
        return self._released

    def read(self, now_s: float) -> ControllerState | None:
        """Return the newest report's state, or None without a new one; never waits. DeviceError if it is gone.

        A bad report is ignored.
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
                return parse_input_report(report)
        return None

    def write(self, feel: Feel, now_s: float) -> None:
        """Send an output report in this controller's framing; DeviceError if the controller is gone.

        ValueError, and nothing sent, if build_output_report refuses: no debug effect code passes.
        """
        del now_s
        self._require_open()
        report = self._packed(feel)
        self._written, self._released = True, False
        _write(self._writing, report)
        self._commanded = feel.following(self._commanded)
        self._released = self._commanded.releases

    def close(self) -> None:
        """Switch off effects, rumble and a warning light if any were written and the controller answers; close it."""
        if self._closed:
            return
        self._closed = True
        try:
            if self._written:
                _write(self._writing, self._packed(self._commanded.farewell))
                self._released = True
        except DeviceError:
            pass  # it is gone: nothing can be written
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
    """Return the handles to read and to write by.

    hidapi keeps the text of the last failure with each handle and frees it with every call. So one handle must not be
    read and written concurrently (background_writes.py). Both are opened now, while the path is this controller's.
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
        raise _gone(handle.error() or f"{written} of {len(report)} bytes written")


def _ask(handle: HidHandle, path: bytes) -> Identity:
    """Read the controller's facts; OSError if it goes away meanwhile."""
    # Bluetooth starts with short reports; this ends them, so it comes before the first one is awaited.
    _feature(handle, FIRMWARE_ID, bytes)
    first_report = _first_report(handle, path)
    try:
        transport = transport_of_input(first_report)
    except RemoteProtocolError as error:
        raise DeviceError(
            f"the controller at {os.fsdecode(path)} does not speak as a DualSense does ({error}): plug it in again;"
            " imitations are not supported"
        ) from error
    return Identity(
        transport=transport,
        address=_feature(handle, ADDRESS_ID, lambda report: parse_address(report, transport)),
        firmware=_feature(handle, FIRMWARE_ID, lambda report: Firmware.parse(report, transport)),
        first_report=first_report,
    )


def _first_report(handle: HidHandle, path: bytes) -> bytes:
    """Return the first full report, or a simple one if nothing else comes."""
    newest = b""
    for _ in range(_FIRST_REPORT_ATTEMPTS):
        newest = bytes(handle.read(_READ_LENGTH, _FIRST_REPORT_MS)) or newest
        if newest and not is_simple_report(newest):
            return newest
    if not newest:
        raise DeviceError(
            f"the controller at {os.fsdecode(path)} sends nothing: press its PS button, and plug it in again if that"
            " does not help"
        )
    return newest


def _feature(handle: HidHandle, report_id: int, parse: Callable[[bytes], Read]) -> Read | None:
    """Read a feature by `parse`; None without a valid answer."""
    for _ in range(_FEATURE_ATTEMPTS):
        try:
            return parse(bytes(handle.get_feature_report(report_id, FEATURE_LENGTHS[report_id])))
        except (OSError, RemoteProtocolError):
            continue
    return None


def _not_opened(path: bytes, reason: str) -> DeviceError:
    """Make the error for a controller that the system does not let us open."""
    name = os.fsdecode(path)
    denied = os.path.exists(name) and not os.access(name, os.R_OK | os.W_OK)  # noqa: PTH110  # hidapi's names need not be paths
    if denied or "permission denied" in reason.lower():
        return DeviceError(
            f"no permission to open the controller at {name}: `feelahead doctor` prints the udev rule that grants it,"
            " and the command that puts it in place"
        )
    return DeviceError(
        f"the controller at {name} cannot be opened ({reason}): close other programs that use it (Steam Input), plug"
        f" it in again, or run without one: --device simulated"
    )


def _gone(reason: str) -> DeviceError:
    """Make the error for a controller that has just gone."""
    return DeviceError(f"the controller is gone ({reason}): plug it in again, or press its PS button")
