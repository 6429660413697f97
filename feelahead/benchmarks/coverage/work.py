"""The benchmark's pieces, done by several processes, each as soon as one is free, and kept in a file as they end."""

import fcntl
import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final, TextIO

from common.errors import ConfigurationError, FeelaheadError
from feelahead.approaches.frozen import frozen_hash
from feelahead.approaches.laws import Law
from feelahead.approaches.processes import in_processes
from feelahead.approaches.spoilt import Spoil
from feelahead.benchmarks.coverage.cells import Cell, Motion, Plan
from feelahead.benchmarks.coverage.closed_loop import check
from feelahead.benchmarks.coverage.evaluate import evaluate
from feelahead.benchmarks.coverage.slowdown import SCENES, race

Records = list[dict[str, Any]]
_ROOT: Final = Path(__file__).parents[3]


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


class Kept:
    """A file with a line for each piece that is done; of another set-up, or of other code, nothing of it counts."""

    def __init__(self, path: Path | None, setup: dict[str, Any]) -> None:
        """ConfigurationError for a file that is there and holds another run, or none, or that another run writes to."""
        self._file: TextIO | None = None
        self._setup: dict[str, Any] = json.loads(json.dumps(setup | {"frozen": frozen_hash(), "code": code_hash()}))
        self.done: dict[str, Records] = {}
        if path is None:
            return
        self._file = path.open("a+", encoding="utf-8")
        try:
            self._load(path, self._file)
        except ConfigurationError:
            self.close()
            raise

    def _load(self, path: Path, file: TextIO) -> None:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            file.seek(0)
            text = file.read()
        except BlockingIOError as error:
            raise ConfigurationError(f"--resume {path}: another run writes to it; valid: a file of its own") from error
        except UnicodeDecodeError as error:
            raise ConfigurationError(
                f"--resume {path}: it holds no run of this benchmark; valid: a new file"
            ) from error
        # A line may be torn: whoever wrote it was stopped.
        entries = [entry for line in text.splitlines() if isinstance(entry := _read(line), dict)]
        if text and (not entries or "plan" not in entries[0]):
            raise ConfigurationError(f"--resume {path}: it holds no run of this benchmark; valid: a new file")
        if entries and entries[0] != self._setup:
            raise ConfigurationError(f"--resume {path}: it holds a run with other settings or code; valid: a new file")
        if not text:
            self._write(self._setup)
        elif not text.endswith("\n"):
            file.write("\n")
        self.done = {entry["piece"]: entry["records"] for entry in entries if "piece" in entry}

    def keep(self, piece: Piece, records: Records) -> None:
        """Write one piece down at once; one that failed is tried again next time."""
        self.done[piece.name] = records
        if not any(record["kind"] == "failed" for record in records):
            self._write({"piece": piece.name, "records": records})

    def close(self) -> None:
        """Let others write to the file."""
        if self._file is not None:
            self._file.close()

    def _write(self, entry: dict[str, Any]) -> None:
        if self._file is not None:
            self._file.write(json.dumps(entry) + "\n")
            self._file.flush()


def code_hash() -> str:
    """One hash of the code that the figures come from."""
    digest = hashlib.sha256()
    for folder in ("common", "operator_side", "robot_side", "feelahead/approaches", "feelahead/benchmarks/coverage"):
        for path in sorted((_ROOT / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _read(line: str) -> Any:
    try:
        return json.loads(line)
    except json.JSONDecodeError:
        return None
