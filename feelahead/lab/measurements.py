"""Marked tables of docs/, made from the CSV files in figures/, which `make figures` measures.

    python -m feelahead.lab.measurements

Each table stands between two markers, of which the first names its file.
"""

import csv
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from statistics import fmean, median
from typing import Any, Final

from feelahead.lab.approaches.evaluation import LINKS
from feelahead.lab.approaches.pulls import PULL_KINDS
from feelahead.lab.goals import Goal
from feelahead.lab.intervals import mean_interval
from feelahead.lab.questions import coverage, haptics, tick
from feelahead.lab.table import Table
from feelahead.printing.figures import short

ROOT: Final = Path(__file__).parents[2]
DOCUMENTS: Final = tuple(ROOT / "docs" / name for name in ("measurements.md", "feel.md"))
FIGURES: Final = ROOT / "figures"
MARKED: Final = re.compile(
    r"(<!-- (?P<name>(?P<file>\w+)[^\n]*?): by make figures -->\n).*?(?P<end><!-- end -->)", re.DOTALL
)
_PLAIN: Final = {"": None, "True": True, "False": False}
ARMS: Final = ("off", "mechanical", "reacting")
_LIFTED_MM: Final = 50.0

Lines = Iterable[Iterable[str]]


def read(name: str, figures: Path = FIGURES) -> Table:
    """Return the table of a CSV file; figures are numbers again."""
    with (figures / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return Table({column: _value(text) for column, text in row.items()} for row in csv.DictReader(file))


def _value(text: str) -> Any:
    try:
        return _PLAIN[text] if text in _PLAIN else float(text)
    except ValueError:
        return text


def written(text: str, figures: Path = FIGURES) -> str:
    """Return a document with each marked table made anew, and the commit of its figures.

    A table whose file is missing stays as it is.
    """
    commits = dict(line.split() for line in (figures / "commits").read_text(encoding="utf-8").splitlines())

    def anew(found: re.Match[str]) -> str:
        if not (figures / f"{found['file']}.csv").exists():
            return found[0]
        lines = [f"| {' | '.join(cells)} |" for cells in TABLES[found["name"]](read(found["file"], figures))]
        lines.insert(1, "|---" * (lines[0].count("|") - 1) + "|")
        return "\n".join([found[1] + f"Commit {commits[found['file']]}:\n", *lines, found["end"]])

    return MARKED.sub(anew, text)


def _haptics(trials: Table) -> Lines:
    """Yield a row for each scene and delay, then one for each scene, then one for wall and slot together."""
    yield (
        "scene, each way",
        "trials with a hit, at mm/s: off",
        "on, no notice taken",
        "on, reacts",
        "placed: off / on / reacts",
        "finished, s (mean): off / on / reacts",
        "longer than off, s [95 %]: on",
        "reacts",
        "R2 at full strength, share of the time that it is pulled: on / reacts",
    )
    for (scene, delay_ms), those in trials.groups("scene", "delay_ms"):
        yield f"{scene}, {delay_ms:g} ms", *compared(those)
    ahead = Table(row for row in trials if row["scene"] in ("wall", "slot"))
    for name, those in (
        *((f"{scene}, all", rows) for (scene,), rows in trials.groups("scene")),
        ("wall and slot", ahead),
    ):
        if len(those):
            yield f"**{name}**", *compared(those)


def compared(trials: Table) -> Iterator[str]:
    """Yield the entries of one row: each condition's trials, and how much longer they take than those without haptics.

    Trials of a seed share scene and errors, so an interval resamples the seeds, each with its mean over its trials.
    """
    of = {arm: trials.where(arm=arm) for arm in ARMS}
    for those in of.values():
        speeds = those.values("fastest_hit_mm_s")
        hits = f"{sum(row['hits'] > 0 for row in those)}/{len(those)}"
        yield f"{hits} at {median(speeds):.0f} ({max(speeds):.0f})" if speeds else hits
    yield " / ".join(f"{sum(those.values('placed')):g}" for those in of.values())
    yield " / ".join(f"{fmean(_times_s(those)):.1f}" for those in of.values())
    means_s = {arm: {seed: fmean(_times_s(rows)) for (seed,), rows in of[arm].groups("seed")} for arm in ARMS}
    for arm in ARMS[1:]:
        longer_s = [means_s[arm][seed] - off_s for seed, off_s in means_s["off"].items()]
        yield "{:+.1f} [{:+.1f}, {:+.1f}]".format(fmean(longer_s), *mean_interval(longer_s))
    yield " / ".join(f"{100 * fmean(of[arm].values('full_share')):.0f} %" for arm in ARMS[1:])


def _times_s(trials: Table) -> list[float]:
    return haptics.restricted([row["finished_s"] for row in trials], haptics.HapticsSettings().duration)


def _demo(runs: Table) -> Lines:
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


def _tick(rows: Table) -> Lines:
    """Yield the stages of the demo's tick, then the looks at concave objects."""
    yield "", "p50, us", "p99, us", "p50, ratio", "p99, ratio"
    demo = rows.where(case="demo")
    law = rows.where(case="demo, each stage timed", stage="whole look")
    looks = (row for row in rows if row["stage"].startswith("field of"))
    for row in (*demo, *law, *looks):
        yield row["stage"], *(short(row[name]) for name in ("p50_us", "p99_us", "p50_of_mixed", "p99_of_mixed"))


def _definition(looks: Table) -> Lines:
    yield "looks", "distances", "latest, mm", "earliest, mm", "grazes", "grazes out of their tolerance"
    counts = {name: f"{sum(looks.values(name)):g}" for name in ("looks", "distances", "grazes", "out_of_band")}
    ends = f"{max(looks.values('latest_mm')):+.3f}", f"{min(looks.values('earliest_mm')):+.3f}"
    yield counts["looks"], counts["distances"], *ends, counts["grazes"], counts["out_of_band"]


def _cover(parts: Table) -> Lines:
    yield "part", "spheres", "sticks out of its spheres, mm", "spheres stand out, mm"
    for row in parts:
        yield row["part"], f"{row['spheres']:g}", short(row["sticks_out_mm"]), short(row["stands_out_mm"])
    yield (
        "all",
        f"{sum(parts.values('spheres')):g}",
        *(short(max(parts.values(name))) for name in ("sticks_out_mm", "stands_out_mm")),
    )


def _coverage(cells: Table) -> Lines:
    """Yield a row for each pull and link; entries of the probabilities are separated by a slash."""
    yield (
        "pull",
        "link",
        "cells that hold",
        "covered at least (scene, at the greatest P)",
        "false alarms a minute",
        "share of the time",
    )
    order = PULL_KINDS.index, list(LINKS).index
    groups = Table(sorted(cells, key=lambda row: (order[0](row["pull"]), order[1](row["link"])))).groups("pull", "link")
    for (pull, link), those in groups:
        of = [rows for _, rows in those.groups("probability")]
        ahead = [Table(row for row in rows if row["coverage"] is not None) for rows in of]
        holds = [f"{sum(rows.values('holds')):g}" for rows in ahead]
        least = [min(rows, key=lambda row: float(row["coverage"])) for rows in ahead]
        yield (
            *(pull, link, f"{' / '.join(holds)} of {len(ahead[-1])}"),
            " / ".join(f"{row['coverage']:.3f}" for row in least) + f" ({least[-1]['scene']})",
            *map(" / ".join, zip(*map(coverage.pooled_alarms, of), strict=True)),
        )


def _alarms(cells: Table) -> Lines:
    """Yield a row for each kind of scene and pull, over all probabilities; of swerves in clutter one for each link."""
    yield "scenes", "pull", "link", "false alarms a minute", "share of the time", "minutes"
    clutter, passed = cells.where(scene="cluttered"), Table(row for row in cells if row["coverage"] is None)
    ahead = Table(row for row in cells if row["coverage"] is not None)
    moving = Table(row for row in ahead if row["scene"].endswith("mm/s"))
    resting = Table(row for row in ahead if not row["scene"].endswith("mm/s"))
    free = Table(row for row in passed if row["scene"] != "cluttered")
    kinds = [
        ("nothing ahead", "all", "all", free),
        ("clutter beside", "all but swerve", "all", Table(row for row in clutter if row["pull"] != "swerve")),
        *(("clutter beside", "swerve", link, rows) for (link,), rows in clutter.where(pull="swerve").groups("link")),
        *(("an object ahead", pull, "all", rows) for (pull,), rows in resting.groups("pull")),
        ("an object that comes", "bell", "all", Table(row for row in moving if "coming" in row["scene"])),
        ("an object that flees", "bell", "all", Table(row for row in moving if "fleeing" in row["scene"])),
    ]
    for name, pull, link, rows in kinds:
        yield name, pull, link, *coverage.pooled_alarms(rows), f"{sum(rows.values('judged_s')) / 60.0:.0f}"


def _goals(goals: Iterable[Goal]) -> Lines:
    yield "goal", "measured", "asked", ""
    for goal in goals:
        value = "-" if goal.value is None else short(goal.value)
        yield goal.claim, value, f"{goal.compare} {short(goal.limit)}", goal.verdict


TABLES: Final[dict[str, Callable[[Table], Lines]]] = {
    "haptics": _haptics,
    "camera": _haptics,
    "demo": _demo,
    "definition": _definition,
    "tick": _tick,
    "tick: goals": lambda rows: _goals(tick.goals(tick.TickSweep(), rows)),
    "cover": _cover,
    "coverage": _coverage,
    "coverage: alarms": _alarms,
}


if __name__ == "__main__":
    for document in DOCUMENTS:
        document.write_text(written(document.read_text(encoding="utf-8")), encoding="utf-8")
