"""Tables of simulated people: trials without haptics, with them, and with a person who reacts; and the demo's tasks."""

from collections.abc import Iterator, Sequence
from statistics import fmean, median
from typing import Final

from feelahead.lab.intervals import mean_interval
from feelahead.lab.measurements.lines import Lines
from feelahead.lab.questions import haptics as question
from feelahead.lab.table import Table

ARMS: Final = {"off": "off", "mechanical": "on, no notice taken", "reacting": "on, reacts"}
_SHORT: Final = {"off": "off", "mechanical": "on", "reacting": "reacts"}
_LIFTED_MM: Final = 50.0


def haptics(trials: Table) -> Lines:
    """Yield a row for each scene and delay, then one for each scene, then one for wall and slot together."""
    arms = [arm for arm in ARMS if len(trials.where(arm=arm))]
    names = [_SHORT[arm] for arm in arms]
    yield (
        "scene, each way",
        "trials with a hit, at mm/s: off",
        *(ARMS[arm] for arm in arms[1:]),
        f"placed: {' / '.join(names)}",
        f"finished, s (mean): {' / '.join(names)}",
        *(f"longer than off, s [95 %]: {name}" for name in names[1:2]),
        *names[2:],
        f"R2 at full strength, share of the time that it is pulled: {' / '.join(names[1:])}",
    )
    for (scene, delay_ms), those in trials.groups("scene", "delay_ms"):
        yield f"{scene}, {delay_ms:g} ms", *compared(those, arms)
    ahead = Table(row for row in trials if row["scene"] in ("wall", "slot"))
    for name, those in (
        *(
            (f"{scene}, all", rows)
            for (scene,), rows in trials.groups("scene")
            if len(set(rows.values("delay_ms"))) > 1
        ),
        ("wall and slot", ahead),
    ):
        if len(those):
            yield f"**{name}**", *compared(those, arms)


def compared(trials: Table, arms: Sequence[str]) -> Iterator[str]:
    """Yield the entries of one row: each condition's trials, and how much longer they take than those without haptics.

    Trials of a seed share scene and errors, so an interval resamples the seeds, each with its mean over its trials.
    """
    of = {arm: trials.where(arm=arm) for arm in arms}
    for those in of.values():
        speeds = those.values("fastest_hit_mm_s")
        hits = f"{sum(row['hits'] > 0 for row in those)}/{len(those)}"
        yield f"{hits} at {median(speeds):.0f} ({max(speeds):.0f})" if speeds else hits
    yield " / ".join(f"{sum(those.values('placed')):g}" for those in of.values())
    yield " / ".join(f"{fmean(_times_s(those)):.1f}" for those in of.values())
    means_s = {arm: {seed: fmean(_times_s(rows)) for (seed,), rows in of[arm].groups("seed")} for arm in arms}
    for arm in arms[1:]:
        longer_s = [means_s[arm][seed] - off_s for seed, off_s in means_s["off"].items()]
        yield "{:+.1f} [{:+.1f}, {:+.1f}]".format(fmean(longer_s), *mean_interval(longer_s))
    yield " / ".join(f"{100 * fmean(of[arm].values('full_share')):.0f} %" for arm in arms[1:])


def _times_s(trials: Table) -> list[float]:
    return question.restricted([row["finished_s"] for row in trials], question.HapticsSettings().duration)


def demo(runs: Table) -> Lines:
    """Yield a row for each link."""
    yield (
        "link",
        "grasped",
        "lifted",
        "placed, upright",
        "felt before it touched",
        "s before",
        "mm before",
        "touched at, mm/s",
        "contacts with anything else",
        "finished, s",
    )
    for (link,), those in runs.groups("link"):
        counts = {name: f"{sum(those.values(name)):g}" for name in ("grasped", "placed", "hits")}
        yield (
            link or "none",
            f"{counts['grasped']} of {len(those)}",
            str(sum(lifted > _LIFTED_MM for lifted in those.values("lifted_mm"))),
            counts["placed"],
            str(sum(early > 0.0 for early in those.values("felt_before_s"))),
            _range(those.values("felt_before_s"), 2),
            _range(those.values("felt_before_mm"), 0),
            _range(those.values("placing_speed_mm_s"), 0),
            counts["hits"],
            _range(those.values("finished_s"), 1),
        )


def _range(values: list[float], digits: int) -> str:
    ends = dict.fromkeys(f"{end:.{digits}f}" for end in (min(values), max(values))) if values else {"-": None}
    return " to ".join(ends)
