"""Start of the companion process that renders pictures."""

import threading
from collections.abc import Callable
from typing import Final, Protocol

from common.companion.channel import Channel
from common.companion.process import Companion

MODULE: Final = "robot_side.viewing.companion"


class Renders(Protocol):
    """Part of the interface of a `Companion` that this module uses."""

    channel: Channel

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet"""
        ...

    def close(self, limit_s: float = ...) -> bool:
        """End the process."""
        ...


Start = Callable[[Callable[[Renders | str], None]], None]
"""Function that starts a companion. It passes the companion, or the reason of a failure, to its argument, at once or
later."""


def start_beside(done: Callable[[Renders | str], None]) -> None:
    """Start a companion in a thread, as starting a process takes milliseconds."""

    def begin() -> None:
        try:
            done(Companion(MODULE))
        except OSError as error:
            done(f"no process can be started: {error.strerror}")

    threading.Thread(target=begin, daemon=True).start()
