"""Draw a run on one page: onset distances, travel, strengths, errors and delays over one time axis."""

from collections.abc import Callable
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.recording.reading import Recording
from feelahead.recordings.tables import Joined, Tables

PLOT_HZ: Final = 100.0
_INCHES: Final = (8.27, 11.69)
_BLUE, _ORANGE, _GREEN, _PURPLE, _GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666"
"""Colours that people with red-green blindness can tell apart."""
_STATES: Final = {"armed": "#DDEEDD", "stopped": "#F6D5CC", "disarmed": "#EEEEEE"}
_FULL: Final = 8.0
_HEIGHTS: Final = (1.3, 1.1, 1.1, 1.0, 1.0, 1.0, 1.0)
_STYLE: Final[Any] = {
    **{"font.size": 7.5, "axes.titlesize": 8, "axes.titlelocation": "left", "svg.fonttype": "none"},
    **{"axes.spines.top": False, "axes.spines.right": False},
    **{"legend.framealpha": 0.8, "legend.edgecolor": "none", "legend.fontsize": 6.5},
}
_SIDES: Final = (("r2", "R2 (advances)", _ORANGE), ("l2", "L2 (retreats)", _BLUE))


def plot_run(recording: Recording, tables: Tables, out: Path) -> None:
    """Draw the page into the file `out`, as PNG, SVG or PDF by its ending."""
    import matplotlib as mpl  # noqa: PLC0415

    mpl.use("Agg")
    from matplotlib import pyplot  # noqa: PLC0415
    from matplotlib.patches import Patch  # noqa: PLC0415

    joined = tables.joined(PLOT_HZ)
    times_s = np.array(joined.times_s)
    panels: list[Callable[[Any, Any, Joined, FloatArray], None]] = [_onsets, _felt("r2", "R2"), _felt("l2", "L2")]
    panels += [_speed, _enlargement, _distances, _delays]
    with mpl.rc_context(_STYLE):
        layout: Any = {"figsize": _INCHES, "height_ratios": _HEIGHTS, "layout": "constrained"}
        figure, axes = pyplot.subplots(len(panels), 1, sharex=True, **layout)
        for axis, draw in zip(axes, panels, strict=True):
            _bands(axis, joined, times_s)
            draw(figure, axis, joined, times_s)
            axis.margins(x=0)
        axes[-1].set_xlabel("time since the recording began (s)")
        for axis, columns in ((axes[0], 2), (axes[3], 2), (axes[5], 2), (axes[6], 4)):
            if axis.get_legend_handles_labels()[0]:  # a short run may have no curve in this panel
                axis.legend(loc="upper right", ncols=columns)
        bands = [Patch(color=color, label=state) for state, color in _STATES.items()]
        figure.align_ylabels()
        figure.suptitle(_title(recording, tables), fontsize=8.5, x=0.01, ha="left")
        figure.legend(handles=bands, loc="upper right", title="state of the robot side", fontsize=7)
        figure.savefig(out, dpi=200)
        pyplot.close(figure)


def _title(recording: Recording, tables: Tables) -> str:
    header = next(iter(recording.headers.values()))
    settings = recording.headers.get("robot", header)["settings"]
    links = {found["settings"].get("link") or "none" for found in recording.headers.values()}
    when = datetime.fromtimestamp(1e-9 * recording.began_ns, UTC).isoformat(sep=" ", timespec="seconds")
    lines = [
        f"{recording.path.name}: {tables.duration_s:.1f} s, {when}",
        f"emulated link: {'; '.join(sorted(links))}",
        f"scene {settings.get('scene') or settings.get('model') or 'table'}, law {settings.get('law', 'unknown')},"
        f" P {settings.get('probability', 'unknown')}, seed {settings.get('seed')},"
        f" feelahead {header['versions'].get('feelahead', 'unknown')}",
    ]
    return "\n".join(lines)


def _bands(axis: Any, joined: Joined, times_s: FloatArray) -> None:
    """Draw the robot side's states (armed, stopped, disarmed) as coloured bands in the background."""
    states = [
        one or other for one, other in zip(*map(joined.values, ("stiffness.state", "telemetry.state")), strict=True)
    ]
    begins = [0, *(i for i in range(1, len(states)) if states[i] != states[i - 1]), len(states)]
    for start, end in pairwise(begins):
        if start < len(states) and states[start] in _STATES:
            last_s = times_s[min(end, len(times_s) - 1)]
            axis.axvspan(times_s[start], last_s, color=_STATES[str(states[start])], lw=0, zorder=0)


def _onsets(_: Any, axis: Any, joined: Joined, times_s: FloatArray) -> None:
    horizon_mm = 1e3 * joined.numbers("stiffness.horizon_m")
    for side, label, color in _SIDES:
        ways = np.stack([1e3 * joined.numbers(f"stiffness.{side}.fast_m.{k}") for k in range(8)])
        ways[ways >= horizon_mm - 1e-6] = np.nan
        axis.fill_between(times_s, ways[0], ways[-1], color=color, alpha=0.25, lw=0)
        axis.plot(times_s, ways[-1], color=color, lw=0.9, label=f"{label}, strengths 1 to 8")
        delta = 1e3 * joined.numbers(f"stiffness.{side}.displacement_m")
        axis.plot(times_s, delta, color=color, lw=0.7, ls=":", label=f"δ of {side.upper()}")
    axis.axhline(0.0, color=_GREY, lw=0.5)
    axis.set(ylabel="distance (mm)", title="Onset distances of the strengths; nothing drawn beyond the horizon")


