"""A run on one page: what lay ahead, what the fingers did and felt, and what the link did, over one time axis."""

from collections.abc import Callable
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.recording.reading import Recording
from feelahead.recordings.tables import Table, Tables

PLOT_HZ: Final = 100.0
_INCHES: Final = (8.27, 11.69)
_BLUE, _ORANGE, _GREEN, _PURPLE, _GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666"
"""Told apart by eyes that do not tell red from green."""
_STATES: Final = {"armed": "#DDEEDD", "stopped": "#F6D5CC", "disarmed": "#EEEEEE"}
_FULL: Final = 8.0
_HEIGHTS: Final = (1.3, 1.1, 1.1, 1.0, 1.0, 1.0, 1.0)
_SIDES: Final = (("r2", "R2 (advances)", _ORANGE), ("l2", "L2 (retreats)", _BLUE))


def _when(recording: Recording) -> str:
    return datetime.fromtimestamp(1e-9 * recording.began_ns(), UTC).isoformat(sep=" ", timespec="seconds")


def plot_run(recording: Recording, tables: Tables, out: Path) -> None:
    """Draw it into `out`, PNG, SVG or PDF by its ending."""
    import matplotlib as mpl  # noqa: PLC0415

    mpl.use("Agg")
    from matplotlib import pyplot  # noqa: PLC0415

    joined = tables.joined(PLOT_HZ)
    times_s = np.array(joined.times_s)
    style: Any = {
        "font.size": 7.5,
        "axes.titlesize": 8,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "legend.framealpha": 0.8,
        "legend.edgecolor": "none",
        "legend.fontsize": 6.5,
        "svg.fonttype": "none",
    }
    panels: list[Callable[[Any, Any, Table, FloatArray], None]] = [
        _ways,
        _felt("r2", "R2"),
        _felt("l2", "L2"),
        _speed,
        _enlargement,
        _distances,
        _delays,
    ]
    with mpl.rc_context(style):
        figure, axes = pyplot.subplots(
            len(panels),
            1,
            sharex=True,
            figsize=_INCHES,
            height_ratios=_HEIGHTS,
            layout="constrained",
        )
        for axis, draw in zip(axes, panels, strict=True):
            _bands(axis, joined, times_s)
            draw(figure, axis, joined, times_s)
            axis.margins(x=0)
        axes[-1].set_xlabel("time since the recording began (s)")
        _name_lines(axes[0], 2)
        figure.align_ylabels()
        figure.suptitle(_title(recording, tables), fontsize=8.5, x=0.01, ha="left")
        figure.legend(handles=_band_handles(), loc="upper right", title="state of the robot side", fontsize=7)
        figure.savefig(out, dpi=200)
        pyplot.close(figure)


def _name_lines(axis: Any, columns: int) -> None:
    """Say which line is which, where there are any: a short run may have none."""
    if axis.get_legend_handles_labels()[0]:
        axis.legend(loc="upper right", ncols=columns)


def _title(recording: Recording, tables: Tables) -> str:
    header = next(iter(recording.headers.values()))
    settings = recording.headers.get("robot", header)["settings"]
    links = {found["settings"].get("link") or "none" for found in recording.headers.values()}
    told = [
        f"{recording.path.name}: {tables.duration_s:.1f} s, {_when(recording)}",
        f"emulated link: {'; '.join(sorted(links))}",
        f"scene {settings.get('scene') or settings.get('model') or 'table'}, law {settings.get('law', 'unknown')},"
        f" P {settings.get('probability', 'unknown')}, seed {settings.get('seed')},"
        f" feelahead {header['versions'].get('feelahead', 'unknown')}",
    ]
    return "\n".join(told)


def _bands(axis: Any, joined: Table, times_s: FloatArray) -> None:
    """The states as colours behind everything."""
    states = [row.get("stiffness.state") or row.get("telemetry.state") for row in joined.rows]
    begins = [0, *(i for i in range(1, len(states)) if states[i] != states[i - 1]), len(states)]
    for start, end in pairwise(begins):
        if start < len(states) and states[start] in _STATES:
            last_s = times_s[min(end, len(times_s) - 1)]
            axis.axvspan(times_s[start], last_s, color=_STATES[str(states[start])], lw=0, zorder=0)


def _band_handles() -> list[Any]:
    from matplotlib.patches import Patch  # noqa: PLC0415

    return [Patch(color=color, label=state) for state, color in _STATES.items()]


def _ways(_: Any, axis: Any, joined: Table, times_s: FloatArray) -> None:
    horizon_mm = 1e3 * joined.numbers("stiffness.horizon_m")
    for side, label, color in _SIDES:
        ways = np.stack([1e3 * joined.numbers(f"stiffness.{side}.fast_m.{k}") for k in range(8)])
        ways[ways >= horizon_mm - 1e-6] = np.nan
        axis.fill_between(times_s, ways[0], ways[-1], color=color, alpha=0.25, lw=0)
        axis.plot(times_s, ways[-1], color=color, lw=0.9, label=f"{label}, strengths 1 to 8")
        delta = 1e3 * joined.numbers(f"stiffness.{side}.displacement_m")
        axis.plot(times_s, delta, color=color, lw=0.7, ls=":", label=f"δ of {side.upper()}")
    axis.axhline(0.0, color=_GREY, lw=0.5)
    axis.set_ylabel("way (mm)")
    axis.set_title("Free ways until strengths are due; nothing drawn beyond the horizon")


