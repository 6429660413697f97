"""Start a companion and end it; what a companion does first."""

import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from typing import Final, Self

from common.companion.channel import Channel

_END_LIMIT_S: Final = 2.0


class Companion:
    """A Python process of ours at the other end of `channel`: it ends when the channel does, however we end."""

    def __init__(
        self,
        module: str,
        arguments: Sequence[str] = (),
        room_bytes: int = 1 << 23,
        output: int = subprocess.DEVNULL,
    ) -> None:
        """Run `module`, whose main function calls `companion_channel`; its errors go where ours go.

        `output`: a descriptor of ours that becomes its standard output.
        """
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                # -P: a folder named `common` in the working directory must not shadow the package.
                [sys.executable, "-P", "-m", module, str(theirs.fileno()), *arguments],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=output,
                # Ctrl-C reaches us alone.
                start_new_session=True,
            )
        self.channel = Channel(ours, room_bytes)

    @property
    def process_id(self) -> int:
        """The operating system's number for it."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self, limit_s: float = _END_LIMIT_S) -> bool:
        """Close the channel and wait for its end, `limit_s` at most, before it is killed; whether it ended by itself.

        What has not left yet is lost: whoever minds calls `channel.flush` until nothing waits.
        """
        self.channel.close()
        try:
            self._process.wait(limit_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            return False
        return True


def companion_channel(arguments: Sequence[str], room_bytes: int = 1 << 23) -> tuple[Channel, list[str]]:
    """In the companion: its end of the channel, and the arguments after it. It outlives signals, not the channel."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    return Channel(socket.socket(fileno=int(arguments[0])), room_bytes), list(arguments[1:])
