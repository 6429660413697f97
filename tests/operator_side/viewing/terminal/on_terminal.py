"""Program on a pseudo-terminal whose other end the test reads and writes."""

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import termios
import time
from collections.abc import Callable, Sequence

from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.repository import ROOT

ENTERED, LEFT = b"\x1b[?1049h", b"\x1b[?1049l"


class OnTerminal:
    """Command that runs on its own pseudo-terminal, of 80 x 24 characters."""

    def __init__(self, command: Sequence[str]) -> None:
        self.ours, self.theirs = pty.openpty()
        self.seen = b""
        self.resize(80, 24)
        self.before = termios.tcgetattr(self.ours)
        environment = {**os.environ, "TERM": "xterm", "LC_ALL": "C.UTF-8", "PYTHONPATH": str(ROOT)}
        ends = {"stdin": self.theirs, "stdout": self.theirs, "stderr": subprocess.PIPE}
        self.process = subprocess.Popen(command, **ends, env=environment, start_new_session=True, text=True)  # type: ignore[call-overload]

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()
        os.close(self.ours)
        os.close(self.theirs)

    def resize(self, columns: int, rows: int) -> None:
        fcntl.ioctl(self.ours, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def read_until(self, holds: Callable[[bytes], object]) -> None:
        end_s = time.monotonic() + LIMIT_S
        while not holds(self.seen):
            assert time.monotonic() < end_s, self.seen[-2000:]
            if select.select([self.ours], [], [], 0.1)[0]:
                self.seen += os.read(self.ours, 1 << 16)

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        self.read_until(lambda _: self.process.poll() is not None)
        while select.select([self.ours], [], [], 0.0)[0]:
            self.seen += os.read(self.ours, 1 << 16)
        return int(self.process.returncode)

    def is_put_back(self) -> bool:
        after = self.seen.rpartition(ENTERED)[2]
        return LEFT in after and b"\x1b[?25h" in after and termios.tcgetattr(self.ours) == self.before
