"""Control of the watchdog process, which releases the controller if the operator side is killed or hangs."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Final

_WATCHDOG = Path(__file__).with_name("release_watchdog.py")
_END_TIMEOUT_S = 2.0
"""Seconds to wait for the watchdog's end before it is killed; usually it takes milliseconds"""
MOST_REPLACEMENTS: Final = 3
"""Maximum number of times that an ended watchdog is replaced, as the cause would end the next one, too"""
_LEFT_ALONE: Final = "should this one be killed or hang now, the triggers stay as stiff as they are"


class ReleaseGuard:
    """Watchdog process that runs while the context is open."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._replacements = 0
        self._held: tuple[bytes, bytes] | None = None
        self._answers = b""
        self._given_up = False

    def __enter__(self) -> "ReleaseGuard":
        self._process = _started()
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is None:
            return
        # If the controller could not be released, the watchdog still holds it, and tries again when its input closes.
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(_END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    @property
    def running(self) -> bool:
        """Whether the watchdog process runs."""
        return self._process is not None and self._process.poll() is None

    def take_notes(self) -> list[str]:
        """Replace the watchdog if it has ended, which takes a few milliseconds; return new notes for the status."""
        if self._process is None or self._given_up:
            return []
        if self.running:
            return self._refusals()
        ended, self._process = self._process, None
        for stream in (ended.stdin, ended.stdout):
            if stream is not None:
                stream.close()
        self._answers = b""
        if self._replacements < MOST_REPLACEMENTS:
            self._replacements += 1
            with contextlib.suppress(OSError):
                self._process = _started()
        if self._process is None:
            self._given_up = True
            return [f"the watchdog process has ended, and there is no other: {_LEFT_ALONE}"]
        if self._held is not None:
            self.hold(*self._held)
        return ["the watchdog process has ended; another one has taken its place"]

    def hold(self, path: bytes, release: bytes) -> None:
        """Let the watchdog write `release` to the controller at `path` if this process dies or hangs from now on."""
        self._held = (path, release)
        self._say(f"hold {path.hex()} {release.hex()}")

    def let_go(self) -> None:
        """Cancel `hold`."""
        self._held = None
        self._say("let-go")

    def beat(self) -> None:
        """Report that an effect is on and this process runs; it counts as hanging if no beat or `rest` follows."""
        self._say("beat")

    def rest(self) -> None:
        """Report that no effect is on, so that no beat is due."""
        self._say("rest")

    def _say(self, line: str) -> None:
        if self._process is None or self._process.stdin is None:
            return
        # If the watchdog has ended, the run continues without one; `running` is False.
        with contextlib.suppress(OSError):
            self._process.stdin.write(f"{line}\n".encode("ascii"))

    def _refusals(self) -> list[str]:
        """Read the watchdog's answers since the last call, without waiting; return a note if it refused."""
        if self._process is None or self._process.stdout is None:
            return []
        self._answers += self._process.stdout.read(4096) or b""
        *answers, self._answers = self._answers.split(b"\n")
        return [f"the watchdog process cannot open the controller: {_LEFT_ALONE}"] if b"refused" in answers else []


def _started() -> subprocess.Popen[bytes]:
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", str(_WATCHDOG)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        bufsize=0,
        # A Ctrl-C in the terminal must not reach the watchdog.
        start_new_session=True,
    )
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            os.set_blocking(stream.fileno(), False)  # the loop must not block
    return process
