"""What was found, as figures, tables, and a page with a picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np

from feelahead.benchmarks.felt.approaching import FORCES_N, Approached
from feelahead.benchmarks.felt.errors import Errors, errors
from feelahead.benchmarks.felt.ladders import COVER, LATE, MESHES, NODES, RATE, is_as_it_is
from feelahead.benchmarks.felt.measuring import Found
from feelahead.benchmarks.felt.recorded_ticks import DEMO
from feelahead.benchmarks.felt.replay import Replayed
from feelahead.benchmarks.felt.turning import Turned
from feelahead.benchmarks.report import Report, Table

KINDS: Final = ("fast first", "fast full", "slow first", "slow full")
_COLOURS: Final = {RATE: "#0072b2", LATE: "#d55e00", COVER: "#009e73", NODES: "#cc79a7", MESHES: "#777777"}
_LEAST_MM: Final = 1e-3
"""Errors below are drawn here: the axis is logarithmic."""
_SHOWN: Final = "fast full"


def report(found: Found, rungs: dict[str, list[Turned]]) -> Report:
    """Figures and tables."""
    made = Report()
    for run, replayed in found.replayed.items():
        rows = []
        for one, finest in _by_rung(replayed, rungs):
            apart = {kind: errors(one, finest, kind) for kind in KINDS}
            rows.append(_row(one, apart))
            case = f"{run}, {_name(one.how)}"
            values = {
                "spheres": (float(one.spheres), "1"),
                "looks": (one.looks_per_s, "1/s"),
                "p50": (float(np.quantile(one.took_us, 0.5)), "us"),
                "p99": (float(np.quantile(one.took_us, 0.99)), "us"),
                "mean": (float(one.took_us.mean()), "us"),
            }
            for kind, apart_by in apart.items():
                values |= {
                    f"{kind} mean": (apart_by.mean_mm, "mm"),
                    f"{kind} p95": (apart_by.p95_mm, "mm"),
                    f"{kind} earliest": (apart_by.earliest_mm, "mm"),
                    f"{kind} latest": (apart_by.latest_mm, "mm"),
                }
            made.add("felt", "ours", run, case, values)
        what = "The demo's ticks" if run == DEMO else f"A pull of 2 N, {run}"
        columns = "setting", "spheres", "looks/s", "p50, µs", "p99, µs", "mean, µs", *(f"{kind}, mm" for kind in KINDS)
        made.tables.append(Table(what, columns, rows))
    if found.approached:
        made.tables.append(_approaches(made, found.approached))
    return made


def _by_rung(replayed: Sequence[Replayed], rungs: dict[str, list[Turned]]) -> list[tuple[Replayed, Replayed]]:
    """In the order of the ladders, each with the finest of its own."""
    by_how = {one.how: one for one in replayed}
    return [
        (by_how[how], by_how[rung[-1]]) for rung in rungs.values() for how in rung if {how, rung[-1]} <= by_how.keys()
    ]


def _name(how: Turned) -> str:
    return f"{how} (as it is)" if is_as_it_is(how) else str(how)


def _row(one: Replayed, apart: dict[str, Errors]) -> tuple[str, ...]:
    middle, late = np.quantile(one.took_us, (0.5, 0.99))
    return (
        _name(one.how),
        f"{one.spheres}",
        f"{one.looks_per_s:.0f}",
        f"{middle:.0f}",
        f"{late:.0f}",
        f"{one.took_us.mean():.0f}",
        *(
            f"{each.mean_mm:+.2f}; {each.p95_mm:.2f}; {each.earliest_mm:+.1f} to {each.latest_mm:+.1f}"
            if each.count
            else "-"
            for each in apart.values()
        ),
    )


def _approaches(made: Report, approached: Sequence[Approached]) -> Table:
    scenes = list(dict.fromkeys((one.scene, one.force_n) for one in approached))
    by_how: dict[Turned, dict[tuple[str, float], Approached]] = {}
    for one in approached:
        by_how.setdefault(one.how, {})[one.scene, one.force_n] = one
        speed = 0.0 if one.contact_speed_mm_s is None else one.contact_speed_mm_s
        values = {"contact speed": (speed, "mm/s"), "least gap": (one.least_gap_mm, "mm")}
        made.add("approach", "ours", one.scene, f"{one.force_n:g} N, {_name(one.how)}", values)
    return Table(
        "Approaches",
        ("setting", *(f"{scene}, {force_n:g} N" for scene, force_n in scenes)),
        [(_name(how), *(cells[scene].shown for scene in scenes)) for how, cells in by_how.items()],
        f"A finger of {' or '.join(f'{force_n:g}' for force_n in FORCES_N)} N pulls, the strongest effect adds 2 N; no"
        " delay; mm/s at the first contact, or the least gap.",
    )


def draw(found: Found, rungs: dict[str, list[Turned]], path: Path) -> None:
    """Run time against error, a line for each ladder, of each run."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415
    from matplotlib.ticker import LogLocator, NullFormatter  # noqa: PLC0415

    shown, all_axes = plt.subplots(
        1, len(found.replayed), figsize=(3.4 * len(found.replayed), 3.8), dpi=110, squeeze=False, sharey=True
    )
    for axes, (run, replayed) in zip(all_axes[0], found.replayed.items(), strict=True):
        by_rung: dict[str, list[tuple[Replayed, Errors]]] = {}
        for one, finest in _by_rung(replayed, rungs):
            by_rung.setdefault(one.how.knob, []).append((one, errors(one, finest, _SHOWN)))
        for knob, pairs in by_rung.items():
            times = [float(one.took_us.mean()) for one, _ in pairs]
            sizes = [max(apart.p95_mm, _LEAST_MM) for _, apart in pairs]
            axes.plot(times, sizes, "o-", color=_COLOURS[knob], label=knob, markersize=3, linewidth=0.8)
            for one, time_us, size in zip((one for one, _ in pairs), times, sizes, strict=True):
                axes.annotate(one.how.value, (time_us, size), fontsize=5, xytext=(2, 2), textcoords="offset points")
        axes.set(xscale="log", yscale="log", xlabel="mean run time of a tick's law, µs", title=run)
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(alpha=0.3)
    all_axes[0, 0].set_ylabel("95 % of |full strength's way - the finest's|, mm")
    all_axes[0, -1].legend(fontsize=6)
    shown.tight_layout()
    shown.savefig(path)
    plt.close(shown)
