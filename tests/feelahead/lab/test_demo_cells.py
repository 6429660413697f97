"""Cells and tables of `feelahead try demo`: what its settings become, and what it shows."""

from pathlib import Path

import pytest

from feelahead.lab.questions.demo import COLUMNS, DemoSettings, cells, show
from feelahead.lab.table import Table
from tests.helpers.arm_models import planar_arm


def test_each_link_is_a_cell_with_the_ticks_that_are_asked_for() -> None:
    made = list(cells(DemoSettings(link=("", "delay 20ms"), tick_period="5ms")))
    assert [(cell.link, cell.tick_period) for cell in made] == [("", "5ms"), ("delay 20ms", "5ms")]


@pytest.mark.parametrize("placed", [True, False])
def test_a_model_that_does_not_place_the_target_is_told_why(placed: bool, tmp_path: Path) -> None:
    settings = DemoSettings(model=planar_arm(tmp_path), site="tcp", site_axis="x")
    row = dict.fromkeys(COLUMNS, 0.0) | {"link": "", "placed": placed, "seed": 7, "why_not_placed": "gave up"}
    said = [line for line in show(settings, Table([row])) if isinstance(line, str)]
    assert bool(said) is not placed
    assert ("seed 7: not placed: gave up" in said) is not placed
    assert placed or any("--site-axis z fits" in line for line in said)
