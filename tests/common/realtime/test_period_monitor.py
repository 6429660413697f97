import pytest

from common.clock import VirtualClock
from common.realtime.pacing import Pacer
from common.realtime.period_choice import PATIENCE_S, WINDOW_S
from common.realtime.period_monitor import PeriodMonitor
from common.realtime.stolen_time import StolenTime

PERIOD_S = 1e-3


class Loop:
    """Simulated loop with turns of given durations.

    waited: share of time for which other programs had the processor. stolen: share that the host took. None: unknown.
    """

    def __init__(self, *, waited: float | None = 0.0, stolen: float | None = 0.0) -> None:
        self.wall, self.processor = VirtualClock(100.0), VirtualClock(7.0)
        self._waited, self._stolen = waited, stolen
        self.pacer = Pacer(PERIOD_S, 100.0)
        self.period_monitor = PeriodMonitor(self.pacer, self.wall, self.processor, "a faster machine", self._taken)
        self.said: list[str] = []

    def _taken(self) -> StolenTime:
        passed_s = self.wall.now() - 100.0
        waited = None if self._waited is None else self._waited * passed_s
        stolen = None if self._stolen is None else self._stolen * 200.0 * passed_s
        return StolenTime(waited, stolen, None if stolen is None else 200.0 * passed_s)

    def _pass(self, wall_s: float, processor_s: float) -> None:
        self.wall.advance_to(self.wall.now() + wall_s)
        self.processor.advance_to(self.processor.now() + processor_s)

    def run(self, for_s: float, computes_s: float, lasts_s: float | None = None, *, every: int = 1) -> None:
        """Run turns for `for_s`. Each `every`-th one computes for `computes_s`; others compute for 0.1 ms.

        lasts_s: duration of each turn, if it is longer.
        """
        end_s, turn = self.wall.now() + for_s, 0
        while self.wall.now() < end_s:
            self.wall.advance_to(max(self.wall.now(), self.pacer.deadline_s))
            self.period_monitor.begin()
            self.pacer.begin(self.wall.now())
            turn += 1
            spent_s = computes_s if turn % every == 0 else 1e-4
            self._pass(spent_s, spent_s)
            if lasts_s is not None:
                self._pass(lasts_s - spent_s, 0.0)
            if (text := self.period_monitor.end(turned=True)) is not None:
                self.said.append(text)


def test_a_loop_that_keeps_up_is_told_nothing() -> None:
    loop = Loop()
    loop.run(4 * WINDOW_S, 0.4e-3)
    loop.run(4 * WINDOW_S, 2.5e-3, every=100)
    assert loop.said == []
    assert loop.pacer.period_s == PERIOD_S
    assert loop.period_monitor.summary() == {"said": None, "waited": 0.0, "stolen": 0.0}


def test_too_slow_names_the_time_the_period_taken_and_what_would_help() -> None:
    loop = Loop()
    loop.run(4 * WINDOW_S, 1.5e-3)
    (text,) = loop.said
    assert text.startswith("this machine is too slow: a turn computes for 1.5 ms where there are 1 ms, and ")
    assert text.endswith("33 % of the deadlines are missed: turns now begin every 2ms; a faster machine would help")
    assert loop.period_monitor.summary()["said"] == text
    assert loop.pacer.period_s == 2e-3


def test_each_change_is_one_line_and_the_cause_is_told_once() -> None:
    loop = Loop()
    loop.run(4 * WINDOW_S, 4.5e-3)
    assert [text.partition(": turns now begin ")[2].partition(";")[0] for text in loop.said] == [
        *("every 2ms", "every 4ms", "every 5ms")
    ]
    assert loop.said[1] == "56 % of the deadlines are missed: turns now begin every 4ms"
    loop.run(4 * PATIENCE_S, 0.1e-3)
    assert loop.said[3:] == [f"turns begin every {period} again" for period in ("4ms", "2ms", "1ms")]


def test_a_loop_that_keeps_no_period_says_so_once() -> None:
    loop = Loop()
    loop.pacer.change(0.02)
    loop.period_monitor = PeriodMonitor(loop.pacer, loop.wall, loop.processor, "a faster machine")
    loop.run(4 * WINDOW_S, 0.03)
    (text,) = loop.said
    assert text.endswith(" of the deadlines are missed; a faster machine would help")


def test_turns_that_are_too_long_at_times_are_slow_where_nobody_disturbed_them() -> None:
    loop = Loop()
    loop.run(2 * WINDOW_S, 4.5e-3, every=10)
    assert loop.said[0].startswith("this machine is too slow: a turn computes for 0.54 ms")


def test_too_busy_when_others_have_the_processor() -> None:
    loop = Loop(waited=0.4)
    loop.run(2 * WINDOW_S, 0.3e-3, 1.4e-3)
    text = loop.said[0]
    assert text.startswith("this machine is too busy: a turn lasts 1.4 ms and computes for 0.3 ms")
    assert "others had the processor for 40 % of the time: closing other programs, or --realtime, would help" in text
    assert loop.period_monitor.summary()["waited"] == pytest.approx(0.4)


def test_too_busy_when_the_host_takes_the_time() -> None:
    loop = Loop(waited=0.1, stolen=0.3)
    loop.run(2 * WINDOW_S, 0.3e-3, 1.4e-3)
    assert "its host took 30 % of the time: a host with less to do would help" in loop.said[0]


def test_a_system_that_does_not_tell_is_no_obstacle() -> None:
    loop = Loop(waited=None, stolen=None)
    loop.run(2 * WINDOW_S, 0.3e-3, 1.4e-3)
    assert loop.said[0].startswith("this machine is too busy")
    assert loop.said[0].endswith("; closing other programs, or --realtime, would help")
    assert loop.period_monitor.summary() == {"said": loop.said[0], "waited": None, "stolen": None}
