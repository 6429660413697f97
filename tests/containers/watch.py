"""Containers of a run, and the events that their programs print."""

import json
import os
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from feelahead.containers.engine import Engine
from tests.helpers.machines.waiting import wait_until

Event = dict[str, Any]


@dataclass(frozen=True)
class Compose:
    """Container engine, and the settings with which compose.yaml is run on it."""

    engine: Engine
    settings: Mapping[str, str]
    """Variables of compose.yaml and their values"""

    def existing(self, which: str) -> set[str]:
        """Return the ids of containers, networks and volumes that match `which`, a filter in Docker's syntax."""
        kinds = (("ps", "--all"), ("network", "ls"), ("volume", "ls"))
        return {one for kind in kinds for one in self.engine.docker(*kind, "--quiet", "--filter", which).split()}


class Watched:
    def __init__(self, engine: Engine, service: str) -> None:
        self._engine = engine
        self.service = service
        self.container = engine.container(service)
        self._seen = 0
        self._waiting: list[Event] = []

    def new_events(self) -> list[Event]:
        lines = [line for line in self._engine.docker("logs", self.container).splitlines() if line.startswith("{")]
        new, self._seen = lines[self._seen :], len(lines)
        said, self._waiting = [*self._waiting, *map(json.loads, new)], []
        return said

    def wait_for(self, what: str, holds: Callable[[Event], bool], limit_s: float = 60.0) -> list[Event]:
        """Return the new events up to the first for which `holds` is true; AssertionError after `limit_s`."""
        heard: list[Event] = []

        def found() -> bool:
            said = self.new_events()
            for number, event in enumerate(said, 1):
                heard.append(event)
                if holds(event):
                    self._waiting = said[number:]
                    return True
            return False

        wait_until(f"{self.service}: {what}", found, limit_s, instead=lambda: heard[-1:])
        return heard

    def kill(self) -> None:
        """Kill the container's first process with kill -9, as the system would when memory runs out."""
        os.kill(int(self._engine.inspect(self.container)["State"]["Pid"]), signal.SIGKILL)


def state_is(*states: str) -> Callable[[Event], bool]:
    """Return a function that checks whether an event is a status with one of these states of the arm."""
    return lambda event: event.get("event") == "status" and event.get("state") in states


def link_up(event: Event) -> bool:
    return event.get("event") == "status" and event.get("link") == "up"
