"""docs/two-machines.md as a program: indented lines are commands, the paragraph before says on which machine."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tests.helpers.repository import ROOT

GUIDE = ROOT / "docs" / "two-machines.md"
Where = Literal["robot", "operator"]

_INDENT = "    "
_PLACEHOLDER = re.compile(r"\b(?:ROBOT|OPERATOR)(?:-KEY)?\b")


class GuideError(AssertionError):
    """The guide cannot be followed; the text says why."""


@dataclass(frozen=True)
class Step:
    """One command of the guide."""

    where: Where
    command: str

    def filled_in(self, words: Mapping[str, str]) -> str:
        """With what stands for the words in capitals; GuideError for one that the guide has not told yet."""

        def word(match: re.Match[str]) -> str:
            if match[0] not in words:
                raise GuideError(f"{self.command}: nothing before it tells {match[0]}")
            return words[match[0]]

        return _PLACEHOLDER.sub(word, self.command)


def steps(path: Path = GUIDE) -> list[Step]:
    """Its commands, in their order; GuideError for one without a machine."""
    found: list[Step] = []
    where: Where | None = None
    paragraph = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith(_INDENT):
            if paragraph:
                where, paragraph = _machine(paragraph), ""
            if where is None:
                raise GuideError(f"{path.name}: {line.strip()!r}: neither machine is named before it")
            found.append(Step(where, line.strip()))
        elif line.startswith("#"):
            where, paragraph = None, ""
        elif line.strip():
            paragraph += f" {line.strip()}"
        elif not paragraph.rstrip().endswith(":"):
            paragraph = ""
    return found


def commands_of(text: str) -> Iterator[str]:
    """The indented lines of a piece of Markdown."""
    return (line.strip() for line in text.splitlines() if line.startswith(_INDENT))


def _machine(paragraph: str) -> Where | None:
    """The machine that is named last."""
    named = re.findall(r"\bthe (robot|operator)'s", paragraph, flags=re.IGNORECASE)
    if not named:
        return None
    return "robot" if named[-1] == "robot" else "operator"
