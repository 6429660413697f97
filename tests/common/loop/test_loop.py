"""A side's main loop, run on a virtual clock."""

import pytest

from common.clock import VirtualClock
from common.command.stop_signal import StopSignal
from common.loop.loop import Loop

STOPPED_S = 100.0
PERIOD_S = 1e-3


class Steps:
    """Stand-in for a side that notes the loop's calls; its second reception takes 100 s, as if it were stopped."""

    resting = True

    def __init__(self, clock: VirtualClock) -> None:
        self.clock, self.done = clock, list[tuple[str, float]]()
        self._looks, self.told = 0, list[str]()

    def note(self, text: str) -> None:
        self.told.append(text)

    def receive(self) -> str:
        self._looks += 1
        if self._looks == 2:
            self.clock.advance_to(self.clock.now() + STOPPED_S)
        return "message"

    def handle(self, received: str, now_s: float) -> None:
        self.done.append((received, now_s))

    def turn(self, now_s: float) -> None:
        self.done.append(("turn", now_s))

    def send(self) -> None:
        self.done.append(("send", self.clock.now()))

    def rest(self, now_s: float, turned_s: float) -> None:
        assert turned_s <= now_s
        self.done.append(("rest", now_s))

    def wait(self, timeout_s: float) -> bool:
        self.clock.advance_to(self.clock.now() + max(timeout_s, 1e-5))
        return False

    def next_due(self) -> None:
        return None


@pytest.fixture
def side() -> Steps:
    clock = VirtualClock()
    side = Steps(clock)
    loop = Loop(PERIOD_S, "", 0, clock)
    loop.run(side, StopSignal(), STOPPED_S + 10 * PERIOD_S)
    assert side.told == []  # a single pause is no reason for a longer period
    assert loop.summary("robot")["pacing"]["robot"]["overruns"] == pytest.approx(STOPPED_S / PERIOD_S, rel=1e-3)
    return side


def test_the_clock_is_read_after_receiving(side: Steps) -> None:
    """A process that is stopped while it receives must not take old messages for new ones."""
    taken_s = [when_s for what, when_s in side.done if what == "message"]
    assert taken_s[0] < PERIOD_S
    assert min(taken_s[1:]) >= STOPPED_S


def test_messages_leave_before_anything_that_may_wait(side: Steps) -> None:
    turns = [place for place, (what, _) in enumerate(side.done) if what == "turn"]
    assert len(turns) > 5
    for turn in turns:
        assert [what for what, _ in side.done[turn - 1 : turn + 3]] == ["message", "turn", "send", "rest"]
