"""Run times on the same pairs for everything exact: ours, and the published package."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from rich.progress import Progress

from common.arrays import BoolArray, FloatArray
from common.clock import Clock
from feelahead.benchmarks.overlap import ours as overlap_ours
from feelahead.benchmarks.overlap.classes import MAKERS
from feelahead.benchmarks.overlap.pairs import Pairs, Solid
from feelahead.benchmarks.overlap.peers import HeaderPeer, PythonPeer
from feelahead.benchmarks.overlap.timing import ROUNDS, available_cores, nanoseconds_each, one_core
from feelahead.benchmarks.report import Report, Table, short

TIMED_SOLIDS: tuple[Solid, ...] = ("tetrahedron", "box")
_ATTEMPTS = 40
"""How often as many pairs again are drawn, to choose from."""
_CALLS = 500
"""Pairs timed a call each."""

Timed = Callable[[], dict[str, float]]
"""A measurement: ns a pair by the name of the method."""

TRIVIAL = {"apart": "far away", "solid within sphere": "solid swallowed", "sphere within solid": "sphere swallowed"}
"""Trivial pairs, with the class that has many of them."""


def partial_pairs(solid: Solid, count: int, seed: int = 1) -> Pairs:
    """`count` random pairs whose overlap is neither nothing nor the whole sphere or solid."""

    def overlapping(pairs: Pairs, volumes: FloatArray) -> BoolArray:
        most = np.minimum(pairs.sphere_volumes, pairs.solid_volumes)
        return np.asarray((volumes > 1e-6 * most) & (volumes < (1.0 - 1e-6) * most))

    return _chosen(solid, "random", count, seed, overlapping)


def trivial_pairs(solid: Solid, name: str, count: int, seed: int = 2) -> Pairs:
    """`count` pairs of a kind of `TRIVIAL`."""

    def trivial(pairs: Pairs, volumes: FloatArray) -> BoolArray:
        if name == "apart":
            return np.asarray(volumes == 0.0)
        whole = pairs.solid_volumes if name == "solid within sphere" else pairs.sphere_volumes
        return np.asarray((np.abs(volumes - whole) <= 1e-12 * whole) & (whole > 0.0))

    return _chosen(solid, TRIVIAL[name], count, seed, trivial)


def _chosen(solid: Solid, kind: str, count: int, seed: int, valid: Callable[[Pairs, FloatArray], BoolArray]) -> Pairs:
    rng = np.random.default_rng(seed)
    found: list[Pairs] = []
    for _ in range(_ATTEMPTS):
        if sum(len(pairs) for pairs in found) >= count:
            break
        pairs = MAKERS[solid][kind](rng, 2 * count, False)
        found.append(pairs[np.flatnonzero(valid(pairs, overlap_ours.kernel_volumes(pairs)))])
    chosen = Pairs.joined(found)[slice(0, count)]
    if len(chosen) < count:
        raise RuntimeError(f"{len(chosen)} of {count} pairs of the class {kind!r} are what they are to be")
    return chosen


def measure_speed(
    report: Report,
    peers: tuple[PythonPeer, HeaderPeer],
    progress: Progress,
    count: int,
    repeats: int,
    clock: Clock,
) -> None:
    """Add ns a pair, for partial and trivial pairs, to the report.

    The methods take turns for a few rounds, so that whatever else the machine does meets all of them alike.
    """
    python_peer, header_peer = peers
    bar = progress.add_task("run times", total=len(TIMED_SOLIDS) * (1 + len(TRIVIAL)))
    for solid in TIMED_SOLIDS:
        pairs = partial_pairs(solid, count)
        _measure_in_turns(report, _timed(pairs, python_peer, header_peer, repeats, clock), solid, "partial")
        progress.advance(bar)
        for name in TRIVIAL:
            pairs = trivial_pairs(solid, name, count)
            run = partial(overlap_ours.kernel_volumes, pairs)
            timed: list[Timed] = [partial(_run_ns, "ours, kernel", run, count, repeats, clock)]
            if not header_peer.missing:
                timed.append(partial(_header_ns, header_peer, pairs, repeats))
            _measure_in_turns(report, timed, solid, name)
            progress.advance(bar)
    report.tables.append(_table(report, python_peer, header_peer, count))


def _measure_in_turns(report: Report, timed: list[Timed], solid: Solid, case: str) -> None:
    """Each method's best round."""
    times: dict[str, float] = {}
    for _ in range(ROUNDS):
        for measure in timed:
            for method, each_ns in measure().items():
                times[method] = min(each_ns, times.get(method, each_ns))
    for method, each_ns in times.items():
        report.add("speed", method, solid, case, {"time": (each_ns, "ns/pair")})


