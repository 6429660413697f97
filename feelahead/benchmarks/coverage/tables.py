"""What the benchmark found, as tables and a picture for people."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from rich.table import Table

_COLOURS: Final = {"first": "#0072b2", "paper": "#d55e00", "margin": "#cc79a7", "none": "#777777", "full": "#009e73"}
_MARKS: Final = ("o", "s", "^", "D")
Row = dict[str, Any]


def coverage_table(rows: Sequence[Row], laws: Sequence[str]) -> Table:
    """A row for each cell and P that has contacts to prevent, a column for each law."""
    table = Table(
        title="covered: full strength stood in time",
        caption="share [95 % interval over approaches], * where it holds: lower end >= P - 0.1 (1 - P)",
    )
    for heading in ("scene", "pull", "link", "camera", "P", "n", *laws):
        table.add_column(heading)
    for key, group in _grouped(rows, ("scene", "pull", "link", "camera_mm", "encoder_factor", "probability")):
        by_law = {row["law"]: row for row in group}
        some = group[0]
        if some["places"] == 0:
            continue
        scene, pull, link, camera_mm, encoders, probability = key
        worse = f", encoders x{encoders:g}" if encoders != 1.0 else ""
        cells = [_covered(by_law.get(law)) for law in laws]
        table.add_row(scene, pull, link, f"{camera_mm:g} mm{worse}", f"{probability:g}", str(some["draws"]), *cells)
    return table


def alarm_table(rows: Sequence[Row], laws: Sequence[str]) -> Table:
    """A row for each cell, at the greatest P: false alarms a minute."""
    table = Table(
        title="false alarms a minute (share of the time)",
        caption="strength of 4 or more under the finger while the zone's stopping path stays D_σ(P) + 15 mm clear",
    )
    for heading in ("scene", "pull", "link", "P", "minutes", *laws):
        table.add_column(heading)
    for (scene, pull, link, probability), group in _grouped(rows, ("scene", "pull", "link", "probability")):
        by_law = {row["law"]: row for row in group}
        cells = [
            ""
            if (row := by_law.get(law)) is None
            else f"{row['alarms_per_min']:.1f} ({100 * row['alarm_share']:.0f} %)"
            for law in laws
        ]
        table.add_row(scene, pull, link, f"{probability:g}", f"{group[0]['judged_s'] / 60.0:.1f}", *cells)
    return table


def law_table(records: Iterable[Row], laws: Sequence[str]) -> Table:
    """A row for each law: over all cells, and what it costs."""
    records = list(records)
    table = Table(
        title="the laws side by side", caption="over all cells; slowdown: median time over time without haptics"
    )
    for heading in (
        *("law", "cells that hold", "covered", "strength that stood", "false alarms a minute"),
        *("slowdown, empty", "slowdown, cluttered"),
    ):
        table.add_column(heading)
    for law in laws:
        rows = [one for one in records if one["kind"] == "cell" and one["law"] == law]
        judged = [one for one in rows if one["coverage"] is not None]
        draws = sum(one["draws"] for one in judged)
        minutes = sum(one["judged_s"] for one in rows) / 60.0
        alarms = sum(one["alarms_per_min"] * one["judged_s"] / 60.0 for one in rows)
        covered = sum(one["coverage"] * one["draws"] for one in judged) / draws if draws else None
        strength = sum(one["mean_strength"] * one["draws"] for one in judged) / draws if draws else None
        table.add_row(
            law,
            f"{sum(bool(one['holds']) for one in judged)} of {len(judged)}",
            "" if covered is None else f"{covered:.3f}",
            "" if strength is None else f"{strength:.2f} of 8",
            f"{alarms / minutes:.1f}" if minutes else "",
            *(_slowdown(records, law, scene) for scene in ("empty", "cluttered")),
        )
    return table


def check_lines(records: Iterable[Row]) -> list[str]:
    """How often the closed loop in full physics did what the reckoning says."""
    checks = [one for one in records if one["kind"] == "check"]
    lines = []
    for kind in ("released early", "released late", "reacting"):
        some = [one for one in checks if one["kind_of_check"] == kind]
        agreed = sum(one["expected_contact"] == one["contact"] for one in some)
        if some:
            lines.append(f"closed loop, {kind}: {agreed} of {len(some)} as reckoned")
    return lines


def draw(records: Iterable[Row], laws: Sequence[str], frozen: str, path: Path) -> None:
    """Coverage against false alarms, a point for each law and P over all cells."""
    from matplotlib import pyplot as plt  # noqa: PLC0415

    rows = [one for one in records if one["kind"] == "cell"]
    probabilities = sorted({one["probability"] for one in rows})
    figure, axes = plt.subplots(figsize=(7.2, 4.6), dpi=110, layout="constrained")
    for law in laws:
        colour = _COLOURS.get(law, "black")
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
    """False alarms a minute, and the share that is covered, over these rows; None without any."""
    judged = [one for one in rows if one["coverage"] is not None]
    seconds, draws = sum(one["judged_s"] for one in rows), sum(one["draws"] for one in judged)
    if seconds == 0.0 or draws == 0:
        return None
    alarms = sum(one["alarms_per_min"] * one["judged_s"] for one in rows) / seconds
    return alarms, sum(one["coverage"] * one["draws"] for one in judged) / draws


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
