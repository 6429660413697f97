"""`try soak`: its judgement, and a short run of either kind."""

import json
from pathlib import Path
from typing import Any

import pytest

from feelahead.both_sides.memory import descriptors, resident_mb
from feelahead.lab.questions.soak import QUESTION, flat
from feelahead.lab.sweep import ask


def series(*resident_mb: float, descriptors: int = 10) -> list[dict[str, Any]]:
    return [{"mb": one, "descriptors": descriptors} for one in resident_mb]


def test_memory_that_fills_at_the_start_and_then_stays_is_flat() -> None:
    assert flat(series(100, *[180] * 20))
    assert flat(series(*[100] * 20, 109))


def test_memory_or_descriptors_that_keep_growing_are_not() -> None:
    assert not flat(series(*range(100, 121)))
    assert not flat([*series(*[100] * 20), *series(100, descriptors=11)])
    assert flat(series(*range(100, 121)), sides=2)


def test_a_process_is_looked_at() -> None:
    assert resident_mb() > 10.0
    assert descriptors() >= 3


def test_a_short_one_in_virtual_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "summary.json"
    assert ask(QUESTION, ["--minutes", "0.02", "--virtual", "--summary", str(path)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].strip() == "flat"
    end = json.loads(path.read_text())["runs"][-1]
    # At 50 Hz and whenever the hands change, but for the first round trip.
    assert 50 < end["messages"]["motion_sent"] <= 70
    assert end["flat"]


@pytest.mark.processes
@pytest.mark.long
def test_a_short_one_with_observers(capsys: pytest.CaptureFixture[str]) -> None:
    assert ask(QUESTION, ["--minutes", "0.1", "--observers", "8"]) == 0
    said = capsys.readouterr().out
    for text in ("robot side", "operator side", "this process"):
        assert text in said