def _felt(side: str, name: str) -> Callable[[Any, Any, Joined, FloatArray], None]:
    def draw(figure: Any, axis: Any, joined: Joined, times_s: FloatArray) -> None:
        zones = np.stack([joined.numbers(f"felt.{side}.{zone}") for zone in range(10)])
        end_s = times_s[-1] if len(times_s) else 1.0
        look: Any = {"cmap": "viridis_r", "vmin": 0.0, "vmax": _FULL, "interpolation": "nearest", "zorder": 1}
        extent = 0.0, end_s, 0.0, 1.0
        shown = axis.imshow(np.where(zones > 0, zones, np.nan), aspect="auto", origin="lower", extent=extent, **look)
        travel = joined.numbers(f"controller.{side}_raw")
        # Black on white, so that the curve is visible on light and on dark zones.
        axis.plot(times_s, travel, color="white", lw=2.4)
        axis.plot(times_s, travel, color="black", lw=1.0)
        title = f"{name}: the finger's travel, and the strength of its tenths as written to the controller"
        axis.set(ylim=(0.0, 1.0), ylabel="raw travel", title=title)
        bar = figure.colorbar(shown, cax=axis.inset_axes((1.01, 0.0, 0.012, 1.0)), ticks=[0, 4, 8])
        bar.set_label("strength")

    return draw


def _curves(axis: Any, joined: Joined, times_s: FloatArray, *curves: tuple[str, float, str, str]) -> None:
    """Draw columns of the table as curves; missing columns are left out.

    curves: (column, factor on its values, colour, label) of each.
    """
    for column, factor, color, label in curves:
        values = factor * joined.numbers(column)
        if np.isfinite(values).any():
            axis.plot(times_s, values, color=color, lw=0.8, ls="--" if label == "commanded" else "-", label=label)


def _speed(_: Any, axis: Any, joined: Joined, times_s: FloatArray) -> None:
    measured = ("stiffness.speed_m_s", 1e3, _ORANGE, "measured")
    _curves(axis, joined, times_s, measured, ("stiffness.commanded_m_s", 1e3, _GREY, "commanded"))
    axis.axhline(0.0, color=_GREY, lw=0.5)
    axis.set(ylabel="speed (mm/s)", title="Speed along the approach")


def _enlargement(_: Any, axis: Any, joined: Joined, times_s: FloatArray) -> None:
    _curves(
        axis,
        joined,
        times_s,
        ("telemetry.enlargement_m", 1e3, "black", "enlargement (eq. 10)"),
        ("enlargement.r2.sigma_m", 1e3, _GREEN, "D_σ of R2"),
        ("enlargement.r2.mean_m", 1e3, _GREY, "means of R2"),
    )
    of_objects = [column for column in joined.columns() if column.startswith("overlap.") and column.endswith("_mm3")]
    if of_objects:
        sums = np.nansum([joined.numbers(column) for column in of_objects], axis=0)
        axis.plot(times_s, np.cbrt(sums), color=_PURPLE, lw=0.8, label="overlap, edge of a cube of it")
    title = "Enlargement and its terms, overlap, and the stiffness s(δ) to which the course leads"
    axis.set(ylabel="enlargement (mm)", title=title)
    other = axis.twinx()
    course = "stiffness.{}.course_stiffness".format
    strengths = [(course(side), 1.0, color, f"s(δ), course of {side.upper()}") for side, _, color in _SIDES]
    _curves(other, joined, times_s, *strengths)
    other.set(ylim=(0.0, 1.05), ylabel="s(δ)")
    handles, labels = axis.get_legend_handles_labels()
    more, names = other.get_legend_handles_labels()
    # The axes drawn last get the legend, else curves would cross it. Before arming there are no strengths.
    other.legend([*handles, *more], [*labels, *names], loc="upper left", ncols=2)


def _distances(_: Any, axis: Any, joined: Joined, times_s: FloatArray) -> None:
    nearest = ("robot_status.nearest_mm", 1.0, _BLUE, "nearest obstacle")
    _curves(axis, joined, times_s, nearest, ("robot_status.target_mm", 1.0, _GREEN, "target"))
    title = "Perceived distances of the unenlarged gripper"
    axis.set(ylabel="distance (mm)", ylim=(min(0.0, axis.get_ylim()[0]), None), title=title)


def _delays(_: Any, axis: Any, joined: Joined, times_s: FloatArray) -> None:
    _curves(
        axis,
        joined,
        times_s,
        ("ages.command_ms", 1.0, _ORANGE, "command that moves the arm"),
        ("ages.field_ms", 1.0, _BLUE, "field that is felt"),
        ("ages.frame_ms", 1.0, _GREEN, "camera frame"),
        ("robot_status.loop_age_ms", 1.0, "black", "loop age that the law assumes"),
    )
    # Scale by the armed time: the worst case, which is assumed at first, would make all else invisible.
    armed = np.array([state == "armed" for state in joined.values("stiffness.state")], dtype=bool)
    settled = joined.numbers("robot_status.loop_age_ms")[armed]
    if np.isfinite(settled).any():
        axis.set_ylim(top=2.0 * float(np.nanmedian(settled)) + 10.0)
    axis.set_ylim(bottom=0.0)
    axis.set(ylabel="age (ms)", title="Ages of the data in use")
