"""Messages sent through an emulated link at constant intervals, and their deliveries."""

import itertools
import math

import numpy as np

from common.emulation.clauses import LinkModel
from common.emulation.delay_line import DelayLine
from common.emulation.profile import LinkProfile

PERIOD_S = 1e-3


class Run:
    """Deliveries of `count` messages, sent each `period_s`: a list of (time of delivery, number of the message)."""

    def __init__(
        self,
        spec: str,
        count: int,
        seed: int = 0,
        model: LinkModel = "datagram",
        size_bytes: int = 100,
        period_s: float = PERIOD_S,
    ) -> None:
        self.line: DelayLine[int] = DelayLine(LinkProfile.parse(spec, seed, model))
        self.deliveries: list[tuple[float, int]] = []
        for number in range(count):
            self._deliver(number * period_s)
            self.line.push(number * period_s, number, size_bytes)
        self._deliver(math.inf)
        self.sent_s = [number * period_s for number in range(count)]

    def _deliver(self, until_s: float) -> None:
        while (due_s := self.line.next_due()) is not None and due_s <= until_s:
            self.deliveries += [(due_s, number) for number in self.line.pop(due_s)]

    @property
    def delays_s(self) -> np.ndarray:
        return np.array([due_s - self.sent_s[number] for due_s, number in sorted(self.deliveries, key=lambda d: d[1])])

    @property
    def lost(self) -> list[bool]:
        arrived = {number for _, number in self.deliveries}
        return [number not in arrived for number in range(len(self.sent_s))]


def bursts(lost: list[bool]) -> list[int]:
    return [sum(1 for _ in run) for gone, run in itertools.groupby(lost) if gone]


def lag_one(values: np.ndarray) -> float:
    return float(np.corrcoef(values[:-1], values[1:])[0, 1])
