"""Watchdog: a small process that releases the triggers if the operator side is killed or hangs.

The operator side writes these lines to the watchdog's standard input:

    hold PATH REPORT    a controller is in use: write REPORT to PATH to release it (both in hexadecimal)
    let-go              the controller is no longer in use, or has been released already
    beat                an effect is on, or about to be; the next beat or `rest` follows within SILENCE_S
    rest                no effect is on; no beat is due

If the input closes while a controller is held, the operator side has died (kill -9, a crash): the watchdog writes the
report and ends. If beats stop, the operator side hangs (kill -STOP, a write that never returns): the watchdog writes
the report once, and waits for further lines. It answers each `hold` on its standard output: `held`, or `refused` if the
controller cannot be opened.

The file is run by `python -I -S`, to start in some 10 ms and to need little memory. It imports only modules that Python
has loaded anyway.
"""

import os
import select
import signal
import sys
import time

SILENCE_S = 0.2
"""Maximum time without a beat while an effect is on, in seconds"""
_ATTEMPTS = 3
"""Number of attempts to write the report: a transfer may fail once. If the controller is gone, each fails at once"""


class Target:
    """Controller to release, opened when it is held, as its path may belong to another device later."""

    def __init__(self, path: bytes, report: bytes) -> None:
        self._report = report
        try:
            # Opening must not block, whatever is at that path; a write may still wait in the kernel.
            self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
        except OSError:
            self._file = -1  # no remedy: the operator side has no better access
        self.usable = self._file >= 0

    def release(self) -> None:
        """Write the report that releases the controller; ignore errors."""
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
        """answer_file: file descriptor to which the answer to each `hold` is written."""
        self._answer_file = answer_file
        self._target: Target | None = None
        self._deadline_s: float | None = None

    def patience_s(self, now_s: float) -> float | None:
        """Return the seconds left until the next beat must come; None if no beat is due."""
        return None if self._deadline_s is None else max(0.0, self._deadline_s - now_s)

    def execute(self, line: bytes, now_s: float) -> None:
        """Execute one line of the input; ignore an unknown one."""
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
        """Write the report, if a controller is held; no beat is due until beats begin again."""
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
    """Execute the lines of the input until it closes. Release the controller then, and whenever beats stop."""
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
            watched.execute(line, time.monotonic())
    # An incomplete last line is ignored.
    watched.release()


def _readable(file: int, patience_s: float | None) -> bool:
    """Wait until the file has input or is closed; return False if neither happens within `patience_s`."""
    return bool(select.select([file], [], [], patience_s)[0])


def main() -> None:
    """Run the watchdog. Signals that stop the operator side are ignored: closing the input ends the watchdog."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    os.set_blocking(sys.stdout.fileno(), False)  # lose an answer rather than block
    watch(sys.stdin.fileno(), sys.stdout.fileno())


if __name__ == "__main__":
    main()
