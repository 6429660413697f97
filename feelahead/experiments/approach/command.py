"""Run every approach that was asked for, and say how each ended."""

import contextlib
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Console

from common.command.command_line import parse_settings
from common.files.output_file import write_json
from feelahead.experiments.approach.picture import draw_comparison, draw_run
from feelahead.experiments.approach.settings import ApproachSettings
from feelahead.experiments.approach.table import comparison, sentence
from feelahead.lab.approaches.approach import Approach, run_approach
from feelahead.lab.approaches.frozen import frozen_hash
from feelahead.lab.approaches.laws import compensation_of, without_compensation
from feelahead.lab.approaches.outcome import Outcome
from feelahead.lab.approaches.processes import in_processes
from feelahead.lab.progress import progress

_PROGRAM = "feelahead try approach"
Ended = tuple[Approach, Outcome]


def try_approach(arguments: Sequence[str]) -> int:
    """Run, print, write the summary and the picture; 1 unless each approach ended in a contact or stopped.

    After a Ctrl-C what is done is shown and written all the same.
    """
    settings = parse_settings(ApproachSettings, _PROGRAM, arguments)
    approaches = list(settings.approaches())
    ended = _run_all(approaches, settings.workers)
    frozen = frozen_hash(settings.models())
    # Files first: whoever reads the table may leave early.
    if settings.summary is not None:
        write_json("--summary", settings.summary, _summary(ended, frozen))
    if settings.picture is not None and ended:
        if len(ended) == 1:
            draw_run(*ended[0], frozen, settings.picture)
        else:
            draw_comparison(ended, frozen, settings.picture)
    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False, markup=False)
    if len(ended) == 1:
        console.print(sentence(*ended[0]))
    elif ended:
        console.print(comparison(ended))
    if len(ended) < len(approaches):
        console.print(f"interrupted: {len(ended)} of {len(approaches)} approaches are done")
    console.print(f"frozen scenes and limits: {frozen}")
    told = all(outcome.end in ("contact", "stopped") for _, outcome in ended)
    return 0 if told and len(ended) == len(approaches) else 1


def _run_all(approaches: Sequence[Approach], workers: int) -> list[Ended]:
    """Each in turn, or in several processes at a time; those that were done before a Ctrl-C."""
    outcomes: dict[int, Outcome] = {}
    with progress("approaches", len(approaches)) as advance, contextlib.suppress(KeyboardInterrupt):
        # The first one alone: it compiles the kernels, if they are not there.
        outcomes[0] = run_approach(approaches[0])
        advance(1.0)
        for place, outcome in in_processes(run_approach, [(approach,) for approach in approaches[1:]], workers):
            outcomes[place + 1] = outcome
            advance(1.0)
    return [(approaches[place], outcomes[place]) for place in sorted(outcomes)]


def _summary(ended: Sequence[Ended], frozen: str) -> dict[str, Any]:
    """One run's figures by themselves; several as `runs`."""
    runs = [_figures(approach, outcome) for approach, outcome in ended]
    return (runs[0] if len(runs) == 1 else {"runs": runs}) | {"frozen": frozen}


def _figures(approach: Approach, outcome: Outcome) -> dict[str, Any]:
    settings = asdict(approach) | {
        "model": str(approach.model),
        "haptics": approach.law != "none",
        "law": without_compensation(approach.law),
        "compensation": compensation_of(approach.law),
    }
    figures = {key: value for key, value in vars(outcome).items() if key != "trace"}
    trace = {key: value.tolist() for key, value in vars(outcome.trace).items()}
    if math.isnan(outcome.least_gap_mm):
        figures["least_gap_mm"] = None
    return settings | figures | {"trace": trace}
