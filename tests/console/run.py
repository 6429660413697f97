"""A real demo with a console, both sides included, and the events that the demo prints."""

import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

from feelahead.both_sides.processes import StartedSide
from tests.helpers.machines.waiting import LIMIT_S, wait_until

Event = dict[str, Any]
STATE: Final = "document.body.dataset.state"
DRAWN: Final = "['overview', 'first_person'].every((view) => document.getElementById(view).dataset.frames > 2)"
"""JavaScript condition: pictures of both cameras have come"""


class Run:
    def __init__(self, demo: StartedSide) -> None:
        self._demo = demo
        self.address = ""
        """Address of the console, with the token that opens it"""
        self.process_ids: dict[str, int] = {}
        """Process id of each side, by the side's name"""
        self.facts: deque[Event] = deque(maxlen=400)
        """Facts that the console shows, ten a second, newest last"""
        self.notes: list[str] = []

    def look(self) -> None:
        for event in self._demo.events():
            kind = event["event"]
            if kind == "console":
                self.address = event["address"]
            elif kind == "started":
                self.process_ids[event["side"]] = event["process_id"]
            elif kind == "facts":
                self.facts.append(event["facts"])
            elif kind == "note":
                self.notes.append(event["text"])
        self._demo.check()

    def wait_until(self, what: str, holds: Callable[["Run"], object], limit_s: float = LIMIT_S) -> float:
        """Wait until `holds` is true; return the seconds it took. AssertionError with `what` after `limit_s`."""
        began_s = time.monotonic()

        def looked() -> bool:
            self.look()
            return bool(holds(self))

        wait_until(what, looked, limit_s, instead=lambda: (self.status, self.notes[-3:]))
        return time.monotonic() - began_s

    @property
    def status(self) -> Event:
        return dict(self.facts[-1]["status"]) if self.facts else {}

    @contextmanager
    def frozen(self, side: str) -> Iterator[None]:
        os.kill(self.process_ids[side], signal.SIGSTOP)
        try:
            yield
        finally:
            os.kill(self.process_ids[side], signal.SIGCONT)


@contextmanager
def running(arguments: Sequence[str]) -> Iterator[Run]:
    """Start a demo; yield it once its console has an address and the link between its sides is up."""
    command = [sys.executable, "-P", "-m", "feelahead", "demo", "--status", "facts", "--duration", "3600", *arguments]
    with StartedSide("demo", command) as demo:
        run = Run(demo)
        run.wait_until("a console's address", lambda run: run.address)
        run.wait_until("linked", lambda run: run.status.get("link") == "up")
        yield run
