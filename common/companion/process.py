"""Start and end of a companion, on both ends."""

import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from typing import Final, Self

from common.companion.channel import Channel

_END_LIMIT_S: Final = 2.0


class Companion:
    """Python process at the other end of `channel`: it ends with the channel, however we end."""

    def __init__(
        self,
        module: str,
        arguments: Sequence[str] = (),
        room_bytes: int = 1 << 23,
        output: int = subprocess.DEVNULL,
    ) -> None:
        """Run `module`, whose main function calls `companion_channel`; both processes share standard error.

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
                # Ctrl-C reaches only us.
                start_new_session=True,
            )
        self.channel = Channel(ours, room_bytes)

    @property
    def process_id(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet."""
        return self._process.poll() is None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self, limit_s: float = _END_LIMIT_S) -> bool:
        """Close the channel, wait `limit_s` for the process, then kill it; return whether it ended by itself.

        Waiting bytes are lost; to send them first, call `channel.flush` until nothing waits.
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
    """Return the companion's end of the channel and the other arguments; from now on stop signals are ignored."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    return Channel(socket.socket(fileno=int(arguments[0])), room_bytes), list(arguments[1:])
