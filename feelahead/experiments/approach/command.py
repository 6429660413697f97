"""Run every approach that was asked for, and say how each ended."""

import json
import multiprocessing
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from typing import Any

from rich.console import Console

from common.command.command_line import parse_settings
from feelahead.approaches.approach import Approach, Outcome, run_approach
from feelahead.approaches.frozen import frozen_hash
from feelahead.approaches.progress import progress
from feelahead.experiments.approach.picture import draw_comparison, draw_run
from feelahead.experiments.approach.settings import ApproachSettings
from feelahead.experiments.approach.table import comparison, sentence

_PROGRAM = "feelahead try approach"
Ended = tuple[Approach, Outcome]


def try_approach(arguments: Sequence[str]) -> int:
    """Run, print, write the summary and the picture; 1 where an approach ended undecided."""
    settings = parse_settings(ApproachSettings, _PROGRAM, arguments)
    approaches = list(settings.approaches())
    ended = _run_all(approaches, settings.workers)
    frozen = frozen_hash(settings.models())
    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False)
    if len(ended) == 1:
        console.print(sentence(*ended[0]))
    else:
        console.print(comparison(ended))
    console.print(f"frozen scenes and limits: {frozen}")
    if settings.summary is not None:
        settings.summary.write_text(json.dumps(_summary(ended, frozen), indent=2) + "\n", encoding="utf-8")
    if settings.picture is not None:
        if len(ended) == 1:
            draw_run(*ended[0], frozen, settings.picture)
        else:
            draw_comparison(ended, frozen, settings.picture)
    return 1 if any(outcome.end == "undecided" for _, outcome in ended) else 0


def _run_all(approaches: Sequence[Approach], workers: int) -> list[Ended]:
    """Each in turn, or in several processes at a time."""
    with progress("approaches", len(approaches)) as advance:
        if workers == 1 or len(approaches) == 1:
            ended = []
            for approach in approaches:
                ended.append((approach, run_approach(approach)))
                advance(1.0)
            return ended
        # The first one alone: it compiles the kernels, if they are not there.
        outcomes = {approaches[0]: run_approach(approaches[0])}
        advance(1.0)
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(workers, mp_context=context) as pool:
            futures = {pool.submit(run_approach, approach): approach for approach in approaches[1:]}
            try:
                for future in as_completed(futures):
                    outcomes[futures[future]] = future.result()
                    advance(1.0)
            finally:
                for future in futures:
                    future.cancel()
        return [(approach, outcomes[approach]) for approach in approaches]


def _summary(ended: Sequence[Ended], frozen: str) -> dict[str, Any]:
    """One run's figures by themselves; several as `runs`."""
    runs = [_figures(approach, outcome) for approach, outcome in ended]
    return (runs[0] if len(runs) == 1 else {"runs": runs}) | {"frozen": frozen}


def _figures(approach: Approach, outcome: Outcome) -> dict[str, Any]:
    settings = asdict(approach) | {"model": str(approach.model), "haptics": approach.law != "none"}
    figures = {key: value for key, value in vars(outcome).items() if key != "trace"}
    trace = {key: value.tolist() for key, value in vars(outcome.trace).items()}
    return settings | figures | {"trace": trace}
