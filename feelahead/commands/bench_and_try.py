"""`feelahead bench NAME` and `feelahead try NAME`: the questions of feelahead/lab, imported only when asked for."""

import ast
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from common.errors import ConfigurationError

_QUESTIONS = Path(__file__).parents[1] / "lab" / "questions"


class Entry(NamedTuple):
    """One thing to run."""

    module: str
    function: str
    what: str
    """What it measures, for `--help`."""
    remedy: str = "pip install feelahead"
    """What brings the packages that it needs."""


@dataclass(frozen=True)
class Menu:
    """One command whose first argument names what to run."""

    name: str
    kind: str
    questions: tuple[str, ...]
    entries: dict[str, Entry]

    def __call__(self, arguments: Sequence[str]) -> int:
        """Run what the first argument names."""
        if not arguments or arguments[0] in ("-h", "--help", "--list"):
            lines = [f"  {name:<12}{_sentence(name)}" for name in self.questions]
            lines += [f"  {name:<12}{entry.what}" for name, entry in self.entries.items()]
            sys.stdout.write(
                f"usage: feelahead {self.name} NAME [OPTIONS]\n\n" + "\n".join(lines) + "\n\nEach has its own --help.\n"
            )
            return 0
        name, *rest = arguments
        if name in self.questions or name.endswith(".py"):
            return _ask(self.name, name, rest)
        if name not in self.entries:
            valid = ", ".join((*self.questions, *self.entries))
            raise ConfigurationError(f"{self.name} {name!r}: no such {self.kind}; valid: {valid}")
        entry = self.entries[name]
        try:
            result: int = getattr(import_module(entry.module), entry.function)(rest)
        except ModuleNotFoundError as error:
            raise ConfigurationError(f"{self.name} {name}: {error.name} is not installed; {entry.remedy}") from error
        return result


def _sentence(name: str) -> str:
    """Read the question that begins a question's file, without importing what it needs."""
    text = ast.get_docstring(ast.parse((_QUESTIONS / f"{name}.py").read_text(encoding="utf-8"))) or ""
    return text.partition("\n\n")[0].replace("\n", " ")


def _ask(kind: str, name: str, arguments: Sequence[str]) -> int:
    """Answer a question; ConfigurationError names the package that is missing."""
    module = f"feelahead.lab.questions.{name}"
    if name.endswith(".py"):
        path = Path(name)
        if not path.is_file():
            raise ConfigurationError(f"{kind} {name}: there is no such file; valid: a question's file")
        sys.path.insert(0, str(path.absolute().parent))  # a worker process is given the same
        module = path.stem
    try:
        sweep = import_module("feelahead.lab.sweep")
        question = import_module(module).QUESTION
    except AttributeError as error:
        raise ConfigurationError(f"{kind} {name}: {error}; valid: a file that holds a QUESTION") from error
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            f"{kind} {name}: {error.name} is not installed; it is in one of the extras robot, operator, experiments,"
            " bench"
        ) from error
    code: int = sweep.ask(question, arguments)
    return code


_BOTH_SIDES = "pip install 'feelahead[robot,operator]'"

bench = Menu(
    "bench",
    "benchmark",
    ("overlap", "felt", "link", "tick"),
    {
        "error": Entry(
            "feelahead.benchmarks.error.bench",
            "bench_error",
            "run time against error of the error propagation, and of the prediction of the gripper's way",
            "pip install 'feelahead[robot,operator,bench]'",
        ),
        "coverage": Entry(
            "feelahead.benchmarks.coverage.bench",
            "bench_coverage",
            "how often full stiffness stands in time, and how often without need, for each law",
            "pip install 'feelahead[robot,operator,bench]'",
        ),
    },
)

try_out = Menu(
    "try",
    "experiment",
    ("demo", "haptics", "latency", "faults", "hostile", "soak"),
    {
        "approach": Entry(
            "feelahead.experiments.approach.command",
            "try_approach",
            "a finger of constant force pulls the gripper towards things: does it hit them, and how fast",
            "pip install 'feelahead[robot,operator,bench]'",
        ),
    },
)
