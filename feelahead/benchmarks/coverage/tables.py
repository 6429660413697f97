"""What the benchmark found, as tables and a picture for people."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from rich.box import MARKDOWN
from rich.table import Table
from rich.text import Text

from feelahead.benchmarks.coverage.cells import LINKS
from feelahead.lab.approaches.pulls import PULL_KINDS
from feelahead.lab.figures import LAW_COLOURS

_MARKS: Final = ("o", "s", "^", "D")
Row = dict[str, Any]


_CELL: Final = ("scene", "pull", "link", "camera_mm", "encoder_factor", "probability")


def coverage_table(rows: Sequence[Row], laws: Sequence[str]) -> Table:
    """A row for each cell and P that has contacts to prevent, a column for each law."""
    table = Table(
        title="covered: full strength stood in time",
        caption=Text(
            "n: draws (approaches). Share [95 % interval over approaches], * where it holds: lower end >="
            " P - 0.1 (1 - P), 10 approaches or more. Apart: places that no release avoids / that were not found"
        ),
    )
    for heading in ("scene", "pull", "link", "camera", "P", "n", "apart", *laws):
        table.add_column(heading)
    for key, group in _grouped(rows, _CELL):
        by_law = {row["law"]: row for row in group}
        some = group[0]
        if some["places"] + some["not_found"] == 0:
            continue
        cells = [_covered(by_law.get(law)) for law in laws]
        count, apart = f"{some['draws']} ({some['approaches']})", f"{some['unavoidable']} / {some['not_found']}"
        table.add_row(*(Text(text) for text in (*_named(key), count, apart, *cells)))
    return table


def alarm_table(rows: Sequence[Row], laws: Sequence[str]) -> Table:
    """A row for each cell and P, a column for each law."""
    table = Table(
        title="false alarms a minute (share of the time in which R2 is pulled)",
        caption="strength of 4 or more under the finger while the zone's stopping path stays D_σ(P) + 15 mm clear",
    )
    for heading in ("scene", "pull", "link", "camera", "P", "minutes", *laws):
        table.add_column(heading)
    for key, group in _grouped(rows, _CELL):
        by_law = {row["law"]: row for row in group}
        cells = [_alarms(by_law.get(law)) for law in laws]
        table.add_row(*_named(key), f"{group[0]['judged_s'] / 60.0:.1f}", *cells)
    return table


def pull_table(rows: Sequence[Row], law: str) -> Table:
    """A row for each pull, link and P, for one law: over scenes, cameras and encoders."""
    # As Markdown, for docs/feel.md.
    table = Table(
        title=f"{law}, by pull and link",
        caption="once reported: of the draws in which the operator side had a report of the drift or turn in time",
        box=MARKDOWN,
    )
    for heading in (
        *("pull", "link", "P", "cells that hold", "covered", "least", "covered, once reported"),
        *("false alarms a minute", "most"),
    ):
        table.add_column(heading)
    links = list(LINKS)
    mine = [row for row in rows if row["law"] == law]
    mine.sort(key=lambda row: (PULL_KINDS.index(row["pull"]), links.index(row["link"])))
    for key, group in _grouped(mine, ("pull", "link", "probability")):
        judged = [one for one in group if one["coverage"] is not None]
        pulled = [one for one in group if one["alarms_per_min"] is not None]
        least = min(judged, key=lambda one: one["coverage"], default=None)
        most = max(pulled, key=lambda one: one["alarms_per_min"], default=None)
        table.add_row(
            *map(str, key),
            f"{sum(bool(one['holds']) for one in judged)} of {len(judged)}",
            _mean(judged, "coverage", ".3f"),
            f"{least['coverage']:.3f} ({least['scene']})" if least else "",
            _mean([one for one in judged if one["reported"]], "reported_coverage", ".3f"),
            _mean(pulled, "alarms_per_min", ".1f"),
            f"{most['alarms_per_min']:.1f} ({most['scene']})" if most else "",
        )
    return table


def law_table(records: Iterable[Row], laws: Sequence[str]) -> Table:
    """A row for each law and P: over all cells, and what it costs."""
    records = list(records)
    table = Table(
        title="the laws side by side",
        caption="means over the cells; slowdown at 200 ms and P = 0.99: median time over time without haptics",
    )
    for heading in (
        *("law", "P", "cells that hold", "covered", "strength that stood", "too late by, ms", "never"),
        *("false alarms a minute", "share"),
        *("slowdown, empty", "slowdown, cluttered"),
    ):
        table.add_column(heading)
    for law in laws:
        for number, probability in enumerate(sorted({one["probability"] for one in records if one["kind"] == "cell"})):
            rows = [
                one
                for one in records
                if one["kind"] == "cell" and one["law"] == law and one["probability"] == probability
            ]
            judged = [one for one in rows if one["coverage"] is not None]
            pulled = [one for one in rows if one["alarms_per_min"] is not None]
            slow = [_slowdown(records, law, scene) if number == 0 else "" for scene in ("empty", "cluttered")]
            table.add_row(
                law if number == 0 else "",
                f"{probability:g}",
                f"{sum(bool(one['holds']) for one in judged)} of {len(judged)}",
                _mean(judged, "coverage", ".3f"),
                _mean(judged, "mean_strength", ".2f"),
                _mean([one for one in judged if one["late_ms"] is not None], "late_ms", ".0f"),
                _mean(judged, "never", ".0%"),
                _mean(pulled, "alarms_per_min", ".1f"),
                _mean(pulled, "alarm_share", ".0%"),
                *slow,
            )
    return table


def _mean(rows: Sequence[Row], name: str, form: str) -> str:
    return format(sum(one[name] for one in rows) / len(rows), form) if rows else ""


def _named(key: tuple[Any, ...]) -> tuple[str, ...]:
    scene, pull, link, camera_mm, encoders, probability = key
    worse = f", encoders x{encoders:g}" if encoders != 1.0 else ""
    return scene, pull, link, f"{camera_mm:g} mm{worse}", f"{probability:g}"


def _alarms(row: Row | None) -> str:
    if row is None or row["alarms_per_min"] is None:
        return ""
    return f"{row['alarms_per_min']:.1f} ({100 * row['alarm_share']:.0f} %)"


def check_lines(records: Iterable[Row]) -> list[str]:
    """How often the closed loop in full physics did what the reckoning says, and where it did not."""
    checks = [one for one in records if one["kind"] == "check"]
    lines = []
    for kind in ("released early", "released late", "reacting"):
        some = [one for one in checks if one["kind_of_check"] == kind]
        others = [f"{one['pull']}, {one['link']}" for one in some if one["expected_contact"] != one["contact"]]
        if some:
            but = f"; not: {'; '.join(others)}" if others else ""
            lines.append(f"closed loop, {kind}: {len(some) - len(others)} of {len(some)} as reckoned{but}")
    return lines


def draw(records: Iterable[Row], laws: Sequence[str], frozen: str, path: Path) -> None:
    """Coverage against false alarms, a point for each law and P over all cells."""
    from matplotlib import pyplot as plt  # noqa: PLC0415

    rows = [one for one in records if one["kind"] == "cell"]
    probabilities = sorted({one["probability"] for one in rows})
    figure, axes = plt.subplots(figsize=(7.2, 4.6), dpi=110, layout="constrained")
    for law in laws:
        colour = LAW_COLOURS[law]
        axes.plot([], [], color=colour, linewidth=4.0, label=law)
        points = [_point([one for one in rows if one["law"] == law and one["probability"] == p]) for p in probabilities]
        known = [point for point in points if point is not None]
        axes.plot([x for x, _ in known], [y for _, y in known], color=colour, linewidth=0.8)
        for mark, point in zip(_MARKS, points, strict=False):
            if point is not None:
                axes.plot(*point, mark, color=colour, alpha=0.8)
    for mark, probability in zip(_MARKS, probabilities, strict=False):
        axes.plot([], [], mark, color="black", label=f"P = {probability:g}")
    axes.set(xlabel="false alarms a minute", ylabel="covered: full strength in time", ylim=(-0.03, 1.03))
    axes.set_xscale("symlog", linthresh=0.1)
    axes.set_xlim(-0.02, 200.0)
    axes.grid(alpha=0.3)
    axes.legend(loc="center", fontsize=8)
    axes.set_title(f"all cells together (frozen {frozen})", fontsize=9)
    figure.savefig(path)
    plt.close(figure)


def _point(rows: Sequence[Row]) -> tuple[float, float] | None:
    """False alarms a minute and the share that is covered, means over the cells; None without any."""
    judged = [one["coverage"] for one in rows if one["coverage"] is not None]
    pulled = [one["alarms_per_min"] for one in rows if one["alarms_per_min"] is not None]
    return (sum(pulled) / len(pulled), sum(judged) / len(judged)) if judged and pulled else None


def _grouped(rows: Sequence[Row], names: tuple[str, ...]) -> list[tuple[tuple[Any, ...], list[Row]]]:
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in names), []).append(row)
    return list(groups.items())


def _covered(row: Row | None) -> str:
    if row is None or row["coverage"] is None:
        return "none avoidable" if row is not None else ""
    star = "*" if row["holds"] else ""
    return f"{row['coverage']:.3f} [{row['low']:.2f} to {row['high']:.2f}]{star}"


def _slowdown(records: Sequence[Row], law: str, scene: str) -> str:
    for one in records:
        if one["kind"] == "slowdown" and one["law"] == law and one["scene"] == scene:
            arrived = f"{one['arrived']} of {one['seeds']} arrive"
            return arrived if one["ratio"] is None else f"{one['ratio']:.2f} ({arrived})"
    return ""
