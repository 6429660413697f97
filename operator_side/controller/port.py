"""Port that every controller implements, real or not."""

import re
import reprlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState

_ADDRESS: Final = re.compile("[0-9a-f]{2}(:[0-9a-f]{2}){5}")


class Controller(Protocol):
    """An open controller. Any method may raise DeviceError; the text gives the remedy."""

    @property
    def released(self) -> bool:
        """Whether both triggers are free and the motors still, as far as is known."""

    def read(self, now_s: float) -> ControllerState | None:
        """Return the newest state and skip older ones; None without a new one. Never waits."""

    def write(self, feel: Feel, now_s: float) -> None:
        """Set the parts that `feel` holds."""

    def close(self) -> None:
        """Switch off resistance, rumble and a warning light if any were written, and close the controller.

        Safe to call again; nothing else is called afterwards.
        """


@dataclass(frozen=True)
class OpenController:
    """A controller that a search has opened."""

    device: Controller
    name: str
    """Model and transport, for people."""
    address: str | None = None
    """Address "aa:bb:cc:dd:ee:ff", the same on USB and Bluetooth; None when it did not answer."""
    path: bytes | None = None
    """Device node, for the guard; None if nothing must be released after this process dies."""
    release: bytes = b""
    """Report that the guard writes to that node to switch everything off."""
    stalls: Callable[[float], bool] = lambda _: False
    """Whether at `now_s` a write hangs: then `device` cannot reach the controller."""


def checked_address(address: object) -> str:
    """Return `address`; ValueError unless it has the form "aa:bb:cc:dd:ee:ff"."""
    if not isinstance(address, str) or not _ADDRESS.fullmatch(address):
        raise ValueError(
            f"address = {reprlib.repr(address)}; valid: six pairs of hexadecimal digits like aa:bb:cc:dd:ee:ff"
        )
    return address
