"""Run times on the same pairs for everything exact: ours, and the published package."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import product

import numpy as np
from rich.progress import Progress

from common.arrays import BoolArray, FloatArray
from common.clock import Clock
from feelahead.benchmarks.overlap import ours as overlap_ours
from feelahead.benchmarks.overlap.classes import MAKERS
from feelahead.benchmarks.overlap.pairs import Pairs, Solid
from feelahead.benchmarks.overlap.peers import HeaderPeer, PythonPeer
from feelahead.benchmarks.overlap.times.timing import Contender, available_cores, in_turns, one_core, short_calls
from feelahead.benchmarks.report import Report, Table, short

TIMED_SOLIDS: tuple[Solid, ...] = ("tetrahedron", "box")
_ATTEMPTS = 40
"""How often as many pairs again are drawn, to choose from."""
BATCH = 4096
"""Pairs of a call of ours."""
_CALLS = 64
"""Pairs timed a call each."""
_REPEATS = 2
"""What a turn of the package consists of, which takes its own time."""

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
    turns: int,
    clock: Clock,
) -> None:
    """Add ns a pair, for partial and trivial pairs, to the report."""
    python_peer, header_peer = peers
    threads = available_cores()
    bar = progress.add_task("run times", total=len(TIMED_SOLIDS) * (1 + len(TRIVIAL)))
    with ThreadPoolExecutor(threads) as pool:
        for solid, case in product(TIMED_SOLIDS, ("partial", *TRIVIAL)):
            pairs = partial_pairs(solid, count) if case == "partial" else trivial_pairs(solid, case, count)
            contenders = [*_batches(pairs, clock), *_header(header_peer, pairs)]
            if case == "partial":
                shared = partial(overlap_ours.threaded_volumes, pairs, pool, threads)
                name = f"ours, kernel, {threads} threads"
                contenders.append(short_calls(name, [shared], count, clock, threads=True))
                contenders += [_few(pairs, clock), *_python(python_peer, pairs, clock)]
            for method, each_ns in in_turns(contenders, turns).items():
                report.add("speed", method, solid, case, {"time": (each_ns, "ns/pair")})
            progress.advance(bar)
    report.tables.append(_table(report, python_peer, header_peer, count))


def _batches(pairs: Pairs, clock: Clock) -> list[Contender]:
    batches = [pairs[slice(first, first + BATCH)] for first in range(0, len(pairs), BATCH)]
    return [
        short_calls(
            f"ours, {name}", [overlap_ours.calls(batch, BATCH, checked=checked) for batch in batches], len(pairs), clock
        )
        for name, checked in (("checked", True), ("kernel", False))
    ]


def _few(pairs: Pairs, clock: Clock) -> Contender:
    few = pairs[slice(0, min(_CALLS, len(pairs)))]
    return short_calls("ours, a call each", [partial(overlap_ours.call_by_call, few)], len(few), clock)


def _header(header_peer: HeaderPeer, pairs: Pairs) -> list[Contender]:
    def turn() -> FloatArray:
        with one_core():
            return header_peer.timing(pairs, _REPEATS).parts_ns

    def turn_with_building() -> FloatArray:
        with one_core():
            timing = header_peer.timing(pairs, _REPEATS)
        return timing.parts_ns + timing.building_ns

    if header_peer.missing:
        return []
    count = len(pairs)
    return [
        Contender("overlap, C++", count, turn),
        Contender("overlap, C++, with building", count, turn_with_building),
    ]


def _python(python_peer: PythonPeer, pairs: Pairs, clock: Clock) -> list[Contender]:
    def turn() -> FloatArray:
        with one_core():
            return python_peer.timing(pairs, 1, clock).parts_ns

    return [] if python_peer.missing else [Contender("overlap, Python", len(pairs), turn)]


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
        f"On one core, but for the threads: short calls that take turns, the least time of each, on {count} pairs that "
        f"are the same for every method. Ours, in batches of {BATCH}, with the gradients: the kernels check nothing, "
        "the checked functions do, and say what is wrong. The package: prebuilt objects, building them apart; it "
        "gives volumes only." + absent,
    )
