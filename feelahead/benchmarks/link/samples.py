"""Delays of a link as arrays: of one run of the model in virtual time, and of a recording."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common.arrays import FloatArray
from common.emulation.delay_line import DelayLine
from common.emulation.distribution import moments
from common.emulation.profile import LinkProfile
from common.emulation.trace import read_samples
from common.errors import ConfigurationError

STALL_S = 1e-3
"""A delay that exceeds the model's greatest by more than this is the host's doing, not the link's."""


@dataclass(frozen=True)
class LinkSample:
    """What became of messages, in order of sending."""

    sent_s: FloatArray
    """(n,) when each was sent."""
    delay_s: FloatArray
    """(n,) how long its first copy took; NaN: lost."""

    @property
    def arrived_s(self) -> FloatArray:
        """(m,) the delays of those that arrived."""
        return self.delay_s[~np.isnan(self.delay_s)]

    @property
    def mean_s(self) -> float:
        """The mean delay of what arrived."""
        return float(self.arrived_s.mean())

    @property
    def sd_s(self) -> float:
        """The standard deviation of the delay of what arrived."""
        return float(self.arrived_s.std())

    @property
    def loss_share(self) -> float:
        """How many were lost, of all."""
        return float(np.isnan(self.delay_s).mean())

    @property
    def mean_burst(self) -> float:
        """How many are lost in a row, on average; 0 without loss."""
        lost = np.isnan(self.delay_s).astype(np.int8)
        bursts = int((np.diff(lost, prepend=0) == 1).sum())
        return float(lost.sum()) / bursts if bursts else 0.0

    @property
    def late_share(self) -> float:
        """How many of what arrived were overtaken by a later one (RFC 4737, type-P-reordered)."""
        arrived = np.flatnonzero(~np.isnan(self.delay_s))
        order = arrived[np.argsort(self.sent_s[arrived] + self.delay_s[arrived], kind="stable")]
        return float(np.mean(order < np.maximum.accumulate(order))) if order.size else 0.0

    def without_stalls(self, profile: LinkProfile) -> tuple["LinkSample", int]:
        """Without the delays that the model cannot give, and how many these were."""
        greatest_s = greatest_delay_s(profile) + STALL_S
        stalled = self.delay_s > greatest_s
        return LinkSample(self.sent_s[~stalled], self.delay_s[~stalled]), int(stalled.sum())


def greatest_delay_s(profile: LinkProfile) -> float:
    """The most that a datagram can take; infinity where there is no such limit or it is not known."""
    if profile.model == "stream" or profile.slot is not None:
        return math.inf
    if profile.trace is not None:
        return max(delay_s for delay_s in profile.trace.delays_s if delay_s is not None)
    return moments(profile.delay_s, profile.jitter_s, profile.distribution)[2]


def read_link_sample(path: Path, flag: str) -> LinkSample:
    """A recording with send times; ConfigurationError, in one line that names `flag`, for anything else."""
    samples = read_samples(path, flag)
    if len(samples) < 2 or any(sample.sent_s is None for sample in samples):
        raise ConfigurationError(f"{flag}: {path} lacks send times; valid: two messages or more with sent_ns")
    return LinkSample(
        np.array([sample.sent_s for sample in samples], dtype=np.float64),
        np.array([math.nan if sample.delay_s is None else sample.delay_s for sample in samples]),
    )


def play(profile: LinkProfile, sent_s: Sequence[float], size_bytes: int) -> tuple[LinkSample, DelayLine[int]]:
    """One run of the model in virtual time: each message is released exactly when it is due."""
    line: DelayLine[int] = DelayLine(profile)
    delay_s = np.full(len(sent_s), math.nan)

    def deliver(until_s: float) -> None:
        while (due_s := line.next_due()) is not None and due_s <= until_s:
            for number in line.pop(due_s):
                # Of two copies the first counts.
                if math.isnan(delay_s[number]):
                    delay_s[number] = due_s - sent_s[number]

    for number, now_s in enumerate(sent_s):
        deliver(now_s)
        line.push(now_s, number, size_bytes)
    deliver(math.inf)
    return LinkSample(np.array(sent_s), delay_s), line


def distance(one: LinkSample, other: LinkSample) -> float:
    """The Kolmogorov-Smirnov statistic D of their delays: the widest gap between the distribution functions.

    1 if nothing arrives of one of them, which then has no distribution.
    """
    first, second = np.sort(one.arrived_s), np.sort(other.arrived_s)
    if first.size == 0 or second.size == 0:
        return 1.0
    values = np.concatenate([first, second])
    return float(
        np.max(
            np.abs(
                np.searchsorted(first, values, side="right") / first.size
                - np.searchsorted(second, values, side="right") / second.size
            )
        )
    )
