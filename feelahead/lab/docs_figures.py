"""Make every figure of the documents again, by the commands beside them, and say which changed: `make figures`.

A command is an indented line of a page that names a place in docs/ or is `make pictures`; a backslash continues it.
"""

import hashlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro

from common.command.command_line import parse_settings
from common.errors import ConfigurationError
from feelahead.lab.progress import progress

_ROOT: Final = Path(__file__).parents[2]
_COMMAND: Final = re.compile(r"^    ((?:feelahead |python -m |make )(?:.*\\\n)*.*)$", re.MULTILINE)
_PICTURES: Final = (".png", ".svg", ".webp")


@dataclass(frozen=True)
class DocsFigures:
    """Run the commands of docs/ that make figures, one after the other, on a machine with nothing else to do."""

    only: Annotated[tuple[str, ...], tyro.conf.arg(metavar="TEXT...")] = ()
    """Run only commands that contain one of these."""
    list: bool = False
    """Show the commands, and run none."""


def commands(docs: Path) -> Iterator[str]:
    """Read the commands that make figures, page by page, each once."""
    found: dict[str, None] = {}
    for page in sorted(docs.rglob("*.md")):
        for match in _COMMAND.finditer(page.read_text(encoding="utf-8")):
            command = re.sub(r"\s*\\\n\s*", " ", match[1]).partition("  #")[0].strip()
            if " docs/" in command or command.startswith("make pictures"):
                found[command] = None
    yield from found


def pictures(docs: Path) -> dict[str, str]:
    """Hash every picture of the documents, by its path."""
    paths = sorted(path for path in docs.rglob("*") if path.suffix in _PICTURES)
    return {path.relative_to(docs.parent).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def make_figures(arguments: Sequence[str]) -> int:
    """Run the commands, and say which pictures changed; 1 where a command failed."""
    settings = parse_settings(DocsFigures, "make figures", arguments)
    docs = _ROOT / "docs"
    if not docs.is_dir():
        raise ConfigurationError("there are no documents here; valid: a clone of the repository")
    wanted = [line for line in commands(docs) if not settings.only or any(text in line for text in settings.only)]
    if settings.list:
        sys.stdout.write("\n".join(wanted) + "\n")
        return 0
    # The same interpreter's console scripts come first.
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    failed: list[str] = []
    before = pictures(docs)
    with progress("figures", float(len(wanted) or 1)) as shown:
        for command in wanted:
            shown.begin(command)
            done = subprocess.run(command, shell=True, cwd=_ROOT, env=environment, check=False)  # noqa: S602  # ours
            failed += [f"failed: {command}\n"] if done.returncode else []
            shown.advance(1.0)
    changed = [f"changed: {path}\n" for path, content in pictures(docs).items() if before.get(path) != content]
    sys.stdout.write("".join(failed + changed) or "no figure changed\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(make_figures(sys.argv[1:]))
