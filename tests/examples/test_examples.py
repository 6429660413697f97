"""Each example runs as it stands, is short, and says what is said of it; the notebook is what its source gives."""

import re
import runpy
import sys
from pathlib import Path

import nbformat
import pytest

import feelahead.both_sides.episode  # noqa: F401  # glfw, which it imports, starts a process
from common.files.plugged import find
from tests.examples.notebook import NOTEBOOK, texts
from tests.helpers.python_process import ended
from tests.helpers.repository import ROOT

EXAMPLES = ROOT / "examples"
README = ROOT / "README.md"
SAYS = {
    "haptics_off_and_on.py": r"off: hits the wall at 1\d\d mm/s\nhaptics on: hits nothing\n",
    "own_law.py": r"swept: [^\n]* 0 contacts[^\n]*\nnearness: [^\n]* 0 contacts",
    "own_link.py": r"delay: loop age [89]\d ms[^\n]*\ntrace: loop age 1\d\d ms",
    "own_perception.py": r"sees the wall: \[\]\nloses the wall: \['wall at 1\d\d mm/s'\]",
    "own_person.py": r"Stubborn \['wall at \d\d mm/s'\]\nCareful \[\]",
    "recording_to_pandas.py": r"controller.r2_meets.*true_gap_m",
}
WRITES = {"haptics_off_and_on.py": "off_and_on.png", "own_link.py": "trace.csv", "recording_to_pandas.py": "run.mcap"}
"""File that an example writes where it is told to"""

pytestmark = pytest.mark.long


def run(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> str:
    """Run an example in an empty folder; return what it prints."""
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.setattr(sys, "argv", [name, *filter(None, [WRITES.get(name)])])
    monkeypatch.chdir(folder)
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    return capsys.readouterr().out


@pytest.mark.parametrize("name", SAYS)
def test_an_example_says_what_it_shows_and_writes_only_what_it_is_told(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = run(name, tmp_path, monkeypatch, capsys)
    assert re.search(SAYS[name], said, re.DOTALL), said
    assert [path.name for path in tmp_path.iterdir()] == [*filter(None, [WRITES.get(name)])]


def test_the_first_episode_prints_what_the_readme_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = run("first_episode.py", tmp_path, monkeypatch, capsys)
    assert f"```text\n{said}```\n" in README.read_text(encoding="utf-8")


@pytest.mark.processes
def test_seeds_run_in_several_processes(tmp_path: Path) -> None:
    picture = tmp_path / "gaps.png"
    code, said, complaint = ended(str(EXAMPLES / "twenty_seeds.py"), str(picture), "1", MPLBACKEND="agg")
    assert code == 0, complaint
    assert re.search(r"\n400 ms: gap \d+\.\d to", said), said
    assert picture.is_file()


@pytest.mark.parametrize("kind", ["law", "person", "perception"])
def test_a_part_of_ones_own_is_found_in_its_example(kind: str) -> None:
    assert isinstance(find(kind, str(EXAMPLES / f"own_{kind}.py"), {}), type)


def test_every_example_is_short_and_tested() -> None:
    lengths = {path.name: len(path.read_text(encoding="utf-8").splitlines()) for path in EXAMPLES.glob("*.py")}
    assert lengths.keys() == {*SAYS, "first_episode.py", "twenty_seeds.py", "paper.py"}
    assert {name: length for name, length in lengths.items() if length > (70 if name == "paper.py" else 40)} == {}


@pytest.mark.processes
def test_the_notebook_is_what_its_source_gives(tmp_path: Path) -> None:
    again = tmp_path / "again.ipynb"
    code, _, complaint = ended("-m", "tests.examples.notebook", str(again), IPYTHONDIR=str(tmp_path))
    assert code == 0, complaint
    kept, made = (nbformat.read(path, as_version=4) for path in (NOTEBOOK, again))
    assert [cell.source for cell in made.cells] == [cell.source for cell in kept.cells]
    assert texts(made) == texts(kept)
    assert texts(kept).count(["picture"]) > 1
