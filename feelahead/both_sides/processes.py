"""Sides as child processes, which report events to this process as lines of JSON."""

import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from typing import Any, Self

from common.command.launch import PARENT_VARIABLE
from common.errors import ConfigurationError, FeelaheadError

_BAD_INPUT = 2


def flag_of(name: str, value: object) -> str:
    """Return the flag of a side that sets its setting `name` to `value`."""
    flag = name.replace("_", "-")
    switch = f"--{flag}" if value else f"--no-{flag}"
    return switch if isinstance(value, bool) else f"--{flag}={value}"


class SideFailedError(FeelaheadError):
    """A side ended with an error (the text is the side's), ended early, or reported nothing in time."""


class StartedSide:
    """Side with `--status json`, started by a command; a thread reads its output, so that the side never blocks."""

    def __init__(self, name: str, command: Sequence[str]) -> None:
        """Start `command`; `name` is the side's name in messages."""
        self.name = name
        self._errors = tempfile.TemporaryFile(mode="w+", encoding="utf-8", errors="replace")  # noqa: SIM115  # closed by __exit__
        self._process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            stdin=subprocess.DEVNULL,
            text=True,
            env={**os.environ, PARENT_VARIABLE: str(os.getpid())},
            # Ctrl-C reaches only this process, which then ends the sides in order.
            start_new_session=True,
        )
        self._interrupted = False
        self._has_spoken = False
        self._events: queue.Queue[dict[str, Any]] = queue.Queue(maxsize=1000)
        self._kept_events: list[dict[str, Any]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._reader.join(timeout=1.0)
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()

    @property
    def process_id(self) -> int:
        """Id of the side's process."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet."""
        return self._process.poll() is None

    def events(self) -> list[dict[str, Any]]:
        """Return the events since the last call."""
        said, self._kept_events = self._kept_events, []
        while not self._events.empty():
            said.append(self._events.get_nowait())
        return said

    def wait_for(self, kind: str, timeout_s: float) -> dict[str, Any]:
        """Return the next event of this kind; the next `events` returns those of other kinds before it.

        Raises SideFailedError if the side ends, or if no event of any kind comes for `timeout_s`.
        """
        while True:
            try:
                event = self._events.get(timeout=timeout_s)
            except queue.Empty:
                self.check()
                raise SideFailedError(f"the {self.name} side did not report for {timeout_s:g} s") from None
            if event["event"] == kind:
                return event
            if event["event"] == "end":
                self._process.wait(timeout=10.0)
                self.check()
                raise SideFailedError(f"the {self.name} side ended early")
            self._kept_events.append(event)

    def check(self) -> None:
        """Raise SideFailedError, with the side's last line, if the side ended with an error.

        Raise ConfigurationError instead if the side refused its arguments.
        """
        code = self._process.poll()
        if self._interrupted and not self._has_spoken:
            # Our interrupt came before the side could handle signals: its exit code is no error.
            return
        if code not in (None, 0):
            self._errors.seek(0)
            said = self._errors.read().strip().splitlines()
            reason = said[-1] if said else "no reason was printed"
            if code == _BAD_INPUT:
                # The user's arguments were passed on to the side, so the fault is in them.
                raise ConfigurationError(reason.partition(": ")[2] or reason)
            raise SideFailedError(f"the {self.name} side ended with code {code}: {reason}")

    def interrupt(self) -> None:
        """Interrupt the side as Ctrl-C does, once only: a second signal could disturb its writing of the summary."""
        if self.running and not self._interrupted:
            self._interrupted = True
            self._process.send_signal(signal.SIGINT)

    def wait(self, timeout_s: float) -> int:
        """Wait for the side's end; return its exit code. Raises subprocess.TimeoutExpired after `timeout_s`."""
        return self._process.wait(timeout=timeout_s)

    def stop(self, timeout_s: float = 10.0) -> int:
        """Interrupt the side and wait for its end, kill it after `timeout_s`, and return the exit code."""
        self.interrupt()
        try:
            return self._process.wait(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()

    def _read(self) -> None:
        stream = self._process.stdout
        if stream is not None:
            for line in stream:
                self._has_spoken = True
                if self._events.full():
                    self._events.get_nowait()
                try:
                    self._events.put_nowait(json.loads(line))
                except json.JSONDecodeError:
                    continue  # a library wrote to standard output
        self._events.put({"event": "end"})


class SideProcess(StartedSide):
    """Side that runs as a process on this machine, with this Python."""

    def __init__(self, module: str, name: str, arguments: Sequence[str], before: Sequence[str] = ()) -> None:
        """Run `module` with `arguments`. before: words in front of the command, such as a program that runs it."""
        # -P: a folder named `common` in the working directory must not shadow the package.
        super().__init__(name, [*before, sys.executable, "-P", "-m", module, "--status", "json", *arguments])
