"""Delays of a link's messages as arrays, from the model in virtual time or from a recording, and their comparison."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from common.arrays import FloatArray
from common.emulation.delay_line import DelayLine
from common.emulation.distribution import moments
from common.emulation.profile import LinkProfile
from common.emulation.trace import read_samples
from common.errors import ConfigurationError
from feelahead.lab.goals import Goal
from feelahead.lab.table import Row

STALL_S = 1e-3
"""Excess over the model's greatest delay, in seconds; a longer delay was caused by the host, not by the link."""
LARGEST_DISTANCE = 0.03
LARGEST_MOMENT_ERROR_MS = 0.3
LARGEST_LATE_ERROR = 0.02
_BAND = (0.005, 0.995)
_FIRST_SEED_OF_BAND = 1000


@dataclass(frozen=True)
class LinkSample:
    """Delays of a link's messages, in the order of sending."""

    sent_s: FloatArray
    """(n,) when each message was sent"""
    delay_s: FloatArray
    """(n,) delay of each message's first copy; NaN for a lost message"""

    @property
    def arrived_s(self) -> FloatArray:
        """(m,) delays of the messages that arrived"""
        return self.delay_s[~np.isnan(self.delay_s)]

    @property
    def mean_s(self) -> float:
        """Mean delay of the messages that arrived."""
        return float(self.arrived_s.mean())

    @property
    def sd_s(self) -> float:
        """Standard deviation of the delays of the messages that arrived."""
        return float(self.arrived_s.std())

    @property
    def loss_share(self) -> float:
        """Share of the messages that were lost."""
        return float(np.isnan(self.delay_s).mean())

    @property
    def mean_burst(self) -> float:
        """Mean number of messages lost in a row; 0 without loss."""
        lost = np.isnan(self.delay_s).astype(np.int8)
        bursts = int((np.diff(lost, prepend=0) == 1).sum())
        return float(lost.sum()) / bursts if bursts else 0.0

    @property
    def late_share(self) -> float:
        """Share of arrivals overtaken by a later message (RFC 4737, type-P-reordered)."""
        arrived = np.flatnonzero(~np.isnan(self.delay_s))
        order = arrived[np.argsort(self.sent_s[arrived] + self.delay_s[arrived], kind="stable")]
        return float(np.mean(order < np.maximum.accumulate(order))) if order.size else 0.0

    def without_stalls(self, profile: LinkProfile) -> tuple["LinkSample", int]:
        """Return the sample without delays that the host caused (see STALL_S), and their number."""
        stalled = self.delay_s > greatest_delay_s(profile) + STALL_S
        return LinkSample(self.sent_s[~stalled], self.delay_s[~stalled]), int(stalled.sum())


def greatest_delay_s(profile: LinkProfile) -> float:
    """Return the longest delay that the model gives to a datagram; infinity if there is no limit or it is unknown."""
    if profile.model == "stream":
        return math.inf
    if profile.trace is not None:
        return max(delay_s for delay_s in profile.trace.delays_s if delay_s is not None)
    return moments(profile.delay_s, profile.jitter_s, profile.distribution)[2]


def read_link_sample(path: Path, flag: str) -> LinkSample:
    """Read a recording with send times; otherwise ConfigurationError, in one line that names `flag`."""
    sent_s, delay_s = read_samples(path, flag)
    if len(sent_s) < 2 or np.isnan(sent_s).any():
        raise ConfigurationError(f"{flag}: {path} lacks send times; valid: two messages or more, each with its sent_ns")
    return LinkSample(sent_s, delay_s)


def play(profile: LinkProfile, sent_s: Sequence[float], size_bytes: int) -> tuple[LinkSample, DelayLine[int]]:
    """Run the model of a link once in virtual time, where each message is released exactly when it is due.

    Return the delays, and the delay line with its counts.
    """
    line: DelayLine[int] = DelayLine(profile)
    delay_s = np.full(len(sent_s), math.nan)

    def deliver(until_s: float) -> None:
        while (due_s := line.next_due()) is not None and due_s <= until_s:
            for number in line.pop(due_s):
                # The first of two copies counts.
                if math.isnan(delay_s[number]):
                    delay_s[number] = due_s - sent_s[number]

    for number, now_s in enumerate(sent_s):
        deliver(now_s)
        line.push(now_s, number, size_bytes)
    deliver(math.inf)
    return LinkSample(np.array(sent_s), delay_s), line


def distance(one: LinkSample, other: LinkSample) -> float:
    """Return the Kolmogorov-Smirnov statistic D between the delays of two samples; 1 if one has no arrivals."""
    if one.arrived_s.size == 0 or other.arrived_s.size == 0:
        return 1.0
    return float(stats.ks_2samp(one.arrived_s, other.arrived_s, method="asymp").statistic)


