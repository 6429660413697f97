"""The Device port: what feelahead asks of a controller, real or simulated.

Bytes only: input_report.py and output_report.py know what is in them.
"""

from typing import Protocol


class Device(Protocol):
    """A controller that is open. Any method may raise DeviceError; the text says what to do about it."""

    def read(self, now_s: float) -> bytes | None:
        """The newest input report, older unread ones skipped, or None when there is no new one; never waits."""
        ...

    def write(self, report: bytes, now_s: float) -> None:
        """Send an output report; ValueError, and nothing sent, for one that output_report.py cannot read."""
        ...

    def close(self) -> None:
        """Take the trigger effects and the rumble off if any were written, and let the controller go.

        Safe to call again; everything else raises DeviceError afterwards.
        """
        ...
