"""Delays and contact speeds of the media beside each other."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from common.emulation.spec import Direction
from feelahead.experiments.latency.equivalence import mean_half_width
from feelahead.experiments.latency.matrix import Row
from feelahead.experiments.latency.tables import by_seed, grouped, way

_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
_WIDE: Final = 0.7
"""Of the room that a link has, for its media."""


def draw(rows: Sequence[Row], path: Path) -> None:
    """Three panels: the delay in each direction, a dot for each seed with mean and 95 %, and contact speeds."""
    from matplotlib import pyplot as plt  # noqa: PLC0415

    links = list(dict.fromkeys(row.trial.link for row in rows))
    names = list(dict.fromkeys(row.medium for row in rows))
    figure, panels = plt.subplots(1, 3, figsize=(13.0, 4.2), dpi=110, layout="constrained")
    _draw_delays(panels[0], rows, links, names, "to_robot")
    _draw_delays(panels[1], rows, links, names, "to_operator")
    _draw_speeds(panels[2], rows, links, names)
    for panel in panels:
        panel.set_xticks(range(len(links)), links, rotation=20, ha="right")
    panels[0].legend()
    panels[2].legend()
    figure.savefig(path)
    plt.close(figure)


def _place(links: Sequence[str], names: Sequence[str], link: str, medium: str) -> float:
    return links.index(link) + _WIDE * ((names.index(medium) + 0.5) / len(names) - 0.5)


def _draw_delays(panel: Any, rows: Sequence[Row], links: Sequence[str], names: Sequence[str], to: Direction) -> None:
    for medium in names:
        colour, label = _COLOURS[names.index(medium) % len(_COLOURS)], medium
        for link in links:
            group = [row for row in rows if (row.trial.link, row.medium) == (link, medium)]
            means = by_seed(group, way(to, lambda one: one.mean_ms))
            if not means:
                continue
            place = _place(links, names, link, medium)
            panel.plot([place] * len(means), means, ".", color=colour, alpha=0.35)
            half = mean_half_width(means) or 0.0
            mean_ms = sum(means) / len(means)
            panel.errorbar(place, mean_ms, half, fmt="o", color=colour, capsize=4, markersize=4, label=label)
            label = ""
    panel.set(yscale="log", ylabel="ms", title=f"mean delay {to.replace('_', ' ')}")


def _draw_speeds(panel: Any, rows: Sequence[Row], links: Sequence[str], names: Sequence[str]) -> None:
    labelled = set()
    for (link, haptics, medium), group in grouped(rows).items():
        colour, label = _COLOURS[names.index(medium) % len(_COLOURS)], f"{medium}, {'on' if haptics else 'off'}"
        place = _place(links, names, link, medium)
        for row in group:
            # An arm that the robot side stopped, for want of commands, has not been kept from the wall by any feeling.
            mark = "x" if row.figures.stops else "o"
            shown = {"color": colour, "markerfacecolor": colour if haptics else "none"}
            text = "" if label in labelled or row.figures.stops else label
            panel.plot(place, row.figures.contact_speed_mm_s or 0.0, mark, label=text, **shown)
            labelled.update({text} - {""})
    # The most, with room for its mark.
    highest = 1.1 * max(panel.get_ylim()[1], 10.0)
    panel.set(ylabel="mm/s", title="first contact (none: 0; x: robot side stopped)", ylim=(-5.0, highest))
