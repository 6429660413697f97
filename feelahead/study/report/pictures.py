"""Pictures of a report, as SVG: the same tables give the same bytes."""

import base64
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from feelahead.printing.pictures import figure
from feelahead.study.protocol import Protocol
from feelahead.study.report.contrasts import Compared, pairs_of
from feelahead.study.report.outcomes import OUTCOMES, Kind, Outcome, Tables, measured, outcome_of

_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Colours that people with red-green blindness can tell apart"""
_MARKS: Final = "os^Dv<>"
_GREY: Final = "#999999"
_WIDTH: Final = 9.0
"""Inches"""
Draw = Callable[[Any, Any], None]


def embedded(draw: Draw, rows: int = 1, columns: int = 1, height: float = 3.4) -> str:
    """Return an address that holds the picture which `draw(figure, axes)` makes, for an image of a page."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.svg"
        options: Any = {"figsize": (_WIDTH, height), "squeeze": False}
        with figure(path, rows, columns, **options) as (drawn, axes):
            for axis in axes.flat:
                axis.spines[["top", "right"]].set_visible(False)
            draw(drawn, axes)
        return "data:image/svg+xml;base64," + base64.b64encode(path.read_bytes()).decode()


def front(cells: Any, conditions: tuple[str, ...]) -> str:
    """Return the picture of hits against time: a colour for each condition, a mark for each delay, with intervals."""
    wide = cells[cells.outcome.isin(("hit", "time_s"))].pivot_table(
        index=["condition", "delay_ms"], columns="outcome", values=["value", "low", "high"], dropna=False
    )
    delays = sorted({delay for _, delay in wide.index})

    def draw(_: Any, axes: Any) -> None:
        axis = axes[0, 0]
        for name, colour in zip(conditions, _cycled(len(conditions)), strict=True):
            rows = wide[wide.index.get_level_values(0) == name]
            x, y = rows[("value", "time_s")], 100.0 * rows[("value", "hit")]
            axis.plot(x, y, color=colour, linewidth=1.0, label=name)
            for (_, delay), row in rows.iterrows():
                at_x, at_y = row[("value", "time_s")], 100.0 * row[("value", "hit")]
                axis.plot(at_x, at_y, marker=_MARKS[delays.index(delay) % len(_MARKS)], color=colour, linestyle="")
                axis.hlines(at_y, row[("low", "time_s")], row[("high", "time_s")], color=colour, alpha=0.5)
                axis.vlines(at_x, 100.0 * row[("low", "hit")], 100.0 * row[("high", "hit")], color=colour, alpha=0.5)
        for place, delay in enumerate(delays):
            axis.plot([], [], marker=_MARKS[place % len(_MARKS)], color=_GREY, linestyle="", label=f"{delay:g} ms")
        axis.set(xlabel="time of a trial (s)", ylabel="trials with a hit (%)", ylim=(-2.0, None))
        axis.legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))

    return embedded(draw, height=4.2)


def persons(tables: Tables, found: tuple[Compared, ...]) -> str:
    """Return the picture of each participant's means under the two conditions of each contrast, joined by a line."""
    columns = min(4, len(found))
    rows = -(-len(found) // columns)

    def draw(_: Any, axes: Any) -> None:
        for axis in axes.flat[len(found) :]:
            axis.set_axis_off()
        for axis, one in zip(axes.flat, found, strict=False):
            contrast, outcome = one.contrast, outcome_of(one.contrast.outcome)
            pairs = pairs_of(measured(tables, outcome), outcome.kind, contrast.first, contrast.second)
            ends = np.array([pairs.first, pairs.second])
            ends = np.exp(ends) if outcome.kind is Kind.FACTOR else ends * _factor(outcome)
            axis.plot([0, 1], ends, color=_GREY, alpha=0.6, linewidth=0.8, marker="o", markersize=3)
            if one.effect.value_first is not None:
                means = np.array([one.effect.value_first, one.effect.value_second]) * _factor(outcome)
                axis.plot([0, 1], means, color=_COLOURS[0], linewidth=2.5, marker="o")
            axis.set_xticks([0, 1], [contrast.first, contrast.second])
            axis.set(xlim=(-0.3, 1.3), ylabel=_label(outcome))
            axis.set_title(_shortened(outcome.title), fontsize=9)

    return embedded(draw, rows, columns, height=3.0 * rows)


def blocks(frame: Any) -> str:
    """Return the picture of hits and time by block, with intervals."""

    def draw(_: Any, axes: Any) -> None:
        for axis, name in zip(axes.flat, ("hit", "time_s"), strict=True):
            rows, outcome = frame[frame.outcome == name], OUTCOMES[name]
            _whiskers(axis, rows.block, rows, _factor(outcome), _COLOURS[0])
            axis.set_xticks(sorted(rows.block.unique()))
            axis.set(xlabel="block", ylabel=_label(outcome), ylim=(0.0, None))
            axis.set_title(outcome.title, fontsize=9)

    return embedded(draw, columns=2, height=2.8)


def answered(frame: Any, protocol: Protocol) -> str:
    """Return the picture of each answer by condition, with intervals, from its lowest to its highest value."""
    conditions, values = tuple(protocol.conditions), {one.name: one.values for one in protocol.questions}
    names = list(dict.fromkeys(frame.outcome))
    columns = min(4, len(names))
    rows = -(-len(names) // columns)

    def draw(_: Any, axes: Any) -> None:
        for axis in axes.flat[len(names) :]:
            axis.set_axis_off()
        for axis, name in zip(axes.flat, names, strict=False):
            for place, (condition, colour) in enumerate(zip(conditions, _cycled(len(conditions)), strict=True)):
                part = frame[(frame.outcome == name) & (frame.condition == condition)]
                _whiskers(axis, [place] * len(part), part, 1.0, colour)
            axis.set_xticks(range(len(conditions)), conditions, rotation=30, ha="right", fontsize=8)
            valid = values.get(name, (0.0, 100.0))
            axis.set(xlim=(-0.5, len(conditions) - 0.5), ylim=(valid[0], valid[-1]))
            axis.set_title(_shortened(outcome_of(name).title), fontsize=8)

    return embedded(draw, rows, columns, height=2.6 * rows)


def _whiskers(axis: Any, x: Any, rows: Any, factor: float, colour: str) -> None:
    axis.vlines(x, factor * rows.low, factor * rows.high, color=colour)
    axis.plot(x, factor * rows.value, marker="o", color=colour, linestyle="", clip_on=False)


def _cycled(count: int) -> list[str]:
    return [_COLOURS[place % len(_COLOURS)] for place in range(count)]


def _factor(outcome: Outcome) -> float:
    return 100.0 if outcome.kind is Kind.SHARE else 1.0


def _label(outcome: Outcome) -> str:
    return outcome.unit or ("number" if outcome.kind is Kind.AMOUNT else "score")


def _shortened(text: str) -> str:
    return text if len(text) <= 34 else f"{text[:31]}…"
