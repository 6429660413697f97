"""The documents' pictures of real runs are those that `make pictures` makes: none missing, stale, or linked nowhere."""

import re
from pathlib import Path

from tests.console.pictures import FILES
from tests.helpers.repository import ROOT

DOCS = ROOT / "docs"
LINK = re.compile(r"\]\(([^)#\s]+)\)|\b(?:src|srcset)=\"([^\"]+)\"")


def linked(document: Path) -> set[Path]:
    """The files that it links, as far as they are in the repository."""
    text = document.read_text(encoding="utf-8")
    return {(document.parent / (plain or source)).resolve() for plain, source in LINK.findall(text)}


def test_the_folders_hold_what_the_command_makes() -> None:
    folders = {(DOCS / name).parent for name in FILES}
    assert {path for folder in folders for path in folder.iterdir()} == {DOCS / name for name in FILES}


def test_the_documents_show_what_the_command_makes() -> None:
    folders = {(DOCS / name).parent.resolve() for name in FILES}
    links = {path for document in (ROOT / "README.md", *DOCS.glob("*.md")) for path in linked(document)}
    assert {path for path in links if path.parent in folders} == {(DOCS / name).resolve() for name in FILES}
