"""Every figure of the documents comes from a command that stands beside it."""

from pathlib import Path

from feelahead.lab.docs_figures import commands, pictures
from tests.helpers.repository import ROOT


def test_commands_are_read_with_their_continuations_and_without_remarks(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text(
        "    feelahead bench felt \\\n      --picture docs/a.png   # an hour\n\n    feelahead demo\n    make pictures\n"
        "feelahead bench no --picture docs/b.png\n"
    )
    assert list(commands(tmp_path)) == ["feelahead bench felt --picture docs/a.png", "make pictures"]


def test_every_picture_of_the_documents_is_made_by_one_of_the_commands() -> None:
    docs = ROOT / "docs"
    found = list(commands(docs))
    orphans = [
        picture
        for picture in pictures(docs)
        if not any(f" {picture}" in command or f" {Path(picture).parent}" in command.split("#")[0] for command in found)
        and not ("make pictures" in found and picture.startswith(("docs/console/", "docs/recording/")))
    ]
    assert orphans == []
