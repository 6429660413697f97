"""What real links do to the hand that feels what is ahead, and whether the emulated ones are like the kernel's.

feelahead try latency --links lan wifi lte --seeds 5 --out latency
"""

import csv
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from common.files.output_file import output_file, write_json
from feelahead.experiments.latency.matrix import media, run_matrix
from feelahead.experiments.latency.picture import draw
from feelahead.experiments.latency.settings import LatencySettings
from feelahead.experiments.latency.tables import agreement_table, agreements, as_json, figures_table

_PROGRAM = "feelahead try latency"


def try_latency(arguments: Sequence[str]) -> int:
    """Run the matrix, print its tables and write its files; exit code 1 when a trial failed."""
    settings = parse_settings(LatencySettings, _PROGRAM, arguments)
    if settings.out is not None:
        try:
            settings.out.mkdir(exist_ok=True)
        except OSError as error:
            raise ConfigurationError(f"--out {settings.out}: cannot be made: {error.strerror}") from error
    with media(settings) as where:
        rows, failed = run_matrix(settings, where)
    result = as_json(rows, failed)
    if settings.csv is not None:
        write_trials("--csv", settings.csv, result["trials"])
    if settings.out is not None:
        write_trials("--out", settings.out / "trials.csv", result["trials"])
        write_json("--out", settings.out / "latency.json", result)
        if rows:
            draw(rows, settings.out / "latency.png")
    console = Console(width=None if sys.stdout.isatty() else 200)
    console.print(figures_table(rows))
    if found := agreements(rows):
        console.print(agreement_table(found))
    for text in failed:
        console.print(f"failed: {text}", highlight=False, markup=False)
    return 1 if failed else 0


def write_trials(flag: str, path: Path, trials: Sequence[Mapping[str, Any]]) -> None:
    """A line for each trial, a column for each figure."""
    lines = [_flat(trial) for trial in trials]
    with output_file(flag, path) as file:
        writer = csv.DictWriter(file, list(lines[0]) if lines else [])
        writer.writeheader()
        writer.writerows(lines)


def _flat(trial: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in trial.items():
        flat |= {f"{name}_{part}": one for part, one in value.items()} if isinstance(value, Mapping) else {name: value}
    return flat