def _timed(pairs: Pairs, python_peer: PythonPeer, header_peer: HeaderPeer, repeats: int, clock: Clock) -> list[Timed]:
    timed: list[Timed] = [partial(_run_ns, method, run, rows, repeats, clock) for method, run, rows in _ours(pairs)]
    timed.append(partial(_threaded_ns, pairs, repeats, clock))
    if not header_peer.missing:
        timed.append(partial(_header_ns, header_peer, pairs, repeats))
    if not python_peer.missing:
        timed.append(partial(_python_ns, python_peer, pairs, max(1, repeats // 4), clock))
    return timed


def _run_ns(method: str, run: Callable[[], object], count: int, repeats: int, clock: Clock) -> dict[str, float]:
    with one_core():
        return {method: nanoseconds_each(run, count, repeats, clock)}


def _threaded_ns(pairs: Pairs, repeats: int, clock: Clock) -> dict[str, float]:
    threads = available_cores()
    with ThreadPoolExecutor(threads) as pool:
        run = partial(overlap_ours.threaded_volumes, pairs, pool, threads)
        return {f"ours, kernel, {threads} threads": nanoseconds_each(run, len(pairs), repeats, clock)}


def _header_ns(header_peer: HeaderPeer, pairs: Pairs, repeats: int) -> dict[str, float]:
    with one_core():
        timing = header_peer.timing(pairs, repeats)
    built_ns = timing.overlap_ns + timing.building_ns
    return {"overlap, C++": timing.overlap_ns, "overlap, C++, with building": built_ns}


def _python_ns(python_peer: PythonPeer, pairs: Pairs, repeats: int, clock: Clock) -> dict[str, float]:
    with one_core():
        return {"overlap, Python": python_peer.timing(pairs, repeats, clock).overlap_ns}


def _ours(pairs: Pairs) -> list[tuple[str, Callable[[], object], int]]:
    few = pairs[slice(0, min(_CALLS, len(pairs)))]
    return [
        ("ours, a call each", partial(overlap_ours.call_by_call, few), len(few)),
        ("ours, checked", partial(overlap_ours.checked_volumes, pairs), len(pairs)),
        ("ours, checked, gradient", partial(overlap_ours.checked_overlaps, pairs), len(pairs)),
        ("ours, kernel", partial(overlap_ours.kernel_volumes, pairs), len(pairs)),
        ("ours, kernel, gradient", partial(overlap_ours.kernel_overlaps, pairs), len(pairs)),
    ]


def _table(report: Report, python_peer: PythonPeer, header_peer: HeaderPeer, count: int) -> Table:
    timed = [figure for figure in report.figures if figure.section == "speed"]
    columns = [(solid, case) for solid in TIMED_SOLIDS for case in ("partial", *TRIVIAL)]
    rows = []
    for method in dict.fromkeys(figure.method for figure in timed):
        cells = [report.value("speed", method, solid, case, "time") for solid, case in columns]
        rows.append((method, *("" if cell is None else short(cell) for cell in cells)))
    peers = (("overlap from Python", python_peer.missing), ("overlap in C++", header_peer.missing))
    absent = "".join(f" Not measured: {peer}: {missing}." for peer, missing in peers if missing)
    headings = ("method", *(f"{'tet' if solid == 'tetrahedron' else solid}, {case}" for solid, case in columns))
    return Table(
        "Run time, ns a pair",
        headings,
        rows,
        f"On one core, but for the threads: the best of {ROUNDS} rounds of medians, on {count} pairs that are the "
        "same for every method. Ours: the kernels are what a tick calls, the checked functions validate and "
        "broadcast their arguments as well. The package: prebuilt objects, building them apart." + absent,
    )
