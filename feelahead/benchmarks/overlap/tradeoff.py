"""Run time against error: one point for each method and family of classes."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from rich.progress import Progress

from common.arrays import FloatArray, IntArray
from common.clock import Clock
from feelahead.benchmarks.overlap import approximations as overlap_approximations
from feelahead.benchmarks.overlap import ours as overlap_ours
from feelahead.benchmarks.overlap.accuracy import Sample
from feelahead.benchmarks.overlap.pairs import Pairs
from feelahead.benchmarks.overlap.peers import HeaderPeer, PythonPeer
from feelahead.benchmarks.overlap.times.timing import available_cores, nanoseconds_each
from feelahead.benchmarks.report import Report, Table, short

_BATCH = 4000
"""Pairs of a timed batch: a family's own, repeated."""

Volumes = Callable[[Pairs], FloatArray]


@dataclass(frozen=True)
class Method:
    """A way to volumes: at most `rows` pairs of a family are given to it, repeated to `batch` to time it.

    A batch of 0 is for slow ones, whose only call is timed.
    """

    name: str
    volumes: Volumes
    rows: int = 1_000_000
    batch: int = 0
    own_time_ns: Callable[[Pairs], float] | None = None
    """Where it measures its own time, in a process of its own: ns a pair."""


def measure_tradeoff(
    report: Report,
    samples: list[Sample],
    peers: tuple[PythonPeer, HeaderPeer],
    clock: Clock,
    progress: Progress,
    *,
    quick: bool,
) -> None:
    """Add the time and the worst error of every method on every family of tetrahedra and boxes."""
    families: dict[tuple[str, str], list[Sample]] = {}
    for sample in samples:
        if sample.pairs.solid in ("tetrahedron", "box"):
            families.setdefault((sample.pairs.solid, sample.family), []).append(sample)
    threads = available_cores()
    with ThreadPoolExecutor(threads) as pool:
        methods = _methods(peers, pool, threads, quick=quick)
        bar = progress.add_task("time against error", total=len(methods) * len(families))
        for (solid, shown), parts in families.items():
            pairs = Pairs.joined([part.pairs for part in parts])
            whole = Sample(shown, pairs, [truth for part in parts for truth in part.truths])
            for method in methods:
                time_ns, worst, middle = _point(method, whole, clock)
                values = {
                    "time": (time_ns, "ns/pair"),
                    "worst error": (worst, "of the sphere"),
                    "median error": (middle, "of the sphere"),
                }
                report.add("tradeoff", method.name, solid, shown, values)
                progress.advance(bar)
    report.tables.append(_table(report, [method.name for method in methods]))


def _methods(
    peers: tuple[PythonPeer, HeaderPeer], pool: ThreadPoolExecutor, threads: int, *, quick: bool
) -> list[Method]:
    few = 2 if quick else 4
    found = [
        Method("ours, a call each", overlap_ours.call_by_call, rows=200),
        Method("ours, batch", overlap_ours.kernel_volumes, batch=_BATCH),
        Method(
            f"ours, batch, {threads} threads",
            lambda pairs: overlap_ours.threaded_volumes(pairs, pool, threads),
            batch=_BATCH,
        ),
    ]
    # What any kernel in float32 errs by, and more: it is given no better numbers than these.
    found.append(
        Method(
            "ours, inputs in float32",
            lambda pairs: overlap_ours.kernel_volumes(pairs.in_single_precision()),
            batch=_BATCH,
        )
    )
    python_peer, header_peer = peers
    if not python_peer.missing:
        found.append(Method("overlap, Python", lambda pairs: python_peer.volumes(pairs)[0]))
    if not header_peer.missing:
        found.append(
            Method(
                "overlap, C++",
                lambda pairs: header_peer.timing(pairs, 1).volumes,
                batch=_BATCH,
                own_time_ns=lambda pairs: header_peer.timing(pairs, 3).overlap_ns,
            )
        )
    found.append(Method("29 satellite points", overlap_approximations.satellites, batch=_BATCH))
    found += [_monte_carlo(power, few if power > 4 else 20) for power in range(3, 7 if not quick else 6)]
    found += [_voxels(cells, few if cells > 16 else 20) for cells in ((8, 16, 32) if quick else (8, 16, 32, 64))]
    if not quick:
        found.append(Method("SciPy dblquad, 1e-4", lambda pairs: overlap_approximations.quadrature(pairs, 1e-4), 2))
    found.append(Method("SciPy dblquad, 1e-2", lambda pairs: overlap_approximations.quadrature(pairs, 1e-2), few))
    return found


def _monte_carlo(power: int, rows: int) -> Method:
    points = 10**power
    return Method(f"Monte Carlo 1e{power}", lambda pairs: overlap_approximations.monte_carlo(pairs, points), rows)


def _voxels(cells: int, rows: int) -> Method:
    return Method(f"voxels {cells}³", lambda pairs: overlap_approximations.voxels(pairs, cells), rows)


def _point(method: Method, sample: Sample, clock: Clock) -> tuple[float, float, float]:
    """(ns a pair, worst and median error as shares of the sphere's volume); NaN counts as an error of 1."""
    rows = _spread_rows(sample, method.rows)
    chosen = Sample(sample.name, sample.pairs[rows], [sample.truths[row] for row in rows])
    start_s = clock.now()
    volumes = method.volumes(chosen.pairs)
    time_ns = 1e9 * (clock.now() - start_s) / len(rows)
    errors = chosen.errors(volumes)
    errors[~np.isfinite(errors)] = 1.0
    if method.batch:
        timed = chosen.pairs[np.resize(np.arange(len(rows)), max(method.batch, len(rows)))]
        if method.own_time_ns is not None:
            time_ns = method.own_time_ns(timed)
        else:
            time_ns = nanoseconds_each(partial(method.volumes, timed), len(timed), 3, clock)
    return time_ns, float(errors.max()), float(np.median(errors))


def _spread_rows(sample: Sample, most: int) -> IntArray:
    """Up to `most` rows, spread over the family's classes; a few are chosen among pairs that intersect."""
    rows = np.arange(len(sample.pairs))
    if most < len(rows):
        cut = np.array([truth.faces_cut > 0 and truth.area != 0 for truth in sample.truths])
        rows = rows[cut] if cut.any() else rows
    return np.asarray(rows[np.unique(np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(int))])


def _table(report: Report, methods: list[str]) -> Table:
    rows = []
    for method in methods:
        points = {
            (solid, quantity): report.value("tradeoff", method, solid, "random", quantity)
            for solid in ("tetrahedron", "box")
            for quantity in ("time", "worst error")
        }
        worst = max(
            (f.value for f in report.figures if f.method == method and _is_worst_point(f.section, f.quantity)),
            default=0.0,
        )
        rows.append((method, *("-" if value is None else short(value) for value in points.values()), short(worst)))
    return Table(
        "Run time against error",
        ("method", "tet, ns", "tet, worst error", "box, ns", "box, worst error", "worst of all classes"),
        rows,
        "Random pairs, then the worst over every family of classes; errors in shares of the sphere's volume. The "
        "approximations are measured on a few pairs of each family that intersect. An exception or NaN counts as an "
        "error of 1. Inputs in float32: worked out in float64 from rounded inputs, so no float32 kernel errs by less; "
        "its vectors, twice as wide, could halve the time of the batch at best.",
    )


def _is_worst_point(section: str, quantity: str) -> bool:
    return section == "tradeoff" and quantity == "worst error"
