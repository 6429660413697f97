"""A recording of netem beside our model, which is given the same send times."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from common.emulation.profile import LinkProfile
from feelahead.benchmarks.report import Table
from feelahead.lab.goals import Goal
from feelahead.lab.link.samples import LinkSample, compare, independent_delays, judge, measure_band, play
from tests.netem.cases import PATH_CASE, PAYLOAD_BYTES, PERIOD_NS, Case
from tests.netem.stalls import stalled

SEEDS, PAIRS = 20, 100
STREAM_MEAN_MS, STREAM_SD_MS = 2.0, 1.0
QUIET_SHARE = 0.05
"""Of messages that the host held up: with more of them a miss says nothing."""
_HEADERS_BYTES = 42
_COLUMNS = (
    *("link", "netem: mean", "sd", "p99, ms", "ours: mean", "sd", "p99, ms", "D"),
    *("lost, %: netem", "ours", "held up", "verdict"),
)


@dataclass(frozen=True)
class Comparison:
    """One case, recorded and modelled."""

    case: Case
    recorded: LinkSample
    runs: Sequence[LinkSample]
    goals: Sequence[Goal]
    distance: float | None
    held_up: int
    """Messages left out because the host stalled."""

    @property
    def missed(self) -> list[Goal]:
        """The goals that were not reached."""
        return [goal for goal in self.goals if goal.verdict != "met"]

    @property
    def quiet(self) -> bool:
        """Whether the host left the machine enough time for a miss to mean something."""
        return self.held_up <= QUIET_SHARE * self.recorded.sent_s.size

    @property
    def verdict(self) -> str:
        """For people."""
        if not self.case.judged:
            return "shown"
        return "met" if not self.missed else "missed" if self.quiet else "not judged"


def path_time_s(sample: LinkSample) -> float:
    """How much later than due a message arrives, by the recording of `PATH_CASE`."""
    return float(np.median(sample.arrived_s)) - LinkProfile.parse(PATH_CASE.netem).delay_s


def compare_with_model(case: Case, sample: LinkSample, path_s: float) -> Comparison:
    """What the recording and the model have in common; datagrams took `path_s` besides what netem did."""
    profile = LinkProfile.parse(case.netem, 0, case.model)
    size_bytes = PAYLOAD_BYTES + _HEADERS_BYTES
    held_up = np.zeros(sample.sent_s.size, dtype=np.bool_)
    # Whether a message is lost does not depend on when the machine runs.
    if profile.loss is None:
        held_up = stalled(sample, 1e-9 * PERIOD_NS)
    own_s = path_s if case.model == "datagram" and profile.delay_s > 0.0 else 0.0
    kept = LinkSample(sample.sent_s, np.where(held_up, np.nan, np.maximum(0.0, sample.delay_s - own_s)))
    beyond = 0
    if profile.loss is None:
        kept, beyond = kept.without_stalls(profile)
    sent_s = kept.sent_s.tolist()
    runs = [play(dataclasses.replace(profile, seed=seed), sent_s, size_bytes)[0] for seed in range(SEEDS)]
    goals: list[Goal] = []
    distance = None
    if case.model == "stream":
        goals = [
            Goal(f"difference of the {name}, ms", abs(_median(runs, part) - 1e3 * part(kept)), limit)
            for name, part, limit in (("mean", _mean_s, STREAM_MEAN_MS), ("sd", _sd_s, STREAM_SD_MS))
        ]
    else:
        results = compare(profile, kept, SEEDS, size_bytes, _nothing)
        band = None if independent_delays(profile) else measure_band(profile, kept, PAIRS, size_bytes, _nothing)
        goals = judge(profile, kept, results, band)
        distances = [result.distance for result in results if result.distance is not None]
        distance = float(np.median(distances)) if distances else None
    return Comparison(case, kept, runs, goals, distance, int(held_up.sum()) + beyond)


def table(comparisons: Sequence[Comparison], path_s: float) -> Table:
    """A row for each case: the recording, and the median of the model's runs."""
    rows = []
    for one in comparisons:
        parts = (_mean_s, _sd_s, _p99_s)
        lossy = "loss" in one.case.netem and one.case.model == "datagram"
        rows.append(
            (
                f"{one.case.netem} ({one.case.model})",
                *(f"{1e3 * part(one.recorded):.2f}" for part in parts),
                *(f"{_median(one.runs, part):.2f}" for part in parts),
                "-" if one.distance is None else f"{one.distance:.4f}",
                f"{100.0 * one.recorded.loss_share:.2f}" if lossy else "-",
                f"{0.1 * _median(one.runs, lambda run: run.loss_share):.2f}" if lossy else "-",
                f"{one.held_up} of {one.case.messages}",
                one.verdict,
            )
        )
    note = (
        f"From netem's datagrams the path's own {1e3 * path_s:.3f} ms are taken off. D is the median of {SEEDS} seeds."
    )
    return Table("The kernel's netem beside ours", _COLUMNS, rows, note)


def _mean_s(sample: LinkSample) -> float:
    return sample.mean_s


def _sd_s(sample: LinkSample) -> float:
    return sample.sd_s


def _p99_s(sample: LinkSample) -> float:
    return float(np.quantile(sample.arrived_s, 0.99))


def _median(runs: Sequence[LinkSample], part: Callable[[LinkSample], float]) -> float:
    return 1e3 * float(np.median([part(run) for run in runs]))


def _nothing() -> None:
    pass
