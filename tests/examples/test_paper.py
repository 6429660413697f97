"""The paper in numbers and figures: the example, its table in docs/paper.md, eq. 12 part by part, and the figures."""

import re
import runpy
from pathlib import Path

import pytest

import feelahead.both_sides.episode  # noqa: F401  # glfw, which it imports, starts a process
from feelahead.lab.paper_figures import FIGURES, parts_of_eq_12
from tests.helpers.repository import ROOT

DOCUMENT = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")


@pytest.mark.long
def test_the_equations_in_numbers_are_those_of_the_document(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(ROOT / "examples" / "paper.py"), run_name="__main__")
    said = capsys.readouterr().out
    table = re.search(r"^eq\. 9-10.*\n(?: +P = .*\n)+", said, re.MULTILINE)
    assert table is not None
    assert f"```text\n{table[0]}```\n" in DOCUMENT
    first, second = re.findall(r"\[([\d. ]+)\] mm", said)
    assert [float(value) for value in first.split()] == pytest.approx(list(map(float, second.split())), rel=0.02)
    exact, thrown = re.search(r"eq\. 11.*: ([\d.]+), by 400 000 points ([\d.]+)", said).groups()  # type: ignore[union-attr]
    assert float(thrown) == pytest.approx(float(exact), rel=0.01)


def test_eq_12_part_by_part_is_the_overlap() -> None:
    whole, (sphere, caps, wedges, cones) = parts_of_eq_12()
    assert sphere - caps + wedges - cones == pytest.approx(whole, abs=1e-12)
    assert min(whole, caps, wedges, cones) > 1e-3


def test_every_file_that_the_document_names_is_there() -> None:
    named = {name for name in re.findall(r"`([\w/]+\.py)`", DOCUMENT) if "/" in name}
    assert len(named) > 15
    assert [name for name in named if not (ROOT / name).is_file()] == []


@pytest.mark.long
@pytest.mark.parametrize(
    "number", [pytest.param(1, marks=pytest.mark.processes), 2, 3, 4, pytest.param(5, marks=pytest.mark.processes)]
)
def test_each_figure_is_drawn(number: int, tmp_path: Path) -> None:
    """Figures 1 and 5 are rendered in a process of their own."""
    FIGURES[number](tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
