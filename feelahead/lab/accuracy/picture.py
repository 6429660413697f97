"""Figure of run time against error: peers hollow, the front of each part as a line."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from feelahead.lab.accuracy import displacement, onset, pose, volume
from feelahead.lab.table import Row, Table
from feelahead.printing.pictures import figure

PANELS: Final = (
    ("contact distance, mm", onset.UNIT, "contact"),
    ("onset distance of full strength, mm", onset.UNIT, "full"),
    ("volume, share of the sphere", volume.SPHERE, "volume"),
    ("small volumes, share of the overlap", volume.OVERLAP, "volume"),
    ("pose of the gripper, mm", pose.UNIT, "pose"),
    ("δ, mm", displacement.UNIT, "δ"),
    ("where a finger stops, mm", displacement.STOP_UNIT, "stop"),
)
"""Title, unit and beginning of the parts' names of each panel"""
_LEAST: Final = {volume.SPHERE: 1e-17, volume.OVERLAP: 1e-17, displacement.STOP_UNIT: 1e-3}
"""Errors below these are drawn there"""
_SAID: Final = (
    "filled: ours\nstar: built in\nhollow: peers\nline: the front of a part\n\n"
    f"Volumes: errors below {_LEAST[volume.SPHERE]:g} are drawn there.\n"
    "Precise forms: star on, dot off. Other methods are named for random pairs."
)


def draw_points(rows: Sequence[Row], path: Path) -> None:
    """Draw the largest errors of pooled points against their processor times."""
    panels = [(title, _of(rows, unit, begin)) for title, unit, begin in PANELS]
    shown = [(title, points) for title, points in panels if len(points)]
    lines = len(shown) // 2 + 1
    with figure(path, lines, 2, figsize=(13.0, 4.0 * lines), squeeze=False) as (_, grid):
        for axes, (title, points) in zip(grid.flat, shown, strict=False):
            for number, ((part,), own) in enumerate(points.groups("part")):
                _draw_part(axes, str(part), list(own), f"C{number}")
            axes.set(xscale="log", yscale="log", xlabel="processor time, us", ylabel="largest error")
            axes.xaxis.set_minor_formatter("")
            axes.set_title(title, fontsize=9)
            axes.margins(y=0.15)
            ends = np.log10([min(points.values("us")), 2.0 * max(points.values("us"))])
            axes.set_xlim(10.0 ** np.floor(ends[0]), 10.0 ** np.ceil(ends[1]))
            axes.grid(alpha=0.3)
            axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        for axes in grid.flat[len(shown) :]:
            axes.set_axis_off()
        grid.flat[len(shown)].text(0.05, 0.95, _SAID, va="top", fontsize=9, transform=grid.flat[len(shown)].transAxes)


def _of(rows: Sequence[Row], unit: str, begin: str) -> Table:
    return Table(row for row in rows if row["unit"] == unit and row["part"].startswith(begin))


def _draw_part(axes: Any, part: str, points: Sequence[Row], colour: str) -> None:
    def place(row: Row) -> tuple[float, float]:
        return float(row["us"]), max(float(row["worst"]), _LEAST.get(row["unit"], 0.0))

    front = sorted(place(row) for row in points if row["beaten_by"] is None)
    axes.plot(*zip(*front, strict=True), "-", color=colour, linewidth=0.8)
    axes.plot([], [], "o-", color=colour, label=part)
    for number, row in enumerate(points):
        fill, marker, size = (colour if row["ours"] else "none"), *(("*", 11) if row["built"] else ("o", 6))
        axes.plot(*place(row), marker, color=colour, markerfacecolor=fill, markersize=size)
        if row["unit"] != volume.SPHERE or (not row["ours"] and part == "volume, random"):
            # Neighbours' names stand above and below in turns, and voxels' on the left.
            left, up = row["knob"] == "voxels", number % 2 == 0
            offset, side = (-4 if left else 3, 4 if up else -9), "right" if left else "left"
            style = {"fontsize": 6, "textcoords": "offset points", "color": colour, "ha": side}
            axes.annotate(name(row), place(row), xytext=offset, **style)


def name(row: Row) -> str:
    """Return a short name for a point."""
    setting = str(row["setting"])
    if row["ours"] and row["knob"] == "precise forms":
        return f"precise forms {setting}"
    begin = setting.partition(",")[0].removesuffix(" of R = 10 mm").removesuffix(" points")
    return begin if row["ours"] else f"{row['knob']}, {begin}"