def _felt(side: str, name: str) -> Callable[[Any, Any, Table, FloatArray], None]:
    def draw(figure: Any, axis: Any, joined: Table, times_s: FloatArray) -> None:
        zones = np.stack([joined.numbers(f"felt.{side}.{zone}") for zone in range(10)])
        end_s = times_s[-1] if len(times_s) else 1.0
        shown = axis.imshow(
            np.where(zones > 0, zones, np.nan),
            aspect="auto",
            origin="lower",
            extent=(0.0, end_s, 0.0, 1.0),
            cmap="viridis_r",
            vmin=0.0,
            vmax=_FULL,
            interpolation="nearest",
            zorder=1,
        )
        travel = joined.numbers(f"controller.{side}_raw")
        # Seen on light and on dark.
        axis.plot(times_s, travel, color="white", lw=2.4)
        axis.plot(times_s, travel, color="black", lw=1.0)
        axis.set_ylim(0.0, 1.0)
        axis.set_ylabel("raw travel")
        axis.set_title(f"{name}: the finger's travel, and the strength of its tenths as written to the controller")
        bar = figure.colorbar(shown, cax=axis.inset_axes((1.01, 0.0, 0.012, 1.0)), ticks=[0, 4, 8])
        bar.set_label("strength")

    return draw


def _speed(_: Any, axis: Any, joined: Table, times_s: FloatArray) -> None:
    axis.plot(times_s, 1e3 * joined.numbers("stiffness.speed_m_s"), color=_ORANGE, lw=0.9, label="measured")
    axis.plot(times_s, 1e3 * joined.numbers("stiffness.told_m_s"), color=_GREY, lw=0.7, ls="--", label="told")
    axis.axhline(0.0, color=_GREY, lw=0.5)
    axis.set_ylabel("speed (mm/s)")
    axis.set_title("Speed along the approach")
    _name_lines(axis, 2)


def _enlargement(_: Any, axis: Any, joined: Table, times_s: FloatArray) -> None:
    total_mm = 1e3 * joined.numbers("telemetry.enlargement_m")
    axis.plot(times_s, total_mm, color="black", lw=0.9, label="enlargement (eq. 10)")
    for name, color in (("sigma_m", _GREEN), ("mean_m", _GREY)):
        terms = 1e3 * joined.numbers(f"enlargement.r2.{name}")
        if np.isfinite(terms).any():
            axis.plot(
                times_s, terms, color=color, lw=0.7, label={"sigma_m": "D_σ of R2", "mean_m": "means of R2"}[name]
            )
    of_objects = [column for column in joined.columns() if column.startswith("overlap.") and column.endswith("_mm3")]
    if of_objects:
        sums = np.nansum([joined.numbers(column) for column in of_objects], axis=0)
        axis.plot(times_s, np.cbrt(sums), color=_PURPLE, lw=0.7, label="overlap, edge of a cube of it")
    axis.set_ylabel("enlargement (mm)")
    axis.set_title("Enlargement and its terms, overlap, and the strength s(δ) along each trigger")
    other = axis.twinx()
    for side, _label, color in _SIDES:
        strength = joined.numbers(f"stiffness.{side}.stiffness")
        other.plot(times_s, strength, color=color, lw=0.7, alpha=0.8, label=f"s(δ) of {side.upper()}")
    other.set_ylim(0.0, 1.05)
    other.set_ylabel("s(δ)")
    handles, labels = axis.get_legend_handles_labels()
    more, names = other.get_legend_handles_labels()
    # Of the upper one of the two, else its curves would run through the words; before it is armed there are none.
    other.legend([*handles, *more], [*labels, *names], loc="upper left", ncols=2)


def _distances(_: Any, axis: Any, joined: Table, times_s: FloatArray) -> None:
    axis.plot(times_s, joined.numbers("robot_status.nearest_mm"), color=_BLUE, lw=0.9, label="nearest obstacle")
    axis.plot(times_s, joined.numbers("robot_status.target_mm"), color=_GREEN, lw=0.9, label="target")
    axis.set_ylabel("distance (mm)")
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))
    axis.set_title("Perceived distances of the unenlarged gripper")
    _name_lines(axis, 2)


def _delays(_: Any, axis: Any, joined: Table, times_s: FloatArray) -> None:
    for column, color, label in (
        ("ages.command_ms", _ORANGE, "command that moves the arm"),
        ("ages.field_ms", _BLUE, "field that is felt"),
        ("ages.frame_ms", _GREEN, "camera frame"),
        ("robot_status.loop_age_ms", "black", "loop age that is reckoned with"),
    ):
        values = joined.numbers(column)
        if np.isfinite(values).any():
            axis.plot(times_s, values, color=color, lw=0.8, label=label)
    # From the worst case that is reckoned with at first one sees nothing.
    armed = np.array([row.get("stiffness.state") == "armed" for row in joined.rows], dtype=bool)
    settled = joined.numbers("robot_status.loop_age_ms")[armed]
    if np.isfinite(settled).any():
        axis.set_ylim(top=2.0 * float(np.nanmedian(settled)) + 10.0)
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel("age (ms)")
    axis.set_title("How old what is used is")
    _name_lines(axis, 4)
