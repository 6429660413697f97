"""Interface that every controller implements, real or simulated."""

import re
import reprlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState

_ADDRESS: Final = re.compile("[0-9a-f]{2}(:[0-9a-f]{2}){5}")


class Controller(Protocol):
    """An open controller. Any method may raise DeviceError, whose text gives the remedy."""

    @property
    def released(self) -> bool:
        """Whether, as far as is known, the triggers do not resist and the motors do not run."""

    def read(self, now_s: float) -> ControllerState | None:
        """Return the newest state, without waiting; None if there is no new state since the last call.

        After none for SILENT_S (`silence.py`) the controller counts as gone. A state that is only repeated is not new.
        """

    def write(self, feel: Feel, now_s: float) -> None:
        """Set the parts of `feel` that are not None."""

    def close(self) -> None:
        """Switch off resistance, rumble and a warning light if any were written, and close the controller.

        Safe to call again; nothing else is called afterwards.
        """


@dataclass(frozen=True)
class OpenController:
    """A controller that a search has opened."""

    device: Controller
    name: str
    """Model and transport, in words"""
    address: str | None = None
    """Address "aa:bb:cc:dd:ee:ff", the same on USB and Bluetooth; None if the controller reported none."""
    path: bytes | None = None
    """Device node, for the watchdog; None if nothing needs to be released when this process dies."""
    release: bytes = b""
    """Report that the watchdog writes to `path` to switch all effects off."""
    stalls: Callable[[float], bool] = lambda _: False
    """Function that returns whether a write to `device` hangs at a time `now_s`."""


def checked_address(address: object, name: str = "address") -> str:
    """Return `address`; ValueError, which begins with `name`, unless it has the form "aa:bb:cc:dd:ee:ff"."""
    if not isinstance(address, str) or not _ADDRESS.fullmatch(address):
        raise ValueError(
            f"{name} = {reprlib.repr(address)}; valid: six pairs of hexadecimal digits like aa:bb:cc:dd:ee:ff"
        )
    return address


def check_choice(device: str, controller: str | None) -> None:
    """Check the flags --device and --controller: ValueError unless `controller` is None, or an address for "hid"."""
    if controller is None:
        return
    checked_address(controller, "controller")
    if device != "hid":
        raise ValueError(f"--controller with --device {device}; valid: with --device hid")
