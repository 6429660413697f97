"""Rate control under stress: links that are narrow, lossy or change, and clocks that jump."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from common.link_model import DelayLine, LinkProfile
from common.periods import TURN_S
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Watch
from common.rate.budget import Budget
from common.rate.controller import LEAST_BIT_S, MOST_BIT_S
from common.statistics import RunningStatistics
from feelahead.lab.stability.tally import Part, Tally

Rng = np.random.Generator
LASTS_S = 20.0
SETTLED_S = 15.0
_PICTURE_BYTES: Final = 15_000
_QUEUE_LIMIT_S: Final = 0.1
"""Largest queueing delay (95 %) of haptic messages after 15 s: the robot side stops the arm after as much"""
_SHARE_LIMIT: Final = 4.0
"""Largest ratio of the link's rate to what pictures, haptics and the link's own limits get through"""


@dataclass(frozen=True)
class Line:
    """Link to the operator, and the peer's clock."""

    words: str
    later: str | None = None
    """The link from 8 s on; None: the same"""
    again: str | None = None
    """The link from 10 s on; None: the same"""
    capacity_bit_s: float | None = None
    """Rate that must be used in part at the end; None: the link has no limit, or does not deliver"""
    clock: Callable[[float], float] = lambda now_s: now_s + 1234.5


_JUMP: Final = 9.0
LINES: Final[dict[str, Line]] = {
    "150 kbit/s": Line("delay 25ms rate 150kbit"),
    "300 kbit/s": Line("delay 25ms rate 300kbit", capacity_bit_s=300e3),
    "2 Mbit/s": Line("delay 25ms rate 2mbit", capacity_bit_s=2e6),
    "1 Gbit/s": Line("rate 1gbit"),
    "no limit": Line(""),
    "500 ms, 2 Mbit/s": Line("delay 500ms rate 2mbit", capacity_bit_s=2e6),
    "falls to a tenth": Line("delay 25ms rate 5mbit", "delay 25ms rate 500kbit", capacity_bit_s=500e3),
    "rises tenfold": Line("delay 25ms rate 500kbit", "delay 25ms rate 5mbit", capacity_bit_s=5e6),
    "outage of 2 s": Line("delay 25ms rate 2mbit", "delay 25ms rate 2mbit loss 100%", "delay 25ms rate 2mbit", 2e6),
    "30 % lost": Line("delay 25ms rate 2mbit loss 30%", capacity_bit_s=2e6),
    "jitter of 20 ms": Line("delay 50ms 20ms rate 2mbit"),
    "never an answer": Line("loss 100%"),
    **{
        f"peer's clock jumps by {by_s:g} s": Line(
            "delay 25ms rate 2mbit",
            capacity_bit_s=2e6,
            clock=lambda now_s, by_s=by_s: now_s + (by_s if now_s > _JUMP else 0.0),  # type: ignore[misc]
        )
        for by_s in (0.02, -0.02, 1.0, -1.0, 1e4, -1e4)
    },
    "peer's clock drifts by 500 ppm": Line("delay 25ms rate 2mbit", capacity_bit_s=2e6, clock=lambda t: 1.0005 * t),
}


def check(_: str, count: int, rng: Rng) -> Iterator[Tally]:
    """Send haptics and pictures for 20 s; note rates out of bounds, standing queues, and rates that stay too low."""
    for name, line in LINES.items():
        queue = Tally(f"{name}: queue", "s, queueing delay (95 %) of haptics at the end", _QUEUE_LIMIT_S)
        bounds = Tally(f"{name}: rate", "times out of 100 kbit/s to 1 Gbit/s", 1.0 + 1e-12)
        used = Tally(f"{name}: use", "link's rate, of what is used at the end", _SHARE_LIMIT)
        for number in range(count):
            where = f"number {number}"
            with queue.tried(where):
                sent = _Sent(line, int(rng.integers(1 << 31)))
                sent.run()
                queue.note(sent.queue_s(), where)
                bounds.note((LEAST_BIT_S / min(sent.rates_bit_s), max(sent.rates_bit_s) / MOST_BIT_S), where)
                if line.capacity_bit_s is not None:
                    used.note(line.capacity_bit_s / max(sent.used_bit_s(), 1.0), where)
        yield from (queue, bounds) if line.capacity_bit_s is None else (queue, bounds, used)


class _Sent:
    """One run of both ends in virtual time."""

    def __init__(self, line: Line, seed: int) -> None:
        self._line = line
        self._out: DelayLine[tuple[float, Any, int]] = DelayLine(LinkProfile.parse(line.words, seed))
        self._back: DelayLine[Any] = DelayLine(LinkProfile.parse("delay 25ms", seed + 1))
        self._robot, self._operator = LinkEnd("robot", 1, "robot"), LinkEnd("operator", 2, "operator")
        self._budget: Budget[str] = Budget(("video",))
        self._arrived: list[tuple[float, float, int]] = []
        self._haptics_s, self._picture_s = -math.inf, 1.0
        self.rates_bit_s: list[float] = []

    def run(self) -> None:
        """Run for 20 s."""
        seed = 7
        self._out.push(0.0, (0.0, self._robot.hello(0.0), 100), 100)
        self._back.push(0.0, self._operator.hello(self._line.clock(0.0)))
        for turn in range(1, round(LASTS_S / TURN_S)):
            now_s = turn * TURN_S
            for at_s, words in ((8.0, self._line.later), (10.0, self._line.again)):
                if words is not None and now_s - TURN_S < at_s <= now_s:
                    self._out.change(LinkProfile.parse(words, seed))
            self._turn(now_s)
            self.rates_bit_s.append(self._budget.controller.rate_bit_s)

    def _turn(self, now_s: float) -> None:
        budget, clock = self._budget, self._line.clock
        for sent_s, message, size_bytes in self._out.pop(now_s):
            self._arrived.append((sent_s, now_s, size_bytes))
            if message is not None:
                self._operator.arrived(message, clock(now_s))
        for message in self._back.pop(now_s):
            self._robot.arrived(message, now_s)
        budget.hear(self._robot.outgoing, now_s)
        if now_s - self._haptics_s >= max(0.01, budget.haptic_interval_s) - 1e-9:
            self._haptics_s = now_s
            budget.spend("haptics", 200, now_s)
            self._out.push(now_s, (now_s, Watch(self._robot.stamp(now_s)), 200), 290)
        self._back.push(now_s, Watch(self._operator.stamp(clock(now_s))))
        if now_s >= self._picture_s and budget.waiting_s("video") < 0.03:
            self._picture_s = now_s + 0.004
            budget.offer("video", bytes(_PICTURE_BYTES), now_s)
        for leaving in budget.take(now_s):
            size_bytes = len(leaving.payload)
            self._out.push(now_s, (now_s, None, size_bytes), size_bytes + 90)

    def queue_s(self) -> float:
        """Return the 95 % quantile of the haptic delays of late arrivals, above the least of all; 0 without any."""
        delays_s = [(got_s, got_s - sent_s) for sent_s, got_s, size in self._arrived if size == 200]
        at_the_end = RunningStatistics()
        at_the_end.extend([delay_s for got_s, delay_s in delays_s if got_s > SETTLED_S])
        high_s = at_the_end.quantile(0.95)
        return 0.0 if high_s is None else high_s - min(delay_s for _, delay_s in delays_s)

    def used_bit_s(self) -> float:
        """Return the rate at which bytes arrived at the end."""
        return 8.0 * sum(size for _, got_s, size in self._arrived if got_s > SETTLED_S) / (LASTS_S - SETTLED_S)


PART: Final = Part(("what is sent",), (2, 1), check)
