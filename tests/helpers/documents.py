"""What a document tells people to type: its indented blocks, and the commands between its backticks."""

import re
import shlex
import textwrap
from dataclasses import dataclass
from pathlib import Path

_BLOCK = re.compile(r"(?:(?<=\n\n)|\A)((?:(?: {4}.*)?\n)+)")
_SPAN = re.compile(r"`((?:feelahead|feelahead-robot|feelahead-operator|make)(?:\s[^`]*)?)`")
_DEFINITION = re.compile(r"\b([A-Z])=(\S*\"[^\"]*\"(?: \"[^\"]*\")*|[^\s;]+)(?:; |$)")
_AN_OPTION = re.compile(r"\[--[^\]]*\]")


@dataclass(frozen=True)
class Document:
    """The Markdown of one file."""

    text: str

    @classmethod
    def read(cls, path: Path) -> "Document":
        """The file's."""
        return cls(path.read_text(encoding="utf-8"))

    def blocks(self) -> list[str]:
        """Every indented block, without its indentation."""
        return [block for found in _BLOCK.finditer(self.text) if (block := textwrap.dedent(found[1]).strip("\n"))]

    def spans(self) -> list[str]:
        """Every command between backticks, on one line."""
        return [" ".join(found[1].split()) for found in _SPAN.finditer(self.text)]


def typed(block: str, names: dict[str, str]) -> list[str]:
    """The lines of a block that are typed: those after `$ ` where there are any, else all; one for each command.

    `names` of one capital letter, which stand for something long, are replaced, and taken in where they are given.
    Options in brackets are left out.
    """
    lines = [line for line in block.replace("\\\n", " ").splitlines() if line.strip()]
    if any(line.startswith("$ ") for line in lines):
        lines = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
    commands: list[str] = []
    for line in lines:
        for name, value in names.items():
            line = line.replace(f"${name}", value)  # noqa: PLW2901
        if _DEFINITION.match(line):
            for name, value in _DEFINITION.findall(line):
                said = value.strip('"') if value.count('"') == 2 else value
                for known, meant in names.items():
                    said = said.replace(f"${known}", meant)
                names[name] = said
        else:
            commands += [part.partition(" | ")[0].strip() for part in _AN_OPTION.sub("", line).split(" && ")]
    return commands


def words(command: str) -> list[str]:
    """A command line as a shell splits it, without what becomes of its output, and without sudo and folders."""
    split = shlex.split(command, comments=True)
    if ">" in split:
        split = split[: split.index(">")]
    if split[:2] == ["sudo", "-u"]:
        split = split[3:]
    elif split[:1] == ["sudo"]:
        split = split[1:]
    return [split[0].rpartition("/")[2], *split[1:]] if split else []
