"""The Device port: what feelahead asks of a controller, real or simulated.

Input reports come as bytes, to be read by input_report.py; what to do goes as a value.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from operator_side.dualsense.reports.output_report import OutputReport


class Device(Protocol):
    """A controller that is open. Any method may raise DeviceError; the text says what to do about it."""

    @property
    def released(self) -> bool:
        """Both triggers are free of any effect, as far as anybody can know."""
        ...

    def read(self, now_s: float) -> bytes | None:
        """The newest input report, older unread ones skipped, or None when there is no new one; never waits."""
        ...

    def write(self, output: OutputReport, now_s: float) -> None:
        """Have the controller do what `output` sets; ValueError, and nothing sent, for an effect never to be sent."""
        ...

    def close(self) -> None:
        """Take trigger effects, rumble and a warning light off if any were written, and let the controller go.

        Safe to call again; everything else raises DeviceError afterwards.
        """
        ...


def _never_stalls(now_s: float) -> bool:
    del now_s
    return False


@dataclass(frozen=True)
class OpenController:
    """A controller that a search has found and opened."""

    device: Device
    name: str
    """Model and transport, for people."""
    address: str | None = None
    """Address "aa:bb:cc:dd:ee:ff", the same on USB and Bluetooth; None when it did not answer."""
    path: bytes | None = None
    """Device node; None without hardware."""
    release: bytes = b""
    """Output report, ready for the wire, that takes every effect off; for the watchdog."""
    stalls: Callable[[float], bool] = _never_stalls
    """Whether a write does not return, at `now_s`: then nothing can be said to the controller by `device`."""
