"""The benchmark's pieces, done by several processes, each as soon as one is free."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from common.errors import ConfigurationError, FeelaheadError
from feelahead.benchmarks.coverage.cells import Cell, Motion, Plan
from feelahead.benchmarks.coverage.closed_loop import check
from feelahead.benchmarks.coverage.evaluate import evaluate
from feelahead.benchmarks.coverage.slowdown import SCENES, race
from feelahead.lab.approaches.kept import Records
from feelahead.lab.approaches.laws import Law
from feelahead.lab.approaches.processes import in_processes
from feelahead.lab.approaches.spoilt import Spoil


@dataclass(frozen=True)
class Piece:
    """What one process does at a time; `name` is what it is resumed by."""

    name: str
    weight: float
    """About how long it takes, against the others."""
    call: Callable[..., Records]
    arguments: tuple[Any, ...]


def pieces(plan: Plan, seed: int, spoil: Spoil) -> list[Piece]:
    """Everything that is to be done, the longest first."""
    found = [
        Piece(f"{motion}", 10.0 + 10.0 * len(cells), judge, (motion, cells, replace(plan, cells=()), seed, spoil))
        for motion, cells in plan.motions().items()
    ]
    for scene in SCENES:
        for law in plan.laws:
            if plan.raced > 0:
                arguments = (scene, law, seed, plan.raced, spoil)
                found.append(Piece(f"race/{scene}/{law}", 3.0 * plan.raced, hurry, arguments))
    found += [
        Piece(f"check/{first}", 5.0 * count, again, (first, count, seed))
        for first, count in ((first, min(12, plan.checked - first)) for first in range(0, plan.checked, 12))
    ]
    return sorted(found, key=lambda piece: -piece.weight)


def judge(motion: Motion, cells: list[Cell], plan: Plan, seed: int, spoil: Spoil) -> Records:
    """The rows of one motion's cells."""
    return [{"kind": "cell"} | asdict(row) for rows in evaluate(motion, cells, plan, seed, spoil) for row in rows]


def hurry(scene: str, law: Law, seed: int, count: int, spoil: Spoil) -> Records:
    """The time to a goal."""
    return [{"kind": "slowdown"} | asdict(race(scene, law, range(count * seed, count * (seed + 1)), spoil))]


def again(first: int, count: int, seed: int) -> Records:
    """Some approaches again, closed loop."""
    return [{"kind": "check"} | asdict(one) for one in check(first, count, seed)]


def do(todo: list[Piece], workers: int) -> Iterator[tuple[Piece, Records]]:
    """Each piece with what came of it, as they end."""
    for place, records in in_processes(_call, [(piece,) for piece in todo], workers):
        yield todo[place], records


def _call(piece: Piece) -> Records:
    try:
        return piece.call(*piece.arguments)
    except ConfigurationError:
        raise
    except FeelaheadError as error:
        # One approach that cannot be recorded must not lose hours of others.
        return [{"kind": "failed", "piece": piece.name, "why": str(error)}]
