"""The operator side as a process of its own, forked: an emulated processor would load its modules for half a minute."""

import json
import os
import signal
import sys
import threading
from collections.abc import Sequence

import operator_side.main
from tests.helpers.waiting import wait_until


class Operator:
    """What `feelahead-operator` runs, in a process that waits for `begin`; and what it says.

    To be made before this process has any thread, which a fork would not take along.
    """

    def __init__(self) -> None:
        flags_out, self._flags = os.pipe()
        self._said, said_in = os.pipe()
        self._code: int | None = None
        self.notes: list[str] = []
        self.controller = "unknown"
        self.complaints: list[str] = []
        sys.stdout.flush()
        self._process_id = os.fork()
        if self._process_id == 0:
            os.close(self._flags)
            os.close(self._said)
            _become(flags_out, said_in)
        os.close(flags_out)
        os.close(said_in)
        self._reader = threading.Thread(target=self._read, daemon=True)

    def begin(self, flags: Sequence[str]) -> None:
        """Run it with these flags."""
        self._reader.start()
        os.write(self._flags, f"{' '.join(flags)}\n".encode())
        os.close(self._flags)

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        if self._code is None:
            process_id, status = os.waitpid(self._process_id, os.WNOHANG)
            if process_id != 0:
                self._code = os.waitstatus_to_exitcode(status)
        return self._code is None

    def send(self, number: signal.Signals) -> None:
        """Send a signal."""
        if self.running:
            os.kill(self._process_id, number)

    def end(self, number: signal.Signals) -> int | None:
        """Send a signal, and wait; the exit code."""
        self.send(number)
        wait_until("the operator side ends", lambda: not self.running, 30.0)
        return self._code

    def note(self, part: str) -> str:
        """The first note with `part` in it; AssertionError when there is none."""
        found = next((note for note in self.notes if part in note), None)
        assert found is not None, f"{part!r} is in none of its notes: {self.notes}"
        return found

    def _read(self) -> None:
        with os.fdopen(self._said, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                try:
                    event = json.loads(line)
                except json.JSONDecodeError:
                    self.complaints.append(line.rstrip())
                    continue
                if event["event"] == "note":
                    self.notes.append(event["text"])
                if event["event"] == "status":
                    self.controller = event["controller"]


def _become(flags: int, said: int) -> None:
    """Turn this process, which was just forked, into an operator side; does not return."""
    code = 1
    try:
        with os.fdopen(flags, encoding="ascii") as lines:
            words = lines.readline().split()
        os.dup2(said, 1)
        os.dup2(said, 2)
        if words:  # without, whoever wanted it has ended
            sys.argv = ["feelahead-operator", *words]
            operator_side.main.main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    finally:
        sys.stdout.flush()
        os._exit(code)
