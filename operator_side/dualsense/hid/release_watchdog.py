"""Release the triggers after the operator side was killed: a small process that outlives it for a moment.

    hold PATH REPORT    a controller is in use: when everything else fails, write REPORT to it (both in hexadecimal)
    let-go              it is no longer in use, or has been released already
    beat                an effect is on, or about to be: the next beat follows within SILENCE_S, or `rest` does
    rest                no effect is on: no beat is due until the next one

These lines come on the standard input. If it closes while a controller is held, the writer has died without a word
(kill -9, a crash): the report is written and the process ends. If beats stop, the writer hangs (kill -STOP, a write
that never returns): the report is written, once for each silence.
Each `hold` is answered on the standard output: `held`, or `refused` if the controller cannot be opened.

The process runs as a bare file with `python -I -S`, to start in some 10 ms and to stay small. It imports only modules
that Python has loaded anyway.
"""

import os
import select
import signal
import sys
import time

SILENCE_S = 0.2
"""The longest time without a beat while an effect is on."""
_ATTEMPTS = 3
"""Attempts to write: a transfer can fail once, while a controller that is gone refuses each at once."""


class Target:
    """The controller, opened early: its path may be another device's later."""

    def __init__(self, path: bytes, report: bytes) -> None:
        self._report = report
        try:
            # Non-blocking, whatever is at that path; a write still waits where the kernel must.
            self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
        except OSError:
            self._file = -1  # no remedy: the operator side has no better access
        self.usable = self._file >= 0

    def release(self) -> None:
        """Write the report."""
        for _ in range(_ATTEMPTS):
            try:
                os.write(self._file, self._report)
                return
            except OSError:
                continue

    def close(self) -> None:
        """Close the controller."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


class Watch:
    """Controller that is held, and the deadline of the next beat."""

    def __init__(self, answer_file: int) -> None:
        """answer_file: where each `hold` is answered."""
        self._answer_file = answer_file
        self._target: Target | None = None
        self._deadline_s: float | None = None

    def patience_s(self, now_s: float) -> float | None:
        """Return the time left for the next beat; None for no limit."""
        return None if self._deadline_s is None else max(0.0, self._deadline_s - now_s)

    def follow(self, line: bytes, now_s: float) -> None:
        """Execute a line; ignore an unknown one."""
        words = line.split()
        if words == [b"beat"]:
            self._deadline_s = now_s + SILENCE_S
        elif words == [b"rest"]:
            self._deadline_s = None
        elif words == [b"let-go"]:
            self._take(None)
        elif len(words) == 3 and words[0] == b"hold":
            path, report = (bytes.fromhex(word.decode("ascii")) for word in words[1:])
            self._take(Target(path, report))

    def release(self) -> None:
        """Write the report, if a controller is held, and wait for no beat of this silence any more."""
        self._deadline_s = None
        if self._target is not None:
            self._target.release()

    def _take(self, target: Target | None) -> None:
        if self._target is not None:
            self._target.close()
        self._target, self._deadline_s = target, None
        if target is None:
            return
        try:  # noqa: SIM105  # contextlib is not loaded
            os.write(self._answer_file, b"held\n" if target.usable else b"refused\n")
        except OSError:
            pass  # the writer has died, or does not listen: continue


def watch(input_file: int, answer_file: int) -> None:
    """Execute the lines until they end; release what is held then, and whenever beats stop."""
    watched = Watch(answer_file)
    unfinished = b""
    while True:
        if not _readable(input_file, watched.patience_s(time.monotonic())):
            watched.release()
            continue
        chunk = os.read(input_file, 4096)
        if not chunk:
            break
        *lines, unfinished = (unfinished + chunk).split(b"\n")
        for line in lines:
            watched.follow(line, time.monotonic())
    # An incomplete line does not count.
    watched.release()


def _readable(file: int, patience_s: float | None) -> bool:
    """Wait for input or its end; False if nothing came in time."""
    return bool(select.select([file], [], [], patience_s)[0])


def main() -> None:
    """Run the watchdog; ignore the signals that stop the operator side, which ends us by closing the pipe."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    os.set_blocking(sys.stdout.fileno(), False)  # lose an answer rather than block
    watch(sys.stdin.fileno(), sys.stdout.fileno())


if __name__ == "__main__":
    main()
