"""Our end of the watchdog: start it, and tell it which controller to release should we be killed."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import Protocol

_WATCHDOG = "operator_side.dualsense.release_watchdog"
_END_TIMEOUT_S = 0.5


class Guard(Protocol):
    """Whoever releases a controller when we cannot."""

    def hold(self, path: bytes, release: bytes) -> None:
        """From now on, should we die, `release` is to be written to the controller at `path`."""
        ...

    def let_go(self) -> None:
        """There is nothing to release any more."""
        ...


class ReleaseGuard:
    """The watchdog process, from the opening of the context to its end."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._told = False

    def __enter__(self) -> "ReleaseGuard":
        self._process = subprocess.Popen(
            [sys.executable, *_arguments()],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            # A Ctrl-C in the terminal must not reach it before us.
            start_new_session=True,
        )
        if self._process.stdin is not None and sys.platform != "win32":
            os.set_blocking(self._process.stdin.fileno(), False)  # the loop waits for nobody
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process is None:
            return
        # It still holds a controller only if that could not be released: then it tries once more.
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(_END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    @property
    def process_id(self) -> int | None:
        """The operating system's number for the watchdog; None before it is started."""
        return None if self._process is None else self._process.pid

    @property
    def running(self) -> bool:
        """Whether there is anybody to release the triggers; False when somebody ended the watchdog."""
        return self._process is not None and self._process.poll() is None

    def take_note(self) -> str | None:
        """What a person has to know, once: that the watchdog has ended before us."""
        if self._told or self.running:
            return None
        self._told = True
        return "the watchdog process has ended: should this one be killed now, the triggers stay as stiff as they are"

    def hold(self, path: bytes, release: bytes) -> None:
        """From now on, should we die, `release` is to be written to the controller at `path`."""
        self._say(f"hold {path.hex()} {release.hex()}")

    def let_go(self) -> None:
        """There is nothing to release any more."""
        self._say("let-go")

    def _say(self, line: str) -> None:
        if self._process is None or self._process.stdin is None:
            return
        # Without the watchdog we go on; `running` tells.
        with contextlib.suppress(OSError):
            self._process.stdin.write(f"{line}\n".encode("ascii"))


def _arguments() -> list[str]:
    """How to run the watchdog: as a bare file where it needs nothing but Python itself."""
    if sys.platform == "linux":
        return ["-I", "-S", str(Path(__file__).with_name("release_watchdog.py"))]
    return ["-P", "-m", _WATCHDOG]
