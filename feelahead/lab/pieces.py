"""Pieces of work, each one cell of a grid with one seed, and their execution: here, in processes, or on a cluster."""

import functools
import importlib
import json
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from common.command.stop_signal import StopSignal
from common.errors import ConfigurationError, FeelaheadError
from feelahead.lab.cluster import cluster
from feelahead.lab.scheduler import Scheduler
from feelahead.lab.table import Row
from feelahead.printing.progress import Shown
from feelahead.workers import processes

_WORKERS = 2
_LOOK_S = 0.2


@dataclass(frozen=True)
class Piece:
    """Piece of work: one cell of the grid with one seed."""

    cell: Any
    seed: int

    @functools.cached_property
    def key(self) -> str:
        """Key in the journal: the cell's values and the seed, independent of the rest of the grid."""
        return f"{json.dumps(_plain(self.cell), sort_keys=True)} {self.seed}"

    @property
    def columns(self) -> Row:
        """Columns that the piece adds to each of its rows: the cell's scalar values, and the seed."""
        values = _plain(self.cell).items()
        return {name: one for name, one in values if not isinstance(one, list | tuple | dict)} | {"seed": self.seed}

    def __str__(self) -> str:
        return ", ".join(f"{name} {value}" for name, value in self.columns.items())


def results(
    question: Any, settings: Any, todo: Sequence[Piece], shown: Shown
) -> Iterator[tuple[Piece, list[Row] | str]]:
    """Run all pieces in `todo`; yield each when it has ended, with its rows, or with the failure as text.

    Raise KeyboardInterrupt after a stop signal.
    """
    module = question.run.__module__
    if not todo:
        return
    if question.timed or (settings.scheduler is None and (settings.workers == 1 or len(todo) == 1)):
        for piece in todo:
            shown.begin(str(piece))
            yield piece, run_piece(module, piece.cell, piece.seed)
        return
    scheduler: Scheduler | None = settings.cluster()
    if scheduler is None:
        question.prepare()
        pool = processes(settings.workers or _WORKERS)
    else:
        if (warning := scheduler.warning()) is not None:
            sys.stderr.write(f"feelahead {question.name}: {warning}\n")
        pool = cluster(scheduler, _own_file(module))
    left = list(todo)
    # A flag, as an exception that a signal's handler raises may be lost in a callback.
    with StopSignal() as stop, pool as executor:
        futures: dict[Future[list[Row] | str], Piece] = {
            executor.submit(run_piece, module, piece.cell, piece.seed): piece for piece in left
        }
        shown.begin(str(left[0]))
        waiting = set(futures)
        while waiting:
            ended, waiting = wait(waiting, _LOOK_S, FIRST_COMPLETED)
            for future in ended:
                found = future.result()
                left.remove(futures[future])
                if left:
                    shown.begin(str(left[0]))  # the piece that has waited longest
                yield futures[future], found
            if stop.is_set and waiting:
                raise KeyboardInterrupt


def run_piece(module: str, cell: Any, seed: int) -> list[Row] | str:
    """Run one cell of the question in `module`, here or in a worker; return its rows, or the failure as text."""
    question: Any = importlib.import_module(module).QUESTION
    columns = Piece(cell, seed).columns
    try:
        rows = [columns | row for row in question.run(cell, seed)]
    except ConfigurationError:
        raise
    except FeelaheadError as error:
        return str(error)
    # Through JSON, so that a resumed sweep has exactly the values of an uninterrupted one.
    plain: list[Row] = json.loads(json.dumps(rows, default=_of_numpy))
    return plain


def _own_file(module: str) -> str | None:
    """Return the file of a user's own question; None for a question of feelahead, which every worker has installed."""
    return None if "." in module else sys.modules[module].__file__


def _of_numpy(value: Any) -> Any:
    """Convert a number or array of NumPy to Python's numbers and lists."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"a row holds {value!r}; valid: numbers, texts, lists and None")


def _plain(cell: object) -> dict[str, Any]:
    """Return a cell's fields as JSON values."""
    plain: dict[str, Any] = msgspec.to_builtins(cell, enc_hook=str)
    return plain
