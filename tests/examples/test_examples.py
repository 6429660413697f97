"""Each example runs as it stands, is short, and says what is said of it."""

import re
import runpy
import sys
from pathlib import Path

import pytest

from tests.helpers.repository import ROOT

EXAMPLES = {path.name: path for path in sorted((ROOT / "examples").glob("*.py"))}
WRITES = {
    "haptics_off_and_on.py": ["off_and_on.png"],
    "own_link.py": ["trace.csv"],
    "recording_to_pandas.py": ["run.mcap"],
    "twenty_seeds.py": ["seeds.png", "1"],
}
"""Arguments of the examples that take some: a file to write, and more"""

pytestmark = pytest.mark.long


def run(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> str:
    """Run an example in an empty folder; return what it prints."""
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.setattr(sys, "argv", [name, *WRITES.get(name, [])])
    monkeypatch.chdir(folder)
    runpy.run_path(str(EXAMPLES[name]), run_name="__main__")
    return capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("first_episode.py", r"False: hits the wall at 1\d\d mm/s\n.*True: least gap 10\.\d mm\n"),
        ("haptics_off_and_on.py", r"off: hits the wall at 1\d\d mm/s\nhaptics on: hits nothing\n"),
        ("own_law.py", r"swept: [^\n]* 0 contacts[^\n]*\nnearness: [^\n]* 0 contacts"),
        ("own_link.py", r"delay: loop age [89]\d ms[^\n]*\ntrace: loop age 1\d\d ms"),
        ("own_perception.py", r"sees the wall: \[\]\nloses the wall: \['wall at 1\d\d mm/s'\]"),
        ("own_person.py", r"Stubborn \['wall at \d\d mm/s'\]\nCareful \[\]"),
        ("recording_to_pandas.py", r"controller.r2_meets.*true_gap_m"),
        pytest.param("twenty_seeds.py", r"\n400 ms: gap \d+\.\d to", marks=pytest.mark.processes),
    ],
)
def test_an_example_runs_says_what_it_shows_and_writes_only_what_it_was_told(
    name: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = run(name, tmp_path, monkeypatch, capsys)
    assert re.search(says, said, re.DOTALL), said
    assert [path.name for path in tmp_path.iterdir()] == WRITES.get(name, [])[:1]


def test_every_example_is_short_and_tested() -> None:
    lengths = {name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in EXAMPLES.items()}
    assert {name: length for name, length in lengths.items() if length > 40} == {}
