"""One thing about the look ahead set otherwise than the robot side has it, for as long as something is measured."""

import importlib
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

from feelahead.lab.approaches.approach import Approach, robot_settings
from robot_side.ahead.ask import NODES_PER_MARGIN
from robot_side.ahead.law import Sensed, Situation
from robot_side.ahead.looks import Looks
from robot_side.ahead.swept_law import SweptLaw
from robot_side.ahead.turns import FIELD_PERIOD_S
from robot_side.settings import RobotSettings

COVER_M: Final = RobotSettings().cover_m


@dataclass(frozen=True)
class Turned:
    """The look ahead, as it is but for what is given here."""

    knob: str = "as it is"
    value: str = ""
    period_s: float = FIELD_PERIOD_S
    """Between two looks along one side"""
    late_ticks: int = 0
    """A look is felt by so many ticks later, shortened by what the tool has moved along since."""
    cover_m: float = COVER_M
    """How far the gripper's spheres stand out: fewer of them for more"""
    nodes: int = NODES_PER_MARGIN
    """So many overlaps over the margin make a ramp. Kernels have this compiled in, each process one number."""
    hulls: bool = False
    """Meshes count as their convex hulls, each object's as one."""

    def __str__(self) -> str:
        return f"{self.knob} {self.value}".strip()

    def new_law(self, *arguments: Any) -> SweptLaw:
        """The law by the arguments of SweptLaw."""
        return LateLaw(self.late_ticks, *arguments) if self.late_ticks else SweptLaw(*arguments)


class LateLooks(Looks):
    """What was seen becomes known some ticks later; the very first look from a place at once."""

    def __init__(self, ticks: int) -> None:
        super().__init__()
        self._ticks = ticks
        self._now = 0
        self._waiting: deque[tuple[int, int, int, float, tuple[Any, ...]]] = deque()

    def add(self, side: int, place: int, now_s: float, *seen: Any) -> None:
        """Take a look in, later."""
        if self.looked_s[side][place] < 0.0:
            super().add(side, place, now_s, *seen)
            return
        self.looked_s[side][place] = now_s
        self._waiting.append((self._now + self._ticks, side, place, now_s, seen))

    def tick(self) -> None:
        """Let a tick pass."""
        self._now += 1
        while self._waiting and self._waiting[0][0] <= self._now:
            _, side, place, then_s, seen = self._waiting.popleft()
            if place < len(looked_s := self.looked_s[side]):
                newest_s = looked_s[place]
                super().add(side, place, then_s, *seen)
                looked_s[place] = newest_s


class LateLaw(SweptLaw):
    """The law, whose looks take some ticks."""

    def __init__(self, late_ticks: int, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._late = LateLooks(late_ticks)
        self.turns.looks = self._late

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Work out one tick."""
        self._late.tick()
        return super().sense(situation, now_s)


@contextmanager
def exchanged(module_name: str, **by_name: Any) -> Iterator[None]:
    """Have a module's names mean something else; AttributeError where one is gone."""
    module = importlib.import_module(module_name)
    with ExitStack() as stack:
        for name, value in by_name.items():
            stack.callback(setattr, module, name, getattr(module, name))
            setattr(module, name, value)
        yield


@contextmanager
def turned(how: Turned) -> Iterator[None]:
    """Have whatever is built and run within it be so, in this process; what has no parameter of its own by its name."""
    with ExitStack() as stack:
        for name in ("swept_law", "turns"):
            stack.enter_context(exchanged(f"robot_side.ahead.{name}", FIELD_PERIOD_S=how.period_s))
        if how.late_ticks:
            stack.enter_context(exchanged("robot_side.assembly", SweptLaw=partial(LateLaw, how.late_ticks)))
        if how.nodes != NODES_PER_MARGIN:
            stack.enter_context(exchanged("robot_side.ahead.ask", NODES_PER_MARGIN=how.nodes))
        if how.cover_m != COVER_M:
            settings = partial(_covered, robot_settings, how.cover_m)
            stack.enter_context(exchanged("feelahead.lab.approaches.approach", robot_settings=settings))
        yield


def _covered(plain: Callable[[Approach], RobotSettings], cover_m: float, approach: Approach) -> RobotSettings:
    return replace(plain(approach), cover_m=cover_m)
