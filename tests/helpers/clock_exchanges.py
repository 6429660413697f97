"""Exchanges of stamps between two clocks whose offset is known, one by one or as the traffic of both ends of a link."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from common.arrays import FloatArray
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Header, MotionCommand
from common.timing.clock_offset import ClockOffset
from tests.helpers.felt import felt

Clock = Callable[[float], float]
Draw = Callable[[np.random.Generator, int], FloatArray]
"""Makes that many delays in seconds; infinite ones are lost."""


def ahead(by_s: float, skew: float = 0.0) -> Clock:
    """A peer's clock by ours."""
    return lambda now_s: now_s * (1.0 + skew) + by_s


def normal(mean_s: float, sd_s: float) -> Draw:
    """Symmetric jitter."""
    return lambda generator, count: np.maximum(generator.normal(mean_s, sd_s, count), 0.0)


def queue(least_s: float, mean_s: float, loss: float = 0.0) -> Draw:
    """A floor with an exponential above it."""
    return lambda generator, count: np.where(
        generator.random(count) < loss, np.inf, least_s + generator.exponential(mean_s, count)
    )


def motion(header: Header) -> MotionCommand:
    """A command that asks for nothing."""
    return MotionCommand(header, l2=0.0, r2=0.0)


def exchange(offset: ClockOffset, start_s: float, there_s: float, held_s: float, back_s: float, clock: Clock) -> float:
    """One exchange with a peer that has `clock`; when its answer was received, by our clock."""
    peer_received_s, peer_sent_s = clock(start_s + there_s), clock(start_s + there_s + held_s)
    received_s = start_s + there_s + held_s + back_s
    offset.update(start_s, peer_sent_s, peer_sent_s - peer_received_s, received_s)
    return received_s


def talk(offset: ClockOffset, clock: Clock, there_s: FloatArray, back_s: FloatArray, start_s: float = 0.0) -> float:
    """An exchange each 4 ms, received in order of arrival; when the last one was, by our clock."""
    sent_s = start_s + 0.004 * np.arange(there_s.size)
    received_s = sent_s + there_s + 0.001 + back_s
    for k in np.argsort(received_s):
        exchange(offset, float(sent_s[k]), float(there_s[k]), 0.001, float(back_s[k]), clock)
    return float(received_s.max())


def error_s(offset: ClockOffset, clock: Clock, now_s: float) -> float:
    """How far the estimate is from the truth."""
    estimate_s = offset.offset_at(now_s)
    assert estimate_s is not None
    return estimate_s - (clock(now_s) - now_s)


class Estimate(NamedTuple):
    """What one end says about the other's clock on an arrival, beside the truth."""

    side: str
    offset_error_s: float | None
    bound_s: float | None
    one_way_error_s: float | None


class Traffic:
    """Commands at 250 Hz and fields at 1 kHz between two ends for `duration_s`; iterate to let it happen."""

    def __init__(
        self, to_robot: Draw, to_operator: Draw, skew: float, seed: int, duration_s: float, asymmetry_s: float = 0.0
    ) -> None:
        generator = np.random.default_rng(seed)
        self.robot = LinkEnd("robot", 1, "robot's clock", seed, asymmetry_s)
        self.operator = LinkEnd("operator", 2, "operator's clock", seed, asymmetry_s)
        self._clock = ahead(float(generator.uniform(-1e5, 1e5)), skew)
        self._duration_s = duration_s
        sends_s = np.arange(0.0, duration_s, 0.001), np.arange(generator.uniform(0.0, 0.004), duration_s, 0.004)
        delays_s = to_operator(generator, sends_s[0].size), to_robot(generator, sends_s[1].size)
        self._events = sorted(
            (float(at_s), kind, number, float(delays_s[kind % 2][number]))
            for kind in range(4)
            for number, at_s in enumerate(sends_s[kind % 2] + (delays_s[kind % 2] if kind > 1 else 0.0))
        )

    def __iter__(self) -> Iterator[Estimate]:
        sent: tuple[list[object], list[object]] = [], []
        ends = self.robot, self.operator
        for at_s, kind, number, delay_s in self._events:
            if at_s > self._duration_s:
                return
            clocks_s = at_s, self._clock(at_s)
            sender = kind % 2
            if kind < 2:
                end, make = ends[sender], (felt, motion)[sender]
                new = end.peer_epoch is None or at_s < 0.25
                sent[sender].append(end.hello(clocks_s[sender]) if new else make(end.stamp(clocks_s[sender])))
                continue
            receiver, now_s = ends[1 - sender], clocks_s[1 - sender]
            one_way_s = receiver.arrived(sent[sender][number], now_s).one_way_s  # type: ignore[arg-type]
            offset_s = receiver.clock_offset.offset_at(now_s)
            yield Estimate(
                ("operator", "robot")[sender],
                None if offset_s is None else offset_s - (clocks_s[sender] - now_s),
                receiver.clock_offset.bound_at(now_s),
                None if one_way_s is None else one_way_s - delay_s,
            )
