"""`feelahead bench NAME` and `feelahead try NAME`: run a measurement or an experiment of feelahead/lab/questions.

A question's module is imported only when it is asked.
"""

import ast
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from common.errors import ConfigurationError
from common.extras import installing
from common.files.plugged import find, known

_QUESTIONS = Path(__file__).parents[1] / "lab" / "questions"


@dataclass(frozen=True)
class Menu:
    """Command whose first argument names the question (measurement or experiment) to run."""

    name: str
    questions: Mapping[str, str]
    """Extras of the package that each question needs, by its name."""

    def __call__(self, arguments: Sequence[str]) -> int:
        """Run the question that the first argument names: one of `questions`, or a file of the user's own."""
        if not arguments or arguments[0] in ("-h", "--help", "--list"):
            lines = "\n".join(f"  {name:<10}{_sentence(name)}" for name in self.questions)
            sys.stdout.write(
                f"usage: feelahead {self.name} NAME|FILE.py [OPTIONS]\n\n{lines}\n\nEach has its own --help. A file of"
                " your own: feelahead/lab/README.md.\n"
            )
            return 0
        try:
            return self._answer(*arguments)
        except KeyboardInterrupt:  # before the first cell of the sweep, or after the last one
            sys.stderr.write(f"feelahead {self.name} {arguments[0]}: interrupted\n")
            return 130

    def _answer(self, name: str, *rest: str) -> int:
        if name in self.questions:
            return self._ask(f"feelahead.lab.questions.{name}", name, rest)
        if name in known("question"):
            return self._answered(name, find("question", name, {}), rest)
        if not name.endswith(".py"):
            valid = f"{', '.join([*self.questions, *known('question')])}, or a question's file"
            raise ConfigurationError(f"{self.name} {name!r}: no such question; valid: {valid}")
        if not Path(name).is_file():
            raise ConfigurationError(
                f"{self.name} {name}: there is no such file; valid: a Python file that defines QUESTION"
            )
        sys.path.insert(0, str(Path(name).absolute().parent))  # worker processes get the same path
        return self._ask(Path(name).stem, name, rest)

    def _ask(self, module: str, name: str, arguments: Sequence[str]) -> int:
        try:
            import_module("feelahead.lab.sweep")
            found = import_module(module)
        except (ImportError, SyntaxError) as error:
            reason = f"{error}; valid: a Python file that defines QUESTION"
            if name in self.questions and isinstance(error, ModuleNotFoundError):
                remedy = f"to install it: {installing(self.questions[name])}"
                reason = f"{error.name} is not installed; {remedy}"
            raise ConfigurationError(f"{self.name} {name}: {reason}") from error
        if name not in self.questions and Path(found.__file__ or "").resolve() != Path(name).resolve():
            raise ConfigurationError(
                f"{self.name} {name}: Python already has a module of this name; valid: a file with another name"
            )
        return self._answered(name, getattr(found, "QUESTION", None), arguments)

    def _answered(self, name: str, question: object, arguments: Sequence[str]) -> int:
        sweep = import_module("feelahead.lab.sweep")
        if not isinstance(question, sweep.Question):
            raise ConfigurationError(
                f"{self.name} {name}: the file defines no QUESTION; valid: QUESTION = Question(...)"
            )
        code: int = sweep.ask(question, arguments)
        return code


def _sentence(name: str) -> str:
    """Return the first sentence of a question's docstring, read without importing the module."""
    text = ast.get_docstring(ast.parse((_QUESTIONS / f"{name}.py").read_text(encoding="utf-8"))) or ""
    return text.partition("\n\n")[0].replace("\n", " ")


bench = Menu(
    "bench",
    {
        "accuracy": "robot,operator,experiments,bench",
        "overlap": "robot,experiments,bench",
        "error": "robot,operator,experiments",
        "coverage": "robot,operator,experiments",
        "felt": "robot,operator,experiments",
        "front": "robot,operator,experiments",
        "stability": "robot,operator,experiments,bench",
        "link": "robot,operator",
        "tick": "robot,operator",
        "turn": "robot,operator",
    },
)
try_out = Menu(
    "try",
    {
        "approach": "robot,operator,experiments",
        "demo": "robot,operator",
        "haptics": "robot,operator",
        "latency": "robot,operator,experiments",
        "limits": "robot,operator,experiments",
    },
)
