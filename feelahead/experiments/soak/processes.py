"""The processes of a soak: a robot side, its owner, and who watches."""

import json
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from common.clock import MonotonicClock
from feelahead.both_sides.processes import SideFailedError, SideProcess
from feelahead.both_sides.real_time import LINK_S
from feelahead.both_sides.summary import merge_summaries
from feelahead.experiments.soak.light_observers import PERIOD_S, LightObservers
from feelahead.experiments.soak.sampling import Sample, sample
from feelahead.experiments.soak.settings import SoakSettings

HERE = "this process"
"""The row of the light observers, who live in the asking process."""
_ROBOT = "robot side"
_START_S = 90.0


class SoakProcesses:
    """Robot side and owner from the opening of the context to its end, observers from `bring_observers` on."""

    def __init__(self, settings: SoakSettings, folder: Path) -> None:
        self.watching = 0
        """How many observers the robot side spoke of last."""
        self._settings, self._folder = settings, folder
        self._stack = ExitStack()
        self._clock, self._pause = MonotonicClock(), threading.Event()
        self._sides: dict[str, SideProcess] = {}
        self._light: LightObservers | None = None
        self._ticks_us: list[tuple[float, float]] = []
        """The median and the p99 of the ticks before each status."""

    def __enter__(self) -> "SoakProcesses":
        with self._stack as stack:
            self._start(_ROBOT, "robot_side.main", ["--bind=tcp://127.0.0.1:0"])
            heard = self._sides[_ROBOT].wait_for("listening", _START_S)
            self._endpoints = heard["control"], heard["view"]
            self._start_operator("operator side")
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def bring_observers(self) -> None:
        """All that were asked for; SideFailedError when the robot side does not take them all in."""
        for number in range(1, self._settings.observing_processes + 1):
            self._start_operator(f"observer {number}", number)
        if self._settings.light:
            self._light = self._stack.enter_context(LightObservers(self._settings.light, *self._endpoints))
        end_s = self._clock.now() + _START_S
        while self.watching < self._settings.observers or not (self._light is None or self._light.arrived):
            if self._clock.now() > end_s:
                raise SideFailedError(f"the robot side knows of {self.watching} observers after {_START_S:g} s")
            self.wait(PERIOD_S)
        self._ticks_us.clear()

    def wait(self, seconds: float) -> None:
        """Let time pass while all take their turns; SideFailedError when a side fails."""
        now_s = self._clock.now()
        end_s = now_s + seconds
        while now_s < end_s:
            if self._light is not None:
                self._light.turn(now_s)
            for name, side in self._sides.items():
                side.check()
                for event in side.events():
                    if name == _ROBOT and event["event"] == "status":
                        self.watching = event["observers"]
                        self._ticks_us.append((event["tick_us"], event["tick_p99_us"]))
            self._pause.wait(min(end_s - now_s, PERIOD_S))
            now_s = self._clock.now()

    def take_ticks_us(self) -> tuple[float, float]:
        """The medians of the ticks' medians and p99 since this was last asked for."""
        median_us, p99_us = np.median(np.array(self._ticks_us or [(np.nan, np.nan)]), axis=0)
        self._ticks_us.clear()
        return float(median_us), float(p99_us)

    def look(self, minutes: float) -> dict[str, Sample]:
        """Every process's memory and descriptors."""
        seen = {name: sample(side.process_id, minutes) for name, side in self._sides.items()}
        return seen if self._light is None else seen | {HERE: sample("self", minutes)}

    def end(self) -> dict[str, Any]:
        """End all, and merge the robot side's and the owner's summaries, with everybody's errors."""
        # All at once, and the robot side last: none is to take the other's end for a fault of the link.
        for side in reversed(self._sides.values()):
            side.interrupt()
        for side in reversed(self._sides.values()):
            side.stop()
            side.check()
        robot, owner, *others = self._summaries()
        return merge_summaries(robot, owner, [error for other in others for error in other["errors"]])

    def _summaries(self) -> Iterator[dict[str, Any]]:
        for name in self._sides:
            yield json.loads(self._summary(name).read_text(encoding="utf-8"))

    def _summary(self, name: str) -> Path:
        return self._folder / f"{name}.json"

    def _start_operator(self, name: str, number: int = 0) -> None:
        control, view = self._endpoints
        arguments = [f"--connect={control}", f"--view-connect={view}", "--device=simulated"]
        self._start(name, "operator_side.main", arguments, number)
        # Until the robot side has said where it stands.
        status = self._sides[name].wait_for("status", _START_S)
        end_s = self._clock.now() + LINK_S
        while status.get("owner") is None:
            if self._clock.now() > end_s:
                raise SideFailedError(f"the {name} has no link after {LINK_S:g} s: {status['link']}")
            status = self._sides[name].wait_for("status", LINK_S)

    def _start(self, name: str, module: str, arguments: Sequence[str], number: int = 0) -> None:
        own = [f"--seed={self._settings.seed + number}", f"--summary={self._summary(name)}"]
        process = SideProcess(module, name, [*arguments, f"--link={self._settings.link}", *own])
        self._sides[name] = self._stack.enter_context(process)
