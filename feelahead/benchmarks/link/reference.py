"""The model beside a recording: the same send times, one run for each of fixed seeds, and a verdict."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from common.emulation.profile import LinkProfile
from feelahead.benchmarks.link.samples import LinkSample, distance, play
from feelahead.benchmarks.report import Goal, Table

LARGEST_DISTANCE = 0.03
LARGEST_MOMENT_ERROR_MS = 0.3
LARGEST_LATE_ERROR = 0.02
BAND_LOW, BAND_HIGH = 0.005, 0.995
"""Of 99 %: what lies beyond is as rare as one run in a hundred."""


@dataclass(frozen=True)
class SeedResult:
    """One run of the model beside the recording."""

    seed: int
    distance: float | None
    """Kolmogorov-Smirnov D; None where nothing varies."""
    mean_error_ms: float
    sd_error_ms: float
    late_share: float
    loss_share: float
    mean_burst: float


@dataclass(frozen=True)
class Band:
    """What the model's own runs differ by: 99 % of pairs of runs are closer than `distance`."""

    pairs: int
    distance: float
    figures: dict[str, tuple[float, float]]
    """By name: the range in which 99 % of runs lie."""


FIGURES: dict[str, Callable[[LinkSample], float]] = {
    "mean delay, ms": lambda sample: 1e3 * sample.mean_s,
    "sd of delay, ms": lambda sample: 1e3 * sample.sd_s,
    "lost share": lambda sample: sample.loss_share,
    "messages lost in a row": lambda sample: sample.mean_burst,
}


def independent_delays(profile: LinkProfile) -> bool:
    """Whether each delay is drawn by itself, so that a run's distribution is the model's up to sampling error."""
    return (
        profile.model == "datagram"
        and profile.jitter_s > 0.0
        and profile.rate is None
        and profile.slot is None
        and profile.trace is None
    )


def compare(
    profile: LinkProfile, reference: LinkSample, seeds: int, size_bytes: int, advance: Callable[[], object]
) -> list[SeedResult]:
    """Run the model with the recording's send times for the seeds 0 to `seeds` − 1."""
    results = []
    for seed in range(seeds):
        run = _run(profile, reference.sent_s, seed, size_bytes)
        results.append(
            SeedResult(
                seed,
                distance(run, reference) if profile.jitter_s > 0.0 or profile.trace is not None else None,
                1e3 * (run.mean_s - reference.mean_s),
                1e3 * (run.sd_s - reference.sd_s),
                run.late_share,
                run.loss_share,
                run.mean_burst,
            )
        )
        advance()
    return results


def measure_band(
    profile: LinkProfile, reference: LinkSample, pairs: int, size_bytes: int, advance: Callable[[], object]
) -> Band:
    """How far the model's runs differ from each other, by `pairs` pairs of them with seeds from 1000 on."""
    distances, figures = [], []
    for pair in range(pairs):
        runs = [_run(profile, reference.sent_s, 1000 + 2 * pair + side, size_bytes) for side in (0, 1)]
        distances.append(distance(*runs))
        figures += [[measure(run) for measure in FIGURES.values()] for run in runs]
        advance()
    low, high = np.quantile(figures, [BAND_LOW, BAND_HIGH], axis=0)
    ranges = {name: (float(low[place]), float(high[place])) for place, name in enumerate(FIGURES)}
    return Band(pairs, float(np.quantile(distances, 0.99)), ranges)


def judge(profile: LinkProfile, reference: LinkSample, results: Sequence[SeedResult], band: Band | None) -> list[Goal]:
    """The verdicts: fixed limits for independent delays, the model's own band for what depends on its past."""
    goals = []
    distances = [result.distance for result in results if result.distance is not None]
    if independent_delays(profile):
        goals += [
            Goal("median Kolmogorov-Smirnov D", _median(distances), LARGEST_DISTANCE),
            Goal(
                "median error of the mean, ms",
                abs(_median([result.mean_error_ms for result in results])),
                LARGEST_MOMENT_ERROR_MS,
            ),
            Goal(
                "median error of the sd, ms",
                abs(_median([result.sd_error_ms for result in results])),
                LARGEST_MOMENT_ERROR_MS,
            ),
            Goal(
                "median error of the reordered share",
                abs(_median([result.late_share for result in results]) - reference.late_share),
                LARGEST_LATE_ERROR,
                detail=f"recorded {reference.late_share:.3f}",
            ),
        ]
    elif band is not None and distances:
        goals.append(
            Goal(
                "median Kolmogorov-Smirnov D",
                _median(distances),
                band.distance,
                detail=f"99 % of {band.pairs} pairs of the model's own runs",
            )
        )
    if band is not None:
        names = [name for name in FIGURES if ("delay" in name) == (profile.loss is None)]
        for name in names:
            value, (low, high) = FIGURES[name](reference), band.figures[name]
            claim = f"recorded {name}, in the model's own 99 % band"
            goals += [Goal(claim, value, low, "at least"), Goal(claim, value, high)]
    return goals


def table(reference: LinkSample, stalls: int, results: Sequence[SeedResult]) -> Table:
    """Every seed, then the median, beside the recording."""
    rows = [_row(str(result.seed), result) for result in results]
    rows.append(
        _row(
            "median",
            SeedResult(
                -1,
                _median([result.distance for result in results if result.distance is not None])
                if results[0].distance is not None
                else None,
                *(
                    _median([getattr(result, part.name) for result in results])
                    for part in dataclasses.fields(SeedResult)[2:]
                ),
            ),
        )
    )
    recorded = SeedResult(-1, None, 0.0, 0.0, reference.late_share, reference.loss_share, reference.mean_burst)
    rows.append(_row("recorded", recorded))
    return Table(
        "The model beside the recording",
        ("seed", "D", "mean, ms too long", "sd, ms too wide", "reordered", "lost", "in a row"),
        rows,
        f"Recorded: {reference.arrived_s.size} delays, mean {1e3 * reference.mean_s:.2f} ms, "
        f"sd {1e3 * reference.sd_s:.2f} ms; left out as stalls of the host: {stalls}.",
    )


def _run(profile: LinkProfile, sent_s: np.ndarray, seed: int, size_bytes: int) -> LinkSample:
    return play(dataclasses.replace(profile, seed=seed), sent_s.tolist(), size_bytes)[0]


def _row(name: str, result: SeedResult) -> tuple[str, ...]:
    return (
        name,
        "-" if result.distance is None else f"{result.distance:.4f}",
        f"{result.mean_error_ms:+.3f}",
        f"{result.sd_error_ms:+.3f}",
        f"{result.late_share:.4f}",
        f"{result.loss_share:.4f}",
        f"{result.mean_burst:.2f}",
    )


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")
