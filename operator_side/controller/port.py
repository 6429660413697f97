"""The port: what feelahead asks of any controller, real or not."""

import re
import reprlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState

_ADDRESS: Final = re.compile("[0-9a-f]{2}(:[0-9a-f]{2}){5}")


class Controller(Protocol):
    """A controller that is open. Any method may raise DeviceError; the text says what to do about it."""

    @property
    def released(self) -> bool:
        """Both triggers are free and the motors stand, as far as anybody can know."""

    def read(self, now_s: float) -> ControllerState | None:
        """The newest state, older unread ones skipped, or None when there is no new one; never waits."""

    def write(self, feel: Feel, now_s: float) -> None:
        """Have the controller do what `feel` sets."""

    def close(self) -> None:
        """Take resistance, rumble and a warning light off if any were written, and let the controller go.

        Safe to call again; nothing else is called afterwards.
        """


@dataclass(frozen=True)
class OpenController:
    """A controller that a search has found and opened."""

    device: Controller
    name: str
    """Model and transport, for people."""
    address: str | None = None
    """Address "aa:bb:cc:dd:ee:ff", the same on USB and Bluetooth; None when it did not answer."""
    path: bytes | None = None
    """Device node, for the guard; None where nothing has to be released after our death."""
    release: bytes = b""
    """What the guard writes to that node to take everything off."""
    stalls: Callable[[float], bool] = lambda _: False
    """Whether a write does not return, at `now_s`: then nothing can be said to the controller by `device`."""


def checked_address(address: object) -> str:
    """Return `address` if it has the form "aa:bb:cc:dd:ee:ff"; ValueError for anything else."""
    if not isinstance(address, str) or not _ADDRESS.fullmatch(address):
        raise ValueError(
            f"address = {reprlib.repr(address)}; valid: six pairs of hexadecimal digits like aa:bb:cc:dd:ee:ff"
        )
    return address
