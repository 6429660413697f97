"""What a container says, event by event, and waiting for what it is to say."""

import json
import os
import signal
import time
from collections.abc import Callable
from typing import Any, Final

from feelahead.containers.engine import Engine

Event = dict[str, Any]
_LOOK_S: Final = 0.25


class CheckFailedError(Exception):
    """What was to be shown did not show; the text says what and what was there instead."""


def check(holds: bool, text: str) -> None:
    """CheckFailedError unless it holds."""
    if not holds:
        raise CheckFailedError(text)


class Watched:
    """One service's container, from now on."""

    def __init__(self, engine: Engine, service: str) -> None:
        self._engine = engine
        self.service = service
        self.container = engine.container(service)
        self._seen = 0
        self._waiting: list[Event] = []

    def new_events(self) -> list[Event]:
        """What it said that nobody has heard yet, of what `--status json` prints."""
        lines = [line for line in self._engine.docker("logs", self.container).splitlines() if line.startswith("{")]
        new, self._seen = lines[self._seen :], len(lines)
        said, self._waiting = [*self._waiting, *map(json.loads, new)], []
        return said

    def wait_for(self, what: str, holds: Callable[[Event], bool], limit_s: float = 60.0) -> list[Event]:
        """Everything that it says up to the first event that holds; CheckFailedError when none does in time."""
        heard: list[Event] = []
        end_s = time.monotonic() + limit_s
        while time.monotonic() < end_s:
            said = self.new_events()
            for number, event in enumerate(said, 1):
                heard.append(event)
                if holds(event):
                    self._waiting = said[number:]
                    return heard
            time.sleep(_LOOK_S)
        last = {name: heard[-1].get(name) for name in ("link", "state", "text")} if heard else "nothing"
        raise CheckFailedError(f"{self.service}: not {what} within {limit_s:g} s; the last it said: {last}")

    def kill(self) -> None:
        """kill -9 its first process, as the system would when memory runs out."""
        os.kill(int(self._engine.inspect(self.container)["State"]["Pid"]), signal.SIGKILL)


def state_is(*states: str) -> Callable[[Event], bool]:
    """Whether a status tells one of these states of the arm."""
    return lambda event: event.get("event") == "status" and event.get("state") in states


def link_up(event: Event) -> bool:
    """Whether a status tells of a link."""
    return event.get("event") == "status" and event.get("link") == "up"
