"""`feelahead bench error`: what it is told, what it prints and writes."""

import csv
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import feelahead.main
from common.errors import ConfigurationError, FeelaheadError
from feelahead.benchmarks.error import bench
from feelahead.benchmarks.error.bench import ErrorBenchSettings, Found, bench_error
from feelahead.benchmarks.error.figures import Figure
from feelahead.benchmarks.error.gripper import PosedGripper
from feelahead.benchmarks.error.prediction import VARIANTS, Judged
from feelahead.benchmarks.error.propagation import BATCHES, METHODS, measure_propagation
from feelahead.benchmarks.error.recordings import DELAYS_MS, jobs, judge_all, link_spec
from feelahead.benchmarks.error.running_time import monte_carlo_errors
from feelahead.lab.approaches.frozen import frozen_hash
from feelahead.lab.approaches.pulls import PULL_KINDS
from robot_side.simulation.scene import load_scene


def judged(age_s: float) -> Judged:
    errors_m = 1e-3 * np.linspace(-1.0, 2.0, 50)
    return Judged(
        pull="bell",
        link="delay 200ms",
        seed=0,
        loop_age_s=np.full(50, age_s),
        way_m=np.zeros(50),
        within_reach=np.arange(50) % 5 > 0,
        errors_m={"operator": errors_m, "robot": 10.0 * errors_m, "momentary": 8.0 * errors_m},
        by_variant_m=dict.fromkeys(VARIANTS, errors_m),
        speed_errors_m_s=np.zeros(50),
    )


@cache
def found() -> Found:
    times = dict.fromkeys(["linear", "linear, with kinematics", "unscented", *dict(monte_carlo_errors())], 10.0)
    outcomes = list(measure_propagation(PosedGripper(load_scene()), 1, 100 * BATCHES, 0, lambda: None))
    return Found(outcomes, times, [judged(0.05), judged(0.4)], ["steady pull: the arm was stopped [at once]"])


def test_it_prints_its_tables_and_writes_its_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bench, "measure", lambda _: found())
    rows, table, picture = tmp_path / "out.csv", tmp_path / "out.toml", tmp_path / "out.png"
    arguments = ["bench", "error", "--quick", f"--csv={rows}", f"--table={table}", f"--picture={picture}"]
    assert feelahead.main.command(arguments) == 0

    shown = " ".join(capsys.readouterr().out.split())
    assert "Standard deviation along the approach axis" in shown
    assert "linear, quantile at 0.99: off by more than 5 %" in shown
    assert "own commands under way" in shown
    assert "not recorded: steady pull: the arm was stopped [at once]" in shown
    assert f"frozen scenes and limits: {frozen_hash()}" in shown
    with rows.open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert tuple(lines[0]) == Figure._fields
    assert {line["method"] for line in lines} >= {*METHODS, "Monte Carlo", "operator", "robot", "momentary"}
    assert all(np.isfinite(float(line["value"])) for line in lines)
    written = tomllib.loads(table.read_text(encoding="utf-8"))
    assert written["operator"][1]["n"] == 40
    assert written["arm"] == load_scene().robot.fingerprint
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--seed", "-1"], "--seed -1: valid: 0 to"),
        (["--seeds", "0"], "--seeds 0: valid: 1 to"),
        (["--workers", "0"], "--workers 0: valid: 1 to"),
        (["--draws", "100001"], "--draws 100001: valid: 2000 to 10000000, a multiple of 20"),
        (["--draws", "20"], "--draws 20: valid: 2000 to"),
        (["--csv", "/nowhere/out.csv"], "--csv /nowhere/out.csv: is a folder, or its folder is not there"),
        (["--table", "/"], "--table /: is a folder"),
        (["--picture", "out.jpg"], "--picture out.jpg: valid: a file's path that ends in .png"),
        (["--seeds", "x"], "--seeds: 'x'; valid: a number"),
    ],
)
def test_bad_input_is_one_line_that_says_what_is_valid(arguments: list[str], complaint: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        bench_error(arguments)
    assert complaint in str(refused.value)
    assert "\n" not in str(refused.value)


def test_links_jitter_where_their_delay_permits() -> None:
    assert [link_spec(delay_ms) for delay_ms in DELAYS_MS] == [
        "",
        "delay 25ms 6ms distribution normal",
        *(f"delay {delay_ms}ms 10ms distribution normal" for delay_ms in (50, 100, 200, 400)),
    ]


def test_every_pull_goes_over_every_link_with_every_seed() -> None:
    wanted = jobs(5, 2, quick=False)
    assert len(set(wanted)) == len(wanted) == len(PULL_KINDS) * len(DELAYS_MS) * 2
    assert {job.seed for job in wanted} == {5, 6}
    few = jobs(0, 1, quick=True)
    assert len(few) < len(wanted) / 4
    assert {(job.pull, job.link) for job in few} < {(job.pull, job.link) for job in wanted}


def test_what_cannot_be_recorded_is_told_and_all_of_it_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise FeelaheadError("the arm was stopped")

    monkeypatch.setattr("feelahead.benchmarks.error.recordings.record_approach", refuse)
    steps: list[int] = []
    done, failed = judge_all(jobs(0, 1, quick=True)[:2], 1, lambda: steps.append(1))
    assert done == []
    assert len(failed) == len(steps) == 2
    assert failed[0] == "bell pull, seed 0, --link '': the arm was stopped"
    monkeypatch.setattr(bench, "measure_propagation", lambda *_: iter(found().outcomes))
    monkeypatch.setattr(bench, "best_microseconds", lambda *_: {})
    with pytest.raises(FeelaheadError, match="no approach could be recorded: bell pull"):
        bench.measure(ErrorBenchSettings(quick=True, workers=1))
