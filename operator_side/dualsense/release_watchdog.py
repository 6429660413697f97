"""A small process that outlives the operator side by a moment, to release the triggers when that was killed.

    hold PATH REPORT    a controller is in use: when everything else fails, write REPORT to it (both in hexadecimal)
    let-go              it is not in use any more, or has been released already

These lines come on the standard input. When that closes while a controller is held, whoever wrote them has died
without a word (kill -9, a crash): the report is written once and the process ends. Nothing is written before.

It is run as a bare file with `python -I -S` on Linux, so that it starts in some 10 ms and stays small: only modules
that Python has loaded anyway are imported. Elsewhere it needs hidapi, hence the whole environment.
"""

import os
import signal
import sys

_ATTEMPTS = 3
"""A transfer can fail once while the controller is there; one that is gone refuses each at once."""


class LinuxTarget:
    """The controller, opened while it is still known to be the one: its path may be another device's later."""

    def __init__(self, path: bytes, report: bytes) -> None:
        self._report = report
        try:
            # Not to wait, whatever stands at that path; writing waits none the less where the kernel must.
            self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
        except OSError:
            self._file = -1  # nothing can be done; the operator side itself has no better access

    def release(self) -> None:
        """Write the report."""
        for _ in range(_ATTEMPTS):
            try:
                os.write(self._file, self._report)
                return
            except OSError:
                continue

    def close(self) -> None:
        """Let the controller go."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


class HidapiTarget:
    """The controller by its path in hidapi, opened when it comes to that: some systems open it only once."""

    def __init__(self, path: bytes, report: bytes) -> None:
        self._path, self._report = path, report

    def release(self) -> None:
        """Open, write the report, close."""
        from operator_side.dualsense.device import write_once  # noqa: PLC0415  # needs hidapi

        write_once(self._path, self._report)

    def close(self) -> None:
        """Nothing is open."""


Target = LinuxTarget | HidapiTarget


def watch(input_file: int) -> None:
    """Follow the lines until they end, and release what is held then."""
    target: Target | None = None
    unfinished = b""
    while chunk := os.read(input_file, 4096):
        *lines, unfinished = (unfinished + chunk).split(b"\n")
        for line in lines:
            if target is not None:
                target.close()
            target = _target(line)
    # A line that is cut off was never said.
    if target is not None:
        target.release()
        target.close()


def _target(line: bytes) -> Target | None:
    words = line.split()
    if len(words) != 3 or words[0] != b"hold":
        return None
    path, report = (bytes.fromhex(word.decode("ascii")) for word in words[1:])
    return LinuxTarget(path, report) if sys.platform == "linux" else HidapiTarget(path, report)


def main() -> None:
    """Ignore what stops the operator side, which ends us by closing the pipe."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):  # Windows has no SIGHUP
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    watch(sys.stdin.fileno())


if __name__ == "__main__":
    main()
