"""Clocks under stress: offset between clocks that drift and jump, loop ages and queueing delays at their limits."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.periods import TURN_S
from common.silence import counted_s
from common.timing.ages import LoopAge, QueueingAge
from common.timing.clock_offset import ClockOffset
from feelahead.lab.stability.tally import Part, Tally
from robot_side.operators.safety import SafetySettings

Rng = np.random.Generator
_PERIOD_S, _LASTS_S, _JUMP_AT_S = 0.02, 45.0, 12.0
_FORGOTTEN_S: Final = 20.0
"""Time after a short jump until which the offset's bound may be wrong"""
_MOST_EXCHANGES: Final = round(_FORGOTTEN_S / _PERIOD_S)


@dataclass(frozen=True)
class Peer:
    """Behaviour of the peer's clock and of the link."""

    ahead_s: float = 1234.5
    skew: float = 0.0
    jumps_s: float = 0.0
    """Jump of the peer's clock in the midst of the run"""
    jitter_s: float = 0.002
    """Mean of the exponential delays above the least ones, so that messages overtake each other"""
    least_s: tuple[float, float] = (0.05, 0.05)
    """Least delays there and back"""
    lost: float = 0.0
    from_s: float = 0.0
    """Our time at the first exchange"""

    def clock(self, now_s: float) -> float:
        """Return the peer's time at our time `now_s`."""
        jumped_s = self.jumps_s if now_s - self.from_s >= _JUMP_AT_S else 0.0
        return now_s + self.ahead_s + self.skew * (now_s - self.from_s) + jumped_s


PEERS: Final[dict[str, Peer]] = {
    "steady": Peer(),
    "drifts by 500 ppm": Peer(skew=500e-6),
    "drifts by -500 ppm": Peer(skew=-500e-6),
    "jitter of 50 ms, reordered": Peer(jitter_s=0.05),
    "half of all lost": Peer(lost=0.5, jitter_s=0.01),
    "no delay at all": Peer(jitter_s=0.0, least_s=(0.0, 0.0)),
    "300 ms there, none back": Peer(least_s=(0.3, 0.0), skew=500e-6),
    "our clock at 1e9 s": Peer(from_s=1e9, skew=500e-6),
    "peer's clock 1e9 s ahead": Peer(ahead_s=1e9),
    **{f"jumps by {by_s:g} s": Peer(jumps_s=by_s) for by_s in (1e-3, -0.04, 0.08, -0.08, 0.2, -0.2, 1e3, -1e3, 1e6)},
    "jumps by -1 s and drifts": Peer(jumps_s=-1.0, skew=500e-6, jitter_s=0.02),
}


def check_offset(_: str, count: int, rng: Rng) -> Iterator[Tally]:
    """Compare estimated offsets with the true ones, by their own bounds; steps: exchanges until right after a jump."""
    for name, peer in PEERS.items():
        tally = Tally(name, "of its own bound, from the true offset", 1.0, _MOST_EXCHANGES)
        for number in range(count):
            with tally.tried(f"number {number}"):
                _exchange(peer, rng, tally, f"number {number}")
        yield tally


def _exchange(peer: Peer, rng: Rng, tally: Tally, where: str) -> None:
    count = int(_LASTS_S / _PERIOD_S)
    delays = np.array(peer.least_s)[:, None] + peer.jitter_s * rng.exponential(size=(2, count))
    sent_s = peer.from_s + _PERIOD_S * np.arange(count)
    there_s, held_s = sent_s + delays[0], rng.uniform(0.0, 0.01, count)
    back_s = there_s + held_s + delays[1]
    arrives = rng.random(count) >= peer.lost
    offset, worst, right_from = ClockOffset(shared_clock=False), 0.0, 0
    jump_s = peer.from_s + _JUMP_AT_S
    for number in np.argsort(back_s, kind="stable")[: count - 50].tolist():
        if not arrives[number]:
            continue
        now_s, left_s = float(back_s[number]), peer.clock(float(there_s[number] + held_s[number]))
        held_there_s = left_s - peer.clock(float(there_s[number]))
        offset.update(float(sent_s[number]), left_s, held_there_s, now_s)
        offset.update(float(sent_s[number]), math.nan, held_there_s, now_s)  # an invented stamp changes nothing
        estimate_s, bound_s = offset.offset_at(now_s), offset.bound_at(now_s)
        since_s, share = now_s - jump_s, math.inf
        if estimate_s is not None and bound_s is not None:
            share = abs(estimate_s - (peer.clock(now_s) - now_s)) / max(bound_s, 1e-300)
        if peer.jumps_s and 0.0 <= since_s <= _FORGOTTEN_S:
            right_from = right_from if share <= 1.0 else int(since_s / _PERIOD_S) + 1
        elif estimate_s is not None:
            worst = float(np.maximum(worst, share))
    unknown = offset.offset_s is None
    tally.note(math.nan if unknown else worst, f"{where}: offset unknown at the end" if unknown else where, right_from)


