"""Each flag of each command is named in a document, so that nobody has to find it by chance."""

import re
from typing import Final

import pytest

import feelahead.main
import operator_side.main
import robot_side.main
from feelahead.commands.bench_and_try import bench, try_out
from tests.helpers.repository import ROOT

DOCUMENTS: Final = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "Makefile", "feelahead/lab/README.md", "docs")
COMMANDS: Final = [
    *([name] for name in feelahead.main._COMMANDS if name not in ("bench", "try", "keys")),
    *(["keys", action] for action in ("make", "show", "allow", "revoke", "list")),
    ["study", "plan"],
    *([menu.name, question] for menu in (bench, try_out) for question in menu.questions),
    ["feelahead-robot"],
    ["feelahead-operator"],
]
SIDES: Final = {"feelahead-robot": robot_side.main.command, "feelahead-operator": operator_side.main.command}


@pytest.fixture(scope="module")
def named() -> set[str]:
    paths = [path for place in map(ROOT.joinpath, DOCUMENTS) for path in (place, *sorted(place.rglob("*.md")))]
    text = "\n".join(path.read_text(encoding="utf-8") for path in paths if path.is_file())
    found = set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*(?:\.[a-z][a-z0-9-]*)*", text))
    return found | {flag.replace("--no-", "--", 1) for flag in found}


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_every_flag_is_in_a_document(
    words: list[str], named: set[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit):
        SIDES[words[0]](["--help"]) if words[0] in SIDES else feelahead.main.command([*words, "--help"])
    flags = set(re.findall(r"(?:│ |^  )(--[a-z][a-z0-9.-]*)", capsys.readouterr().out, re.MULTILINE))
    assert flags
    assert sorted(flags - named) == []
