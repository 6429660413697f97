"""Durations of the stages of a loop's turns, in wall time and in processor time.

The four clock readings of a stage take 1.5 us. So only one turn in seven is sampled. Periodic work of the loop, such
as every 4, 10 or 33 turns, has no period that is a multiple of seven.
"""

from collections.abc import Callable, Sequence
from typing import Final, ParamSpec, TypeVar

from common.clock import Clock
from common.statistics import BLOCK, RunningStatistics

EVERY: Final = 7
"""Sampling interval: one turn in so many is measured."""
Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


class Stages:
    """Durations of stages, added up within a turn, with statistics over the turns. Stages may be nested."""

    def __init__(self, names: Sequence[str], wall: Clock, processor: Clock, seed: int = 0, every: int = EVERY) -> None:
        """names: of the stages. processor: clock of the loop thread's processor time. every: sampling interval."""
        self.names = tuple(names)
        self.spent_s = [0.0] * (2 * len(self.names))
        """For each stage its wall time, then its processor time, since the start, scaled up from the sampled turns."""
        self._wall, self._processor = wall, processor
        self._every, self._until_next = every, 0
        self.looks = True
        """Whether the present turn is sampled."""
        self._turn_s = [0.0] * len(self.spent_s)
        self._begun: tuple[int, float, float] | None = None
        """Stage that `begin` began: its index in `spent_s`, and wall and processor time at its begin"""
        self._turns_s: list[list[float]] = []
        self._statistics = [RunningStatistics(seed) for _ in self.spent_s]

    def timed(self, name: str, function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
        """Wrap `function` so that its duration counts for the stage `name`; raises ValueError for an unknown name."""
        place = 2 * self.names.index(name)
        wall, processor = self._wall.now, self._processor.now

        def measured(*arguments: Parameters.args, **others: Parameters.kwargs) -> Result:
            if not self.looks:
                return function(*arguments, **others)
            began_s, computed_s = wall(), processor()
            result = function(*arguments, **others)
            turn_s = self._turn_s
            turn_s[place] += wall() - began_s
            turn_s[place + 1] += processor() - computed_s
            return result

        return measured

    def begin(self, name: str | None) -> None:
        """Count the time from now to the next call for the stage `name`; None: for no stage.

        Call it only while `looks` is true.
        """
        if name is None and self._begun is None:
            return
        wall_s, processor_s = self._wall.now(), self._processor.now()
        if self._begun is not None:
            place, began_s, computed_s = self._begun
            self._turn_s[place] += wall_s - began_s
            self._turn_s[place + 1] += processor_s - computed_s
        self._begun = None if name is None else (2 * self.names.index(name), wall_s, processor_s)

    def end_turn(self) -> None:
        """End a turn: what was measured since the last call counts as one turn."""
        if self.looks:
            self._until_next = self._every
            self._turns_s.append(self._turn_s)
            self._turn_s = [0.0] * len(self._turn_s)
            if len(self._turns_s) >= BLOCK:
                self.take_in()
        self._until_next -= 1
        self.looks = self._until_next == 0

    def take_in(self) -> None:
        """Add the sampled turns to the statistics; many at once take less time per turn."""
        if not self._turns_s:
            return
        for place, values_s in enumerate(zip(*self._turns_s, strict=True)):
            self.spent_s[place] += self._every * sum(values_s)
            self._statistics[place].extend(values_s)
        self._turns_s.clear()

    def summary(self) -> dict[str, dict[str, dict[str, float | None]]]:
        """Return the duration of each stage in a turn: `wall_us` and `cpu_us`, each with `p50`, `p99` and `max`."""
        self.take_in()
        wall, processor = ([microseconds(one) for one in self._statistics[which::2]] for which in (0, 1))
        return {name: {"wall_us": wall[place], "cpu_us": processor[place]} for place, name in enumerate(self.names)}


def microseconds(time_s: RunningStatistics) -> dict[str, float | None]:
    """Return `p50`, `p99` and `max` in microseconds, of samples in seconds."""
    values_s = {"p50": time_s.quantile(0.50), "p99": time_s.quantile(0.99), "max": time_s.maximum}
    return {name: None if value is None else 1e6 * value for name, value in values_s.items()}
