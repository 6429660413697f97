"""The benchmark of delay estimates, run at a small size through its command, and what it compares with."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from common.arrays import FloatArray
from common.errors import ConfigurationError
from feelahead.benchmarks.delay.estimates import COLUMNS, bench_delay, goals
from feelahead.benchmarks.delay.peers import (
    PEERS,
    Stamps,
    best_of_eight,
    least_both_ways,
    line_through_least_round_trips,
    mean_of_offsets,
)
from feelahead.benchmarks.delay.runs import Outcome, measure, quantile_of_sizes, rms
from feelahead.benchmarks.delay.traffic import OperatorClock, Scenario, Traffic, Way, scenarios


def stamps(there_s: FloatArray, back_s: FloatArray, ahead_s: float, skew: float = 0.0) -> Stamps:
    sent_s = 0.004 * np.arange(there_s.size, dtype=np.float64)
    received_s = sent_s + there_s + 0.001 + back_s
    drifted_s = ahead_s + skew * sent_s
    return Stamps(sent_s, sent_s + there_s + drifted_s, sent_s + there_s + 0.001 + drifted_s, received_s)


@pytest.mark.parametrize("name", PEERS)
def test_every_peer_is_exact_on_a_steady_link(name: str) -> None:
    steady = stamps(np.full(500, 0.05), np.full(500, 0.05), 1234.0)
    assert PEERS[name](steady) == pytest.approx(1234.0, abs=1e-9)
    np.testing.assert_allclose(steady.round_trips_s, 0.1, rtol=0.0, atol=1e-9)


def test_peers_do_what_their_names_say() -> None:
    there_s, back_s = np.full(500, 0.05), np.full(500, 0.05)
    there_s[10] = 0.150
    assert mean_of_offsets(stamps(there_s, back_s, 0.0)) == pytest.approx(0.05 / 500)
    there_s[-8:-1] = 0.090
    assert best_of_eight(stamps(there_s, back_s, 0.0)) == pytest.approx(0.0, abs=1e-9)
    there_s[-1] = 0.070
    assert best_of_eight(stamps(there_s, back_s, 0.0)) == pytest.approx(0.010)
    assert least_both_ways(stamps(there_s, back_s, 0.0)) == pytest.approx(0.0, abs=1e-9)
    rising = stamps(there_s, back_s, 0.0, skew=100e-6)
    assert line_through_least_round_trips(rising) == pytest.approx(100e-6 * 2.0, abs=2e-5)


@pytest.mark.parametrize("shape", ["normal", "exponential"])
def test_ways_have_their_shapes(shape: str) -> None:
    way = Way("normal" if shape == "normal" else "exponential", 0.050, 0.010, loss=0.1)
    delays_s = way.draw(np.random.default_rng(1), 100_000)
    arrived_s = delays_s[np.isfinite(delays_s)]
    assert 1.0 - arrived_s.size / delays_s.size == pytest.approx(0.1, abs=0.005)
    assert arrived_s.std() == pytest.approx(0.010, abs=2e-4)
    assert arrived_s.mean() == pytest.approx(0.050 if shape == "normal" else 0.060, abs=2e-4)
    assert arrived_s.min() >= (0.0 if shape == "normal" else 0.050)


def test_traffic_is_the_same_for_the_same_seed() -> None:
    def errors_s(seed: int) -> list[float | None]:
        return [estimate.offset_error_s for estimate in Traffic(scenarios()[0], seed, 1.0)]

    assert errors_s(3) == errors_s(3)
    assert errors_s(3) != errors_s(4)


def test_traffic_goes_at_the_real_rates() -> None:
    way = Way("exponential", 0.001, 1e-6)
    traffic = Traffic(Scenario("", way, way, 0.0), 0, 2.0)
    sides = [estimate.side for estimate in traffic]
    assert sides.count("operator") == pytest.approx(2000, abs=4)
    assert sides.count("robot") == pytest.approx(500, abs=4)
    assert OperatorClock(5.0, 100e-6).reads(10.0) == pytest.approx(15.001)


def test_an_estimate_that_is_wrong_is_told() -> None:
    outcome = Outcome(scenarios()[0], 1, offset_errors_s=[1e-3, 1e-4], one_way_errors_s=[1e-4, np.nan], violations=2)
    verdicts = {goal.claim: goal.verdict for goal in goals([outcome], 5.0)}
    assert verdicts["offset error in ms"] == "missed"
    assert verdicts["one-way delay error in ms"] != "met"
    assert verdicts["violations of the bound"] == "missed"


def test_a_bound_that_is_too_tight_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("common.timing.clock_offset.ClockOffset.bound_at", lambda *_: 1e-9)
    assert measure(scenarios()[0], 1, 0, 1.0, lambda: None).violations > 100


def test_a_missing_figure_never_passes_for_a_good_one() -> None:
    assert np.isnan(rms([0.0, np.nan]))
    assert np.isnan(quantile_of_sizes([0.0, np.nan], 1.0))
    assert quantile_of_sizes([0.1, -0.3, 0.2], 1.0) == 0.3


def test_the_command_prints_tables_and_goals_and_writes_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "figures.csv"
    assert bench_delay(["--runs", "2", "--seconds", "2", "--csv", str(file)]) == 0
    shown = capsys.readouterr().out
    for words in ("50 + exp(10) both ways", "interval", "mean of offsets", "violations of the bound: 0"):
        assert words in shown
    with file.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert tuple(rows[0]) == COLUMNS
    assert {row["link"] for row in rows} == {scenario.name for scenario in scenarios()}
    violations = [row["value"] for row in rows if row["quantity"] == "bound violations"]
    assert violations == ["0"] * len(scenarios())


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--runs", "0"], "--runs 0: valid: 1 to 1000000"),
        (["--seconds", "0"], "--seconds 0"),
        (["--seed", "-1"], "--seed -1: valid: 0 or more"),
        (["--csv", "/nowhere/at/all.csv"], "--csv /nowhere/at/all.csv"),
        (["--runs", "many"], "valid: a whole number"),
    ],
)
def test_bad_arguments_are_one_line(arguments: list[str], complaint: str) -> None:
    with pytest.raises(ConfigurationError) as error:
        bench_delay(arguments)
    assert complaint in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.processes
def test_it_runs_as_a_module_and_refuses_with_code_2() -> None:
    run = subprocess.run(
        [sys.executable, "-m", "feelahead", "bench", "delay", "--runs", "-3"],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert run.returncode == 2
    assert "Traceback" not in run.stderr
    assert "--runs -3" in json.dumps(run.stderr)
