"""Figures of approaches: one run over time, or the speeds at contact of several over the delay."""

from itertools import product
from pathlib import Path
from statistics import median
from typing import Any, Final

from feelahead.lab.approaches.frozen import scene_names
from feelahead.lab.approaches.laws import TriedLaw, in_words, with_compensation
from feelahead.lab.approaches.links import mean_loop_s
from feelahead.lab.table import Row, Table
from feelahead.printing.pictures import colour_of, figure
from robot_side.laws.paper_settings import PaperSettings

_LARGEST_MARK, _SMALLER = 10.0, 2.0
"""Size of the first law's marks, and by how much each next law's are smaller, so that none hides another"""
_MARKS: Final = ("o", "s", "^", "D", "v", "P", "X")


def draw_run(table: Table, frozen: str, path: Path) -> None:
    """Draw the zones, the finger, the speed and the true gap of the only run. frozen: hash of the frozen scenes."""
    row = table.rows[0]
    trace = row["trace"]
    end_s = max(trace["time_s"][-1], 0.01) if trace["time_s"] else 0.01
    link = row["link"] or "no delay"
    title = f"{row['force_n']:g} N in {Path(row['model']).stem}, law {words_of_row(row)}, {link} (frozen {frozen})"
    with figure(path, 2, 1, title, figsize=(8.0, 5.6), sharex=True) as (drawn, (zones, motion)):
        shades: dict[str, Any] = {"cmap": "Greys", "vmin": 0, "vmax": 8, "interpolation": "nearest"}
        strengths = list(zip(*trace["strengths"], strict=True)) or [(0,)]
        shown = zones.imshow(strengths, aspect="auto", origin="lower", extent=(0.0, end_s, 0.0, 1.0), **shades)
        zones.plot(trace["time_s"], trace["travel"], color="#d55e00", label="the finger")
        zones.set(ylabel="travel of R2", ylim=(0.0, 1.0))
        zones.legend(loc="upper left")
        drawn.colorbar(shown, ax=zones, label="strength, 0 to 8")
        speeds_mm_s, gaps_mm = ([1e3 * value for value in trace[name]] for name in ("speed_m_s", "gap_m"))
        motion.plot(trace["time_s"], speeds_mm_s, color="#0072b2", label="speed, mm/s")
        motion.plot(trace["time_s"], gaps_mm, color="#009e73", linestyle="--", label="true gap, mm")
        motion.axhline(0.0, color="black", linewidth=0.6)
        if row["contact_speed_mm_s"] is not None:
            motion.plot(row["ended_s"], row["contact_speed_mm_s"], "x", color="black", label="contact")
        motion.set(xlabel="seconds since the pull began", xlim=(0.0, end_s))
        motion.legend()


def draw_comparison(table: Table, frozen: str, path: Path) -> None:
    """Draw a panel for each force, with a line for each law and scene over the delay; over the law if it is always one.

    A run that stops before the contact counts as 0 mm/s; other runs without a contact are left out.
    """
    forces = sorted(set(table.values("force_n")))
    names = scene_names(map(Path, table.values("model")))
    words = {law_of_row(row): words_of_row(row) for row in table}
    laws = list(words)
    delays_ms = {_delay_ms(row) for row in table}
    options: dict[str, Any] = {"figsize": (4.2 * len(forces) + 1.6, 4.2), "sharey": True, "squeeze": False}
    with figure(path, 1, len(forces), f"frozen {frozen}", **options) as (drawn, panels):
        for panel, force_n in zip(panels[0], forces, strict=True):
            for (place, law), (number, scene) in product(enumerate(laws), enumerate(names)):
                points: dict[float, list[float]] = {}
                for row in table.where(force_n=force_n, model=str(scene)):
                    if row["end"] in ("contact", "stopped") and law_of_row(row) == law:
                        points.setdefault(_delay_ms(row), []).append(row["contact_speed_mm_s"] or 0.0)
                panel.plot(
                    [place if len(delays_ms) == 1 else delay for delay in sorted(points)],
                    [median(points[delay]) for delay in sorted(points)],
                    marker=_MARKS[number % len(_MARKS)],
                    markersize=max(_SMALLER, _LARGEST_MARK - _SMALLER * place),
                    color=colour_of(law, laws),
                    alpha=0.7,
                    label=f"{words[law]}, {names[scene]}" if force_n == forces[0] else None,
                )
            panel.set(title=f"{force_n:g} N", xlabel="delay each way, ms")
            if len(delays_ms) == 1:
                panel.set_xticks(range(len(laws)), words.values())
                panel.set(xlim=(-0.5, len(laws) - 0.5), xlabel=f"law, at {min(delays_ms):g} ms each way")
            panel.grid(alpha=0.3)
        panels[0][0].set(ylim=(-5.0, None), ylabel="speed at contact, mm/s (0: no contact)")
        drawn.legend(loc="outside right upper", fontsize=7)


def _delay_ms(row: Row) -> float:
    return 500.0 * mean_loop_s(row["link"], row["link_model"])


def words_of_row(row: Row) -> str:
    """Return the law of a run as it is printed; the paper's with its settings."""
    law = in_words(law_of_row(row))
    return law if row["share"] is None else f"{law} ({PaperSettings(row['share'], row['enlargement'])})"


def law_of_row(row: Row) -> TriedLaw:
    """Return the law of a run."""
    return with_compensation(row["law"], row["compensation"])
