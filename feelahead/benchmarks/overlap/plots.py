"""The benchmark's two figures, as small PNG files."""

from pathlib import Path

import matplotlib as mpl

from feelahead.benchmarks.report import Report

TRADEOFF = "overlap_time_error.png"
MESH = "overlap_mesh_cost.png"
_SMALLEST = 1e-18
"""Errors below are drawn here: the axis is logarithmic."""
_COLOURS = ("tab:blue", "tab:cyan", "tab:green", "tab:orange", "tab:red", "tab:purple", "tab:brown", "tab:pink")
_GROUPS = ("ours, batch", "ours, a call", "overlap, C++", "overlap, Python", "29", "Monte Carlo", "voxels", "SciPy")


def draw(report: Report, folder: Path) -> list[Path]:
    """Write both figures into `folder`, which is made if need be."""
    mpl.use("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / TRADEOFF, folder / MESH]
    _draw_tradeoff(report, paths[0])
    _draw_mesh(report, paths[1])
    return paths


def _draw_tradeoff(report: Report, path: Path) -> None:
    from matplotlib import pyplot as plt  # noqa: PLC0415

    points: dict[str, list[tuple[float, float, str]]] = {}
    for figure in report.figures:
        if figure.section == "tradeoff" and figure.quantity == "time":
            error = report.value("tradeoff", figure.method, figure.solid, figure.case, "worst error")
            points.setdefault(figure.method, []).append((figure.value, max(error or 0.0, _SMALLEST), figure.solid))
    labelled: set[str] = set()
    shown, axes = plt.subplots(figsize=(8.5, 4.6), dpi=110)
    for number, (group, colour) in enumerate(zip(_GROUPS, _COLOURS, strict=True)):
        members = [point for name, found in points.items() if name.startswith(group) for point in found]
        for solid, marker in (("tetrahedron", "^"), ("box", "s")):
            chosen = [point for point in members if point[2] == solid]
            if chosen:
                label = group.replace("29", "29 points") if group not in labelled else None
                labelled.add(group)
                times, errors, _ = zip(*chosen, strict=True)
                axes.scatter(times, errors, 16, colour, marker=marker, label=label, zorder=3 + number)
    axes.set(xscale="log", yscale="log", xlabel="time, ns a pair", ylabel="worst error / sphere volume")
    axes.axhline(1e-15, color="black", linewidth=0.6, linestyle=":")
    axes.grid(alpha=0.3)
    axes.set_title("One point for each method and family of pairs (▲ tetrahedra, ■ boxes)", fontsize=9)
    if points:
        axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    shown.tight_layout()
    shown.savefig(path)
    plt.close(shown)


def _draw_mesh(report: Report, path: Path) -> None:
    from matplotlib import pyplot as plt  # noqa: PLC0415

    rows = {f.case: f.value for f in report.figures if f.section == "mesh" and f.quantity == "triangles"}
    shown, axes = plt.subplots(figsize=(6.0, 3.8), dpi=110)
    for quantity, marker in (("time", "o"), ("time, gradient", "x")):
        times = [report.value("mesh", "ours", "mesh", case, quantity) or 0.0 for case in rows]
        if times:
            axes.plot(list(rows.values()), times, marker, label="volume" if quantity == "time" else "with gradient")
    box_ns = report.value("speed", "ours, kernel", "box", "partial", "time")
    if rows and box_ns is not None:
        axes.axhline(20.0 * box_ns, color="black", linewidth=0.8, linestyle=":", label="20 boxes")
    if rows:
        axes.set(xscale="log", yscale="log")
        axes.legend(fontsize=8)
    else:
        axes.text(0.5, 0.5, "this build has no mesh kernel", ha="center", transform=axes.transAxes)
    axes.set(xlabel="triangles touched by the sphere", ylabel="ns a query")
    axes.grid(alpha=0.3)
    shown.tight_layout()
    shown.savefig(path)
    plt.close(shown)
