"""Cells of `feelahead try demo`: what its settings become."""

from feelahead.lab.questions.demo import DemoSettings, cells


def test_each_link_is_a_cell_with_the_ticks_that_are_asked_for() -> None:
    made = list(cells(DemoSettings(link=("", "delay 20ms"), tick_period=0.005)))
    assert [(cell.link, cell.tick_period_s) for cell in made] == [("", 0.005), ("delay 20ms", 0.005)]
