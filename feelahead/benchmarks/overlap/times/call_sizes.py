"""What a call costs by its number of pairs: a tick has a handful, a notebook thousands."""

from rich.progress import Progress

from common.clock import Clock
from feelahead.benchmarks.overlap import ours as overlap_ours
from feelahead.benchmarks.overlap.times.speed import BATCH, TIMED_SOLIDS, partial_pairs
from feelahead.benchmarks.overlap.times.timing import in_turns, short_calls
from feelahead.benchmarks.report import Report, Table, short

SIZES = (1, 8, 64, BATCH)
_CALLS = 64
"""Calls timed together, each of other pairs."""
_METHODS = {"ours, checked": True, "ours, kernel": False}


def measure_call_sizes(report: Report, progress: Progress, most: int, turns: int, clock: Clock) -> None:
    """Add the time of a call, gradients included, for each of `SIZES` up to `most` pairs."""
    sizes = [size for size in SIZES if size <= most]
    columns = [(solid, method) for solid in TIMED_SOLIDS for method in _METHODS]
    bar = progress.add_task("sizes of calls", total=len(TIMED_SOLIDS) * len(sizes))
    for solid in TIMED_SOLIDS:
        for size in sizes:
            pairs = partial_pairs(solid, min(size * _CALLS, max(size, most)))
            calls = -(-len(pairs) // size)
            contenders = [
                short_calls(method, [overlap_ours.calls(pairs, size, checked=checked)], calls, clock)
                for method, checked in _METHODS.items()
            ]
            for method, call_ns in in_turns(contenders, turns).items():
                report.add("calls", method, solid, f"{size} pairs", {"time": (call_ns, "ns/call")})
            progress.advance(bar)
    rows = [
        (
            str(size),
            *(_cell(report.value("calls", method, solid, f"{size} pairs", "time"), size) for solid, method in columns),
        )
        for size in sizes
    ]
    headings = ("pairs", *(f"{'tet' if solid == 'tetrahedron' else solid}, {method}" for solid, method in columns))
    note = "Partial pairs, gradients included, on one core; in brackets ns a pair."
    report.tables.append(Table("A call by its number of pairs, µs", headings, rows, note))


def _cell(call_ns: float | None, size: int) -> str:
    return "" if call_ns is None else f"{short(1e-3 * call_ns)} ({call_ns / size:.0f})"
