"""`feelahead bench coverage`: do the work, keep it, and show it."""

import csv
import sys
from collections.abc import Sequence
from dataclasses import asdict, fields

from rich.console import Console

from common.command.command_line import parse_settings
from common.files.output_file import output_file
from feelahead.benchmarks.coverage.evaluate import Row
from feelahead.benchmarks.coverage.settings import CoverageSettings
from feelahead.benchmarks.coverage.tables import alarm_table, check_lines, coverage_table, draw, law_table, pull_table
from feelahead.benchmarks.coverage.work import Piece, do, pieces
from feelahead.lab.approaches.frozen import frozen_hash
from feelahead.lab.approaches.kept import Kept
from feelahead.lab.progress import progress

_PROGRAM = "feelahead bench coverage"


def bench_coverage(arguments: Sequence[str]) -> int:
    """Run the benchmark, print its tables, write the CSV and the picture; 1 where a part of it could not be done."""
    settings = parse_settings(CoverageSettings, _PROGRAM, arguments)
    plan, frozen = settings.plan(), frozen_hash()
    setup = {"plan": asdict(plan), "seed": settings.seed, "spoil": settings.spoil}
    whole = pieces(plan, settings.seed, settings.spoil)
    kept = Kept(settings.resume, setup)
    try:
        _work([piece for piece in whole if piece.name not in kept.done], kept, settings.workers)
    finally:
        kept.close()
    records = [record for piece in whole for record in kept.done[piece.name]]
    cells = sorted((one for one in records if one["kind"] == "cell"), key=lambda one: one["cell"])
    console = Console(width=None if sys.stdout.isatty() else 160, highlight=False)
    console.print(coverage_table(cells, settings.laws))
    console.print(alarm_table(cells, settings.laws))
    for law in settings.laws:
        console.print(pull_table(cells, law))
    console.print(law_table(records, settings.laws))
    for line in check_lines(records):
        console.print(line)
    failed = [one for one in records if one["kind"] == "failed"]
    for one in failed:
        console.print(f"failed: {one['piece']}: {one['why']}", markup=False)
    console.print(f"frozen scenes and limits: {frozen}")
    if settings.csv is not None:
        with output_file("--csv", settings.csv) as file:
            names = [column.name for column in fields(Row)] + ["frozen"]
            writer = csv.DictWriter(file, names, extrasaction="ignore")
            writer.writeheader()
            writer.writerows(one | {"frozen": frozen} for one in cells)
    if settings.picture is not None:
        draw(records, settings.laws, frozen, settings.picture)
    return 1 if failed else 0


def _work(todo: list[Piece], kept: Kept, workers: int) -> None:
    """Do what is left."""
    with progress("coverage", sum(piece.weight for piece in todo)) as advance:
        for piece, records in do(todo, workers):
            kept.keep(piece.name, records)
            advance(piece.weight)
