"""Table of the texts that operators read, and of the state that shows each: docs/console/texts.md.

python -m tests.house.texts writes the document. Texts come from the code. The states of codes come from their
docstrings; all others stand in the document, written by hand, and are kept. A new text gets `?`.
"""

import ast
import re
from collections.abc import Iterable, Iterator
from enum import StrEnum
from pathlib import Path
from typing import Final, NamedTuple

from common.command.words import doing_words, lease_words, words
from common.protocol.session import TRANSITIONS, SessionEvent, SessionState
from common.status.codes import Doing, LinkState, Phase
from tests.helpers.repository import ROOT

DOCUMENT: Final = ROOT / "docs" / "console" / "texts.md"
_PAGE: Final = ROOT / "operator_side" / "viewing" / "console" / "page"
_TERMINAL: Final = (
    *(f"common/command/{name}.py" for name in ("live_line", "live_story", "live_view", "words")),
    "operator_side/viewing/terminal/screen.py",
)
_REASONS: Final = ("robot_side/operators/safety.py", "robot_side/arm/following.py", "robot_side/arm/hindrance.py")
_IN_DETAIL: Final = (SessionEvent.ARM_EARLY, SessionEvent.GAP, SessionEvent.OLD_LOOP, SessionEvent.ASTRAY)
"""Events whose reason in the session's table nobody reads, as `_REASONS` always give it in detail"""
_CHECKS: Final = ("command", "controllers", "link", "machine", "path", "port")
_DOCTOR: Final = tuple(f"feelahead/commands/doctor/{name}.py" for name in _CHECKS)
_LITERAL: Final = re.compile(r'"((?:[^"\\\n]|\\.)*)"|`((?:[^`\\]|\\.)*)`')
_COMMENT: Final = re.compile(r"(?m)^\s*//.*$|(?<=[;,{}\s])// .*$")
_PLACE: Final = re.compile(r"\$\{[^{}]*(?:\{[^{}]*\}[^{}]*)*\}")
_NO_TEXT: Final = re.compile(
    r"#scene|contenteditable|sans-serif|prefers-color|distribution normal|^Hold (and|to) |WEBGL|^IFRAME$|^(gauge|input)"
)
_NO_SENTENCE: Final = re.compile(r"^import |^feelahead doctor|^bold ")
"""Programs, commands and colours in the code of the terminal and the doctor"""
_NOT_SHOWN: Final = {
    **dict.fromkeys(("partition", "removeprefix", "startswith", "ValueError"), slice(None)),
    **dict.fromkeys(("Finding", "PathError"), slice(1)),
}
"""Functions with arguments that are compared with a text, name their own cause, or are a label"""
_ROW: Final = re.compile(r"^\| `([\w.]+)` \| (.*) \| (.*) \|$", re.MULTILINE)
_UNKNOWN: Final = "?"


class Shown(NamedTuple):
    """Text, where it comes from, and the state that shows it."""

    where: str
    text: str
    when: str


def document() -> str:
    """Return the document, with the states that are written by hand in the present one."""
    before = DOCUMENT.read_text("utf-8") if DOCUMENT.exists() else ""
    kept = {(where, text): when for where, text, when in _ROW.findall(before)}

    def table(rows: Iterable[Shown]) -> str:
        return _table(one._replace(when=kept.get((one.where, one.text), _UNKNOWN)) for one in rows)

    parts = [_HEAD, "## State: the bar of the page, and the beginning of the terminal's line", _table(of_codes(Phase))]
    parts += ["## What a person or page does, beside the state", _table(of_codes(Doing))]
    parts += ["## Link and lease", _table([*of_codes(LinkState), *of_codes(SessionState)])]
    parts += ["## Reasons beside DISARMED and STOPPED, or why the arm does not follow"]
    parts += [table([*of_reasons(), *of_code(_REASONS)])]
    of_terminal = (one for one in of_code(_TERMINAL) if f"| {one.text} |" not in "".join(parts))
    parts += ["## Page", table(of_page()), "## Terminal", table(of_terminal)]
    return "\n\n".join([*parts, "## Doctor", table(of_code(_DOCTOR))]) + "\n"


def of_codes(codes: type[StrEnum]) -> Iterator[Shown]:
    """Yield the words of each code, and its docstring as the state."""
    said = {code.name: doing_words(code) if isinstance(code, Doing) else words(code) for code in codes}
    if codes is SessionState:
        said = {code.name: lease_words(code) for code in SessionState}
    path = "common/protocol/session.py" if codes is SessionState else "common/status/codes.py"
    for name, when in _docs(ROOT / path, codes.__name__).items():
        yield Shown(codes.__name__, said[name], when)


def of_reasons() -> Iterator[Shown]:
    """Yield each reason of the session's table that an owner reads as it is there."""
    ends = (SessionState.DISARMED, SessionState.STOPPED)
    whys = (row.why for row in TRANSITIONS if row.after in ends and row.event not in _IN_DETAIL)
    return (Shown("session", why, _UNKNOWN) for why in dict.fromkeys(whys))


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
    """Yield the texts in these modules, each once for a module."""
    for path in paths:
        tree = ast.parse((ROOT / path).read_text("utf-8"))
        yield from (Shown(Path(path).stem, text, _UNKNOWN) for text in dict.fromkeys(_texts(tree)))


def _texts(tree: ast.Module) -> Iterator[str]:
    """Yield the texts of a module that people read: at least two words, and neither documentation nor compared."""
    passed = {id(part) for node in ast.walk(tree) for part in _not_shown(node)}
    for node in ast.walk(tree):
        if id(node) in passed:
            continue
        if isinstance(node, ast.JoinedStr):
            text = "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
        else:
            continue
        text = " ".join(text.split()).replace("|", "/")
        if re.search(r"[A-Za-z]{2,}\S* .*[A-Za-z]{2,}", text) and not _NO_SENTENCE.search(text):
            yield text


def _not_shown(node: ast.AST) -> list[ast.expr]:
    """Return the parts of a node that are documentation, compared with a text, or pieces of one that is a row."""
    if isinstance(node, ast.JoinedStr):
        return [part for part in node.values if isinstance(part, ast.Constant)]
    if isinstance(node, ast.Expr):
        return [node.value]
    if isinstance(node, ast.Compare):
        return [node.left, *node.comparators]
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute | ast.Name):
        name = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
        return node.args[_NOT_SHOWN.get(name, slice(0))]
    return []


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

For those who change one: read it as somebody who sees it for the first time. `python -m tests.house.texts` writes the
texts from the code; what is shown in place of … depends on the run. The states of codes come from the code, too; write
all others here by hand. A sentence that is made of several texts has a row for each."""


if __name__ == "__main__":
    DOCUMENT.write_text(document(), "utf-8")
