import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from scipy.stats import binom

from common.errors import ConfigurationError
from feelahead.experiments import scenes
from feelahead.experiments.haptics import command
from feelahead.experiments.haptics.command import ARMS, ComparisonSettings, Row, link_of, tables
from feelahead.experiments.haptics.statistics import exact_interval, mcnemar_p, mean_difference_interval, restricted
from feelahead.lab.questions import demo as demo_question
from feelahead.lab.sweep import ask
from feelahead.lab.trial import Arm, Result, Trial, run_trial
from operator_side.simulated_person.settings import PersonSettings

pytestmark = pytest.mark.long

NOTHING = Result(0, None, None, True, 110.0, True, 20.0, 25.0, 1.0, 30.0, 0.0)
HIT = replace(NOTHING, hits=2, hit_first="wall", fastest_hit_mm_s=80.0, finished_s=None, placed=False)


@given(of=st.integers(1, 200), share=st.floats(0.0, 1.0))
def test_the_exact_interval_leaves_as_much_on_either_side(of: int, share: float) -> None:
    count = round(share * of)
    low, high = exact_interval(count, of)
    assert low <= count / of <= high
    assert count == 0 or binom.sf(count - 1, of, low) == pytest.approx(0.025, abs=1e-6)
    assert count == of or binom.cdf(count, of, high) == pytest.approx(0.025, abs=1e-6)


def test_mcnemar_counts_the_pairs_that_change() -> None:
    # Six lose it and none gains it: 2 / 2^6.
    assert mcnemar_p([True] * 6 + [False] * 4, [False] * 10) == pytest.approx(2.0 / 2**6)
    assert mcnemar_p([True, False], [False, True]) == 1.0
    assert mcnemar_p([True] * 9, [True] * 9) == 1.0


def test_who_is_not_done_in_time_counts_with_the_limit() -> None:
    assert restricted([10.0, None, 50.0], 45.0).tolist() == [10.0, 45.0, 45.0]


def test_the_interval_of_the_difference_is_that_of_pairs() -> None:
    before = np.arange(30.0)
    assert mean_difference_interval(before, before + 2.0) == pytest.approx((2.0, 2.0))
    noise = np.random.default_rng(1).normal(size=30)
    low, high = mean_difference_interval(before, before + noise)
    assert low < noise.mean() < high
    # The normal interval, within what 10 000 resamples of 30 differ by.
    assert high - low == pytest.approx(2 * 1.96 * noise.std() / np.sqrt(30), rel=0.1)
    assert mean_difference_interval(before, before + noise) == (low, high)


def printed(rows: list[Row], settings: ComparisonSettings) -> str:
    console = Console(width=200, record=True, file=io.StringIO())
    for table in tables(settings, rows):
        console.print(table)
    return console.export_text()


def test_a_table_sets_the_arms_side_by_side() -> None:
    settings = ComparisonSettings(scenes=("wall",), delays=(200.0,), seeds=6)
    outcomes: dict[Arm, Result] = {"off": HIT, "mechanical": NOTHING, "reacting": replace(NOTHING, finished_s=25.0)}
    rows = [Row("wall", 200.0, arm, seed, outcomes[arm]) for arm in ARMS for seed in range(6)]
    off, mechanical, reacting = (line for line in printed(rows, settings).splitlines() if "/6 " in line)
    assert "6/6 [54 to 100 %]" in off
    assert "80 (80)" in off
    assert "0/6 [0 to 46 %]" in mechanical
    assert "0.031" in mechanical
    assert "-25.0 [-25.0, -25.0]" in mechanical
    assert "-20.0 [-20.0, -20.0]" in reacting


def test_trials_that_are_kept_are_not_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run: list[tuple[str, int]] = []

    def outcome(trial: Trial) -> Result:
        run.append((trial.arm, trial.seed))
        return replace(HIT, lifted_mm=trial.seed / 3.0)

    monkeypatch.setattr(command, "run_trial", outcome)
    few = ComparisonSettings(scenes=("wall",), delays=(0.0,), seeds=2, workers=1, resume=tmp_path / "kept.jsonl")
    rows = command.compare(few)
    # One seed after the other, so that what is stopped has whole pairs.
    assert run == [(arm, seed) for seed in range(2) for arm in ARMS]
    assert command.compare(few) == rows
    more = command.compare(replace(few, seeds=3))
    assert run[6:] == [(arm, 2) for arm in ARMS]
    assert [row for row in more if row.seed < 2] == rows
    with pytest.raises(ConfigurationError, match="other settings"):
        command.compare(replace(few, jitter=5.0))


def test_a_trial_is_repeatable_and_differs_by_nothing_but_haptics_at_first() -> None:
    def run(arm: Arm) -> Result:
        return run_trial(Trial("slot", link_of(20.0, 10.0), arm, PersonSettings(), 3.0, tick_period_s=0.004), 3)

    off = run("off")
    assert run("off") == off
    # Nothing is near yet, and a robot side that works nothing out moves as one that does.
    assert run("mechanical") == off


def test_the_command_prints_tables_and_writes_every_trial(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "trials.csv"
    arguments = ["--scenes", "wall", "--delays", "0", "--seeds", "1", "--duration", "0.2", "--workers", "1"]
    assert command.try_haptics([*arguments, "--csv", str(path)]) == 0
    assert "wall, 0 ms each way, 1 pairs" in capsys.readouterr().out
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["scene"], row["arm"], row["seed"]) for row in rows] == [("wall", arm, "0") for arm in ARMS]


def test_the_demos_runs_have_a_row_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert ask(demo_question.QUESTION, ["--seeds", "2", "--duration", "0.2", "--workers", "1", "--link", ""]) == 0
    said = capsys.readouterr().out
    assert "link: none" in said
    assert "of 2" in said


def test_each_scene_is_drawn(tmp_path: Path) -> None:
    assert scenes.try_scenes(["--out", str(tmp_path)]) == 0
    assert {path.stem for path in tmp_path.glob("*.png")} == {"table", "wall", "slot", "shelf"}


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--seeds", "0"], "0"),
        (["--workers", "0"], "0"),
        (["--duration", "-1"], "-1"),
        (["--delays", "1000"], "1000"),
        (["--delays", "5", "5"], "5.0 5.0"),
        (["--jitter", "-1"], "-1"),
        (["--camera-mm", "-1"], "-1"),
        (["--tick", "0"], "0"),
        (["--scenes", "attic"], "attic"),
    ],
)
def test_bad_settings_are_named(arguments: list[str], named: str) -> None:
    with pytest.raises(ConfigurationError, match=named):
        command.try_haptics(arguments)