_AGES: Final[dict[str, Callable[[int, Rng], tuple[Any, Any]]]] = {
    "0 s": lambda n, _: (np.zeros(n), 0.004 * np.arange(n)),
    "2 s, the greatest": lambda n, _: (np.full(n, SafetySettings().max_delay_s), 0.004 * np.arange(n)),
    "0 and 2 s in turns": lambda n, _: (2.0 * (np.arange(n) % 2), 0.004 * np.arange(n)),
    "random, of all magnitudes": lambda n, rng: (10.0 ** rng.uniform(-12.0, 3.0, n), 0.004 * np.arange(n)),
    "no time passes": lambda n, rng: (rng.uniform(0.0, 2.0, n), np.zeros(n)),
    "pauses of up to 1000 s": lambda n, rng: (rng.uniform(0.0, 2.0, n), np.cumsum(10.0 ** rng.uniform(-6.0, 3.0, n))),
    "our clock at 1e9 s": lambda n, rng: (rng.uniform(0.0, 2.0, n), 1e9 + 0.004 * np.arange(n)),
    "denormal ages": lambda n, _: (np.full(n, 5e-324), 0.004 * np.arange(n)),
}


def check_ages(_: str, count: int, rng: Rng) -> Iterator[Tally]:
    """Compare loop ages with their definition, and queueing delays with those of clocks that agree."""
    for name, make in _AGES.items():
        tally = Tally(f"loop age, {name}", "s, from the definition", 1e-12)
        for number in range(count):
            with tally.tried(f"number {number}"):
                ages_s, times_s = make(300, rng)
                age, values_s = LoopAge(SafetySettings().max_delay_s), []
                for one_s, now_s in zip(ages_s.tolist(), times_s.tolist(), strict=True):
                    values_s.append(age.update(one_s, now_s))
                tally.note(np.array(values_s) - _defined_ages(ages_s, times_s), f"number {number}")
        yield tally
    for ahead_s, limit_s in ((1e3, 1e-12), (-1e9, 1e-6), (1e12, 1e-3)):
        tally = Tally(f"queueing delay, peer's clock {ahead_s:g} s ahead", "s, from clocks that agree", limit_s)
        for number in range(count):
            with tally.tried(f"number {number}"):
                sent_s = np.cumsum(10.0 ** rng.uniform(-6.0, 1.0, 300))
                received_s = sent_s + rng.exponential(0.05, 300)
                ours, theirs = QueueingAge(), QueueingAge()
                pairs = zip(sent_s.tolist(), received_s.tolist(), strict=True)
                apart_s = [ours.update(a + ahead_s, b) - theirs.update(a, b) for a, b in pairs]
                tally.note(apart_s, f"number {number}")
        yield tally
    tally = Tally("part of a silence that counts", "s, out of 0 to the whole silence", 0.0)
    for turn_s in (0.001, TURN_S, 0.02):
        for silent_s in (
            0.0,
            5e-324,
            turn_s,
            math.nextafter(turn_s, 1.0),
            0.02,
            2.0,
            1e9,
            *rng.uniform(0.0, 0.1, count),
        ):
            with tally.tried(f"{silent_s:g} s"):
                counted = counted_s(silent_s, turn_s)
                tally.note(max(counted - silent_s, -counted, 0.0), f"{silent_s:g} s")
    yield tally


def _defined_ages(ages_s: FloatArray, times_s: FloatArray) -> FloatArray:
    """Return t_d after each age: the quantile of half a second by nearest rank, with a peak that decays."""
    held_s = quantile_s = SafetySettings().max_delay_s
    found, before_s = np.empty(len(ages_s)), 0.0
    for k, now_s in enumerate(times_s):
        fallen_s = quantile_s + (held_s - quantile_s) * math.exp(-max(now_s - before_s, 0.0) / 0.5)
        seen = np.sort(ages_s[: k + 1][times_s[: k + 1] > now_s - 0.5])
        quantile_s = float(seen[math.ceil(0.95 * len(seen)) - 1])
        found[k] = held_s = max(fallen_s if k else held_s, quantile_s)
        before_s = now_s
    return found


OFFSET: Final = Part(("clock offset",), (6, 1), check_offset)
AGES: Final = Part(("ages",), (10, 2), check_ages)
