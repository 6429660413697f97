"""Table of the texts that operators read, and of the state that shows each: docs/console/texts.md.

python -m tests.house.texts writes the document anew. Texts come from the code. States come from the docstrings there;
those of the page's scripts stand in the document, and are kept. A new text of a script gets `?`, to be written by hand.
"""

import ast
import re
from collections.abc import Iterable, Iterator
from enum import StrEnum
from pathlib import Path
from typing import Final, NamedTuple

from common.command.words import doing_words, lease_words, words
from common.protocol.session import NOT_ARMED, TRANSITIONS, SessionState
from common.status.codes import Doing, LinkState, Phase
from tests.helpers.repository import ROOT

DOCUMENT: Final = ROOT / "docs" / "console" / "texts.md"
_PAGE: Final = ROOT / "operator_side" / "viewing" / "console" / "page"
_TERMINAL: Final = (
    *("common/command/live_line.py", "common/command/live_story.py"),
    "operator_side/viewing/terminal/screen.py",
)
_CHECKS: Final = ("controllers", "link", "machine", "path", "port")
_DOCTOR: Final = tuple(f"feelahead/commands/doctor/{name}.py" for name in _CHECKS)
_LITERAL: Final = re.compile(r'"((?:[^"\\\n]|\\.)*)"|`((?:[^`\\]|\\.)*)`')
_COMMENT: Final = re.compile(r"(?m)^\s*//.*$|(?<=[;,{}\s])// .*$")
_PLACE: Final = re.compile(r"\$\{[^{}]*(?:\{[^{}]*\}[^{}]*)*\}")
_NO_TEXT: Final = re.compile(
    r"#scene|contenteditable|sans-serif|prefers-color|distribution normal|^Hold (and|to) |WEBGL|^IFRAME$|^(gauge|input)"
)
_ROW: Final = re.compile(r"^\| `(\w+\.js)` \| (.*) \| (.*) \|$", re.MULTILINE)
_UNKNOWN: Final = "?"
_SHORTEST: Final = 12


class Shown(NamedTuple):
    """Text, where it comes from, and the state that shows it."""

    where: str
    text: str
    when: str


def document() -> str:
    """Return the document, with the states of the page's texts that the present document has."""
    before = DOCUMENT.read_text("utf-8") if DOCUMENT.exists() else ""
    kept = {(where, text): when for where, text, when in _ROW.findall(before)}
    page = [one._replace(when=kept.get((one.where, one.text), _UNKNOWN)) for one in of_page()]
    parts = [_HEAD, "## State: the bar of the page, and the beginning of the terminal's line", _table(of_codes(Phase))]
    parts += ["## What a person or page does, beside the state", _table(of_codes(Doing))]
    parts += ["## Link and lease", _table([*of_codes(LinkState), *of_codes(SessionState)])]
    parts += ["## Reasons beside DISARMED and STOPPED", _table(of_reasons())]
    parts += ["## Page", _table(page), "## Terminal", _table(of_code(_TERMINAL)), "## Doctor", _table(of_code(_DOCTOR))]
    return "\n\n".join(parts) + "\n"


def of_codes(codes: type[StrEnum]) -> Iterator[Shown]:
    """Yield the words of each code, and its docstring as the state."""
    said = {code.name: doing_words(code) if isinstance(code, Doing) else words(code) for code in codes}
    if codes is SessionState:
        said = {code.name: lease_words(code) for code in SessionState}
    path = "common/protocol/session.py" if codes is SessionState else "common/status/codes.py"
    for name, when in _docs(ROOT / path, codes.__name__).items():
        yield Shown(codes.__name__, said[name], when)


def of_reasons() -> Iterator[Shown]:
    """Yield each reason that an owner can read, and the event that leads to it."""
    found: dict[str, str] = {}
    for row in TRANSITIONS:
        if row.after in (SessionState.DISARMED, SessionState.STOPPED):
            found.setdefault(row.why, row.event.value)
    for why, event in found.items():
        yield Shown("session", f"{why}: REASON" if why == NOT_ARMED else why, event)


def of_page() -> list[Shown]:
    """Return the texts of the page's scripts that are more than a label, in order, each once for a script."""
    found: dict[tuple[str, str], None] = {}
    for path in sorted(_PAGE.glob("*.js")):
        if path.name == "inputs.js":  # the list of keys, which the page shows as a whole
            continue
        for match in _LITERAL.finditer(_COMMENT.sub("", path.read_text("utf-8"))):
            text = _PLACE.sub("…", match[1] if match[1] is not None else match[2]).strip(" ;")
            if re.search(r"[A-Za-z]{3}.* |…? ?[A-Z]{4}", text) and not _NO_TEXT.search(text):
                found[path.name, text.replace("|", "/")] = None
    return [Shown(where, text, _UNKNOWN) for where, text in found]


def of_code(paths: tuple[str, ...]) -> Iterator[Shown]:
    """Yield the texts in functions of these modules, each with the first line of its function's docstring."""
    for path in paths:
        tree = ast.parse((ROOT / path).read_text("utf-8"))
        for function in ast.walk(tree):
            if isinstance(function, ast.FunctionDef):
                when = (ast.get_docstring(function) or f"`{function.name.strip('_')}`").splitlines()[0]
                for text in dict.fromkeys(_texts(function)):
                    yield Shown(Path(path).stem, text, when.rstrip("."))


def _texts(function: ast.FunctionDef) -> Iterator[str]:
    """Yield the texts of a function that people read: with a blank between words, its docstring aside."""
    inner = {id(part) for one in ast.walk(function) if isinstance(one, ast.JoinedStr) for part in one.values}
    for node in ast.walk(function):
        if isinstance(node, ast.JoinedStr):
            text = "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inner:
            text = node.value
        else:
            continue
        text = " ".join(text.split()).replace("|", "/")
        if re.search(r"[a-z]{2,} .*[a-z]{2,}", text) and len(text) >= _SHORTEST and not _is_docstring(function, node):
            yield text


def _is_docstring(function: ast.FunctionDef, node: ast.AST) -> bool:
    return any(isinstance(line, ast.Expr) and line.value is node for line in ast.walk(function))


def _docs(path: Path, name: str) -> dict[str, str]:
    """Return the docstring below each member of an enum."""
    tree = ast.parse(path.read_text("utf-8"))
    body = next(node.body for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name)
    found = {}
    for member, text in zip(body, [*body[1:], ast.Pass()], strict=True):
        if isinstance(member, ast.Assign) and isinstance(member.targets[0], ast.Name):
            written = text.value.value if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) else ""
            found[member.targets[0].id] = " ".join(str(written).split()).removesuffix(".")
    return found


def _table(rows: Iterable[Shown]) -> str:
    lines = ["| where | text | shown when |", "|---|---|---|"]
    lines += [f"| `{where}` | {text} | {when} |" for where, text, when in rows]
    return "\n".join(lines)


_HEAD: Final = """\
# Texts that an operator reads

For those who change one: read it as somebody who sees it for the first time. `python -m tests.house.texts` writes this
table from the code; what is shown in place of … depends on the run. A text of the page's scripts
gets its state by hand."""


if __name__ == "__main__":
    DOCUMENT.write_text(document(), "utf-8")
