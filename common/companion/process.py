"""Start and end of a companion process, in the process that starts it and in the companion."""

import contextlib
import math
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Self

from common.companion.channel import Channel

_END_LIMIT_S: Final = 2.0
_LOOK_S: Final = 0.25
"""Time between two looks at whether a companion works, in seconds"""


class Companion:
    """Python process at the other end of `channel`. It ends when the channel ends, even if this process is killed."""

    def __init__(
        self,
        module: str,
        arguments: Sequence[str] = (),
        room_bytes: int = 1 << 23,
        output: int = subprocess.DEVNULL,
    ) -> None:
        """Run `module`, whose main function calls `companion_channel`; both processes share standard error.

        `room_bytes`: as in Channel. `output`: a descriptor of ours that becomes the standard output of the companion.
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
        self._computed = "", ""

    @property
    def process_id(self) -> int:
        """Process id of the companion."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the companion has not ended yet."""
        return self._process.poll() is None

    @property
    def code(self) -> int:
        """Exit code of the ended process; minus the signal's number if a signal ended it, 0 while it runs."""
        return self._process.poll() or 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def works(self) -> bool:
        """Return whether the companion computes, waits for a disk, or has computed since the last call.

        One that is stopped, or waits for what never comes, does not.
        """
        try:
            fields = Path(f"/proc/{self.process_id}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        except OSError:
            return self.running  # a system without /proc
        before, self._computed = self._computed, (fields[11], fields[12])
        return fields[0] in "RD" or self._computed != before

    def close(self, limit_s: float = _END_LIMIT_S, idle_s: float = math.inf) -> bool:
        """Close the channel and wait for the companion to end; kill it after `limit_s`, or if it idles for `idle_s`.

        Return whether it ended by itself. Bytes in the send queue are lost; to send them first, call `channel.flush`
        until `channel.waiting` is 0.
        """
        self.channel.close()
        idled_s = 0.0
        while limit_s > 0.0 and idled_s < idle_s:
            step_s = min(_LOOK_S, limit_s)
            limit_s -= step_s
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(step_s)
                return True
            idled_s = 0.0 if self.works() else idled_s + step_s
        if self._process.poll() is not None:
            return True
        self._process.kill()
        self._process.wait()
        return False


def companion_channel(arguments: Sequence[str], room_bytes: int = 1 << 23) -> tuple[Channel, list[str]]:
    """In a companion: return its end of the channel and its other arguments; from now on it ignores stop signals."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    return Channel(socket.socket(fileno=int(arguments[0])), room_bytes), list(arguments[1:])