@dataclass(frozen=True)
class Band:
    """Range in which runs of the model itself, with different seeds, differ."""

    pairs: int
    distance: float
    """Value below which D is for 99 % of all pairs of runs"""
    figures: dict[str, tuple[float, float]]
    """Range in which 99 % of all runs are, by figure"""


FIGURES: dict[str, Callable[[LinkSample], float]] = {
    "mean delay, ms": lambda sample: 1e3 * sample.mean_s,
    "sd of delay, ms": lambda sample: 1e3 * sample.sd_s,
    "lost share": lambda sample: sample.loss_share,
    "messages lost in a row": lambda sample: sample.mean_burst,
}


def independent_delays(profile: LinkProfile) -> bool:
    """Return whether each delay is drawn independently, so that the delays of a run have the model's distribution.

    netem's correlation of delays is no exception, as it leaves delays independent.
    """
    return profile.model == "datagram" and profile.jitter_s > 0.0 and profile.rate is None and profile.trace is None


def needs_band(profile: LinkProfile) -> bool:
    """Return whether delays or losses depend on earlier ones; a recording is then judged by the model's own band."""
    return profile.loss is not None or not independent_delays(profile)


def compare_one(profile: LinkProfile, reference: LinkSample, seed: int, size_bytes: int) -> Row:
    """Run the model with the recording's times of sending and this seed; return its figures as a row.

    distance: D between model and recording; None if delays do not vary.
    """
    run = _run(profile, reference, seed, size_bytes)
    varies = profile.jitter_s > 0.0 or profile.trace is not None
    return {
        "distance": distance(run, reference) if varies else None,
        "mean_error_ms": 1e3 * (run.mean_s - reference.mean_s),
        "sd_error_ms": 1e3 * (run.sd_s - reference.sd_s),
        "late_share": run.late_share,
        "loss_share": run.loss_share,
        "mean_burst": run.mean_burst,
    }


def pair_of_runs(
    profile: LinkProfile, reference: LinkSample, pair: int, size_bytes: int
) -> tuple[float, list[list[float]]]:
    """Run the model twice, with the two seeds of `pair`; return D between both runs, and the figures of each."""
    first = _FIRST_SEED_OF_BAND + 2 * pair
    runs = [_run(profile, reference, seed, size_bytes) for seed in (first, first + 1)]
    return distance(*runs), [[measure(run) for measure in FIGURES.values()] for run in runs]


def band_of(pairs: Sequence[tuple[float, Sequence[Sequence[float]]]]) -> Band:
    """Return the band that many pairs of runs give."""
    low, high = np.quantile([figures for _, both in pairs for figures in both], _BAND, axis=0)
    ranges = {name: (float(low[place]), float(high[place])) for place, name in enumerate(FIGURES)}
    return Band(len(pairs), float(np.quantile([apart for apart, _ in pairs], 0.99)), ranges)


def judge(profile: LinkProfile, reference: LinkSample, results: Sequence[Row], band: Band | None) -> list[Goal]:
    """Return the goals for a recording: fixed limits for independent delays, else limits by the model's own band.

    results: rows of `compare_one`.
    """

    def median(name: str) -> float:
        values = [value for result in results if (value := result[name]) is not None]
        return float(np.median(values)) if values else math.nan

    goals = []
    apart = "median Kolmogorov-Smirnov D"
    if independent_delays(profile):
        late_error = abs(median("late_share") - reference.late_share)
        goals += [
            Goal(apart, median("distance"), LARGEST_DISTANCE),
            Goal("median error of the mean, ms", abs(median("mean_error_ms")), LARGEST_MOMENT_ERROR_MS),
            Goal("median error of the sd, ms", abs(median("sd_error_ms")), LARGEST_MOMENT_ERROR_MS),
            Goal(
                "median error of the reordered share",
                late_error,
                LARGEST_LATE_ERROR,
                detail=f"recorded {reference.late_share:.3f}",
            ),
        ]
    elif band is not None and not math.isnan(median("distance")):
        detail = f"99 % of {band.pairs} pairs of the model's own runs"
        goals.append(Goal(apart, median("distance"), band.distance, detail=detail))
    if band is not None:
        for name in (name for name in FIGURES if ("delay" in name) == (profile.loss is None)):
            value, (low, high) = FIGURES[name](reference), band.figures[name]
            claim = f"recorded {name}, in the model's own 99 % band"
            goals += [Goal(claim, value, low, "at least"), Goal(claim, value, high)]
    return goals


def _run(profile: LinkProfile, reference: LinkSample, seed: int, size_bytes: int) -> LinkSample:
    return play(dataclasses.replace(profile, seed=seed), reference.sent_s.tolist(), size_bytes)[0]
