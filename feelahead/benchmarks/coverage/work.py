"""The benchmark's pieces, done by several processes, each as soon as one is free, and kept in a file as they end."""

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from common.errors import ConfigurationError
from feelahead.approaches.frozen import frozen_hash
from feelahead.approaches.laws import Law
from feelahead.approaches.processes import in_processes
from feelahead.approaches.spoilt import Spoil
from feelahead.benchmarks.coverage.cells import Cell, Motion, Plan
from feelahead.benchmarks.coverage.closed_loop import check
from feelahead.benchmarks.coverage.evaluate import evaluate
from feelahead.benchmarks.coverage.slowdown import SCENES, race

Records = list[dict[str, Any]]


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
        Piece(f"{motion}", 10.0 + 10.0 * len(cells), judge, (motion, cells, plan.of(()), seed, spoil))
        for motion, cells in plan.motions().items()
    ]
    for scene in SCENES:
        for law in plan.laws:
            found.append(Piece(f"race/{scene}/{law}", 3.0 * plan.raced, hurry, (scene, law, seed, plan.raced)))
    found += [
        Piece(f"check/{number}", 6.0, again, (count, seed + number))
        for number, count in ((first, min(12, plan.checked - first)) for first in range(0, plan.checked, 12))
    ]
    return sorted(found, key=lambda piece: -piece.weight)


def judge(motion: Motion, cells: list[Cell], plan: Plan, seed: int, spoil: Spoil) -> Records:
    """The rows of one motion's cells."""
    return [{"kind": "cell"} | asdict(row) for rows in evaluate(motion, cells, plan, seed, spoil) for row in rows]


def hurry(scene: str, law: Law, seed: int, count: int) -> Records:
    """The time to a goal."""
    return [{"kind": "slowdown"} | asdict(race(scene, law, range(seed, seed + count)))]


def again(count: int, seed: int) -> Records:
    """Some approaches again, closed loop."""
    return [{"kind": "check"} | asdict(one) for one in check(count, seed)]


def do(todo: list[Piece], workers: int) -> Iterator[tuple[Piece, Records]]:
    """Each piece with what came of it, as they end."""
    for place, records in in_processes(_call, [(piece,) for piece in todo], workers):
        yield todo[place], records


def _call(piece: Piece) -> Records:
    return piece.call(*piece.arguments)


class Kept:
    """A file with a line for each piece that is done; of another set-up, nothing of it counts."""

    def __init__(self, path: Path | None, setup: dict[str, Any]) -> None:
        """ConfigurationError for a file that is there and holds another run, or none."""
        self._path = path
        self._setup: dict[str, Any] = json.loads(json.dumps(setup | {"frozen": frozen_hash()}))
        self.done: dict[str, Records] = {}
        if path is None or not path.exists():
            return
        lines = path.read_text(encoding="utf-8").splitlines()
        try:
            # The last line may be torn: whoever wrote it was stopped.
            entries = [json.loads(line) for line in lines[:1]] + [one for line in lines[1:] if (one := _read(line))]
        except json.JSONDecodeError as error:
            raise ConfigurationError(
                f"--resume {path}: it holds no run of this benchmark; valid: a new file"
            ) from error
        if entries and entries[0] != self._setup:
            raise ConfigurationError(f"--resume {path}: it holds a run with other settings; valid: a new file")
        self.done = {entry["piece"]: entry["records"] for entry in entries[1:]}

    def keep(self, piece: Piece, records: Records) -> None:
        """Write one piece down at once."""
        self.done[piece.name] = records
        if self._path is None:
            return
        before = self._path.read_bytes() if self._path.exists() else b""
        with self._path.open("a", encoding="utf-8") as file:
            if not before:
                file.write(json.dumps(self._setup) + "\n")
            elif not before.endswith(b"\n"):
                file.write("\n")
            file.write(json.dumps({"piece": piece.name, "records": records}) + "\n")


def _read(line: str) -> dict[str, Any] | None:
    try:
        entry: dict[str, Any] = json.loads(line)
    except json.JSONDecodeError:
        return None
    return entry
