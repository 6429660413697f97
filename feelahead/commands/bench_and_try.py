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
        if name in self.questions:
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
    try:
        sweep = import_module("feelahead.lab.sweep")
        question = import_module(f"feelahead.lab.questions.{name}").QUESTION
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
    ("coverage", "error"),
    {
        "overlap": Entry(
            "feelahead.benchmarks.overlap.bench",
            "bench_overlap",
            "run time against error of the exact overlaps and of what is used in their place",
            "pip install 'feelahead[robot,bench]'",
        ),
        "cover": Entry(
            "feelahead.benchmarks.cover.bench",
            "bench_cover",
            "how closely a gripper's spheres cover it, measured both ways",
            "pip install 'feelahead[robot,bench]'",
        ),
        "link": Entry(
            "feelahead.benchmarks.link.bench",
            "bench_link",
            "the emulated link beside what was asked, and beside recordings of the kernel's netem",
        ),
        "delay": Entry(
            "feelahead.benchmarks.delay.estimates",
            "bench_delay",
            "clock offsets and one-way delays, as estimated from ordinary traffic, beside the truth",
        ),
        "wake": Entry(
            "feelahead.benchmarks.link.wake_error",
            "bench_wake",
            "how late a 1 kHz loop wakes, by how it waits and by what the system was asked for",
        ),
        "dualsense": Entry(
            "feelahead.benchmarks.dualsense.bench",
            "bench_dualsense",
            "our driver of the controller beside pydualsense, on the same simulated reports",
            "pip install 'feelahead[operator,bench]'",
        ),
        "effects": Entry(
            "feelahead.benchmarks.effects.effect_latency",
            "bench_effects",
            "how long it takes from a change of stiffness until the controller is told",
        ),
        "tick": Entry(
            "feelahead.benchmarks.tick.bench",
            "bench_tick",
            "what a tick of the robot side costs in the real process, stage by stage and by objects",
            _BOTH_SIDES,
        ),
        "felt": Entry(
            "feelahead.benchmarks.felt.bench",
            "bench_felt",
            "run time against error of what is felt, as the look ahead is set otherwise",
            "pip install 'feelahead[robot,operator,bench]'",
        ),
        "viewing": Entry(
            "feelahead.benchmarks.viewing.bench",
            "bench_viewing",
            "what pictures and the scene's state cost a real robot side while somebody looks",
            "pip install 'feelahead[robot]'",
        ),
    },
)

try_out = Menu(
    "try",
    "experiment",
    ("demo", "approach"),
    {
        "field": Entry(
            "feelahead.experiments.field.command",
            "try_field",
            "how far from things each strength begins, and what a look ahead costs",
            "pip install 'feelahead[robot,bench]'",
        ),
        "haptics": Entry(
            "feelahead.experiments.haptics.command",
            "try_haptics",
            "the same simulated person with and without haptics, where there is something to hit",
            _BOTH_SIDES,
        ),
        "latency": Entry(
            "feelahead.experiments.latency.command",
            "try_latency",
            "a constant finger over links as they are: delays and contacts, and whether emulations of a link agree",
            "pip install 'feelahead[robot,operator,bench]'",
        ),
        "scenes": Entry(
            "feelahead.experiments.scenes",
            "try_scenes",
            "draw the built-in scenes from above and from the side",
            "pip install 'feelahead[robot,bench]'",
        ),
        "faults": Entry(
            "feelahead.experiments.faults.table",
            "try_faults",
            "every fault of the table: what the robot does when a side, the link or a clock fails",
            _BOTH_SIDES,
        ),
        "hostile": Entry(
            "feelahead.experiments.hostile.run",
            "try_hostile_input",
            "hostile input at a real robot side's port, and what it costs the tick",
            _BOTH_SIDES,
        ),
        "revocation": Entry(
            "feelahead.experiments.revocation",
            "try_revocation",
            "how soon a revoked key is out, and what the others notice",
            _BOTH_SIDES,
        ),
        "soak": Entry(
            "feelahead.experiments.soak.command",
            "try_soak",
            "long runs: whether memory, descriptors and delays stay flat",
            _BOTH_SIDES,
        ),
    },
)
