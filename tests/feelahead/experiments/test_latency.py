"""The matrix of links: when two media are said to agree, what is kept, and one trial of it in virtual time and real."""

import csv
import io
import json
import math
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table
from scipy.stats import ttest_ind

from common.command.command_line import parse_settings
from common.errors import ConfigurationError, FeelaheadError
from feelahead.both_sides.trial import Trial, TrialFigures, WayFigures, figures_of
from feelahead.experiments.latency import matrix
from feelahead.experiments.latency.command import try_latency
from feelahead.experiments.latency.equivalence import difference, mean_half_width
from feelahead.experiments.latency.matrix import Row, media, run_matrix
from feelahead.experiments.latency.media import LoopbackMedium, VirtualMedium
from feelahead.experiments.latency.settings import LatencySettings
from feelahead.experiments.latency.tables import agreement_table, agreements, as_json, figures_table
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

WAY = WayFigures(50.0, 4.0, 50.0, 62.0, 2000, 0.01)
FIGURES = TrialFigures(WAY, replace(WAY, mean_ms=60.0), "wall", 32.0, -0.4, 1.0, 130.0, 0)
STILL = replace(FIGURES, first_contact=None, contact_speed_mm_s=None, min_distance_mm=3.0)

# Whether two media agree


def test_equal_samples_are_equivalent_and_shifted_ones_are_not() -> None:
    sample = [50.0, 50.2, 49.9, 50.1, 49.8]
    assert difference(sample, sample, 2.0).verdict == "equivalent"
    assert difference(sample, [value + 1.5 for value in sample], 2.0).verdict == "equivalent"
    shifted = difference(sample, [value + 3.0 for value in sample], 2.0)
    assert shifted.verdict == "differs"
    assert shifted.mean == pytest.approx(3.0)
    assert difference([value + 3.0 for value in sample], sample, 2.0).verdict == "differs"


def test_what_trials_cannot_tell_is_said() -> None:
    for one, other in (([50.0], [50.0, 50.1]), ([50.0, 53.0], [50.5, 52.0]), ([50.0, 50.4, 49.6], [52.0, 52.4, 51.6])):
        assert difference(one, other, 2.0).verdict == "not enough trials to tell"
    assert difference([50.0], [53.0], 2.0).low == -math.inf
    with pytest.raises(ValueError, match="trials = 0 and 1"):
        difference([], [1.0], 2.0)


def test_without_any_spread_two_trials_tell() -> None:
    assert difference([0.0, 0.0], [0.0, 0.0], 0.1).verdict == "equivalent"
    assert difference([0.0, 0.0], [1.0, 1.0], 0.1).verdict == "differs"


def test_the_intervals_are_welchs_and_students() -> None:
    generator = np.random.default_rng(3)
    one, other = generator.normal(50.0, 1.0, 6), generator.normal(51.0, 4.0, 9)
    ours = difference(one.tolist(), other.tolist(), 2.0)
    theirs = ttest_ind(other, one, equal_var=False).confidence_interval(0.95)
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high))
    assert mean_half_width([1.0]) is None
    # Hand-computed: sd √2 over √2, and t of one degree, 12.7062.
    assert mean_half_width([0.0, 2.0]) == pytest.approx(12.7062, rel=1e-5)


# Tables


def row(medium: str, seed: int, mean_ms: float, *, haptics: bool = True, link: str = "wifi") -> Row:
    figures = FIGURES if haptics else STILL
    return Row(medium, Trial(link, haptics, seed), replace(figures, to_robot=replace(WAY, mean_ms=mean_ms)))


def printed(table: Table) -> str:
    console = Console(width=300, record=True, file=io.StringIO())
    console.print(table)
    return console.export_text()


def test_a_seed_counts_once_with_haptics_and_without() -> None:
    rows = [row("virtual", seed, 50.0 + seed, haptics=on) for seed in range(3) for on in (True, False)]
    rows += [row("loopback", seed, 53.0 + seed, haptics=on) for seed in range(3) for on in (True, False)]
    rows.append(row("virtual", 0, 50.0, link="lan"))
    mean, *_ = found = agreements(rows)
    assert {one.link for one in found} == {"wifi"}
    assert (mean.media, mean.direction, mean.seeds) == (("virtual", "loopback"), "to_robot", (3, 3))
    assert mean.difference == difference([50.0, 51.0, 52.0], [53.0, 54.0, 55.0], 2.0)
    said = printed(agreement_table(found))
    assert "virtual - loopback" in said
    assert "equivalent [+0.00, +0.00] %-points" in said


def test_the_table_has_a_row_for_each_kind_and_json_has_every_trial() -> None:
    rows = [row("virtual", seed, 50.0 + seed, haptics=on) for on in (True, False) for seed in range(2)]
    lines = [line for line in printed(figures_table(rows)).splitlines() if "wifi" in line]
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    assert [line[:4] for line in cells] == [["wifi", "on", "virtual", "2"], ["wifi", "off", "virtual", "2"]]
    assert cells[0][4:9] == ["50.50 ± 6.35", "4.00", "50.0", "62.0", "1.000"]
    assert [line[14:16] for line in cells] == [["2/2", "32 (32)"], ["0/2", ""]]
    told = json.loads(json.dumps(as_json([*rows, row("loopback", 0, 50.0)], ["one"]), allow_nan=False))
    assert len(told["trials"]) == 5
    assert told["agreements"][0]["difference"]["interval"] is None
    assert told["failed"] == ["one"]


# Figures of a run


def summary(retransmitted: int = 0, lost: int = 0) -> dict[str, Any]:
    delay = {"mean": 50.0, "sd": 4.0, "p50": 50.0, "p95": 57.0, "p99": 62.0}
    counts = {"sent": 90, "duplicated": 0, "retransmitted": retransmitted, "lost": lost, "outage": 0, "dropped": 0}
    return {
        "driving_delay_ms": {"to_robot": delay, "to_operator": delay | {"mean": 60.0}},
        "link": {"to_robot": {"achieved": counts}, "to_operator": {"achieved": counts}},
        "messages": {"motion_received": 2000, "stiffness_received": 2000},
        "first_contact": {"with": "wall", "speed_mm_s": 32.0, "time_s": 3.0},
        "min_distance_mm": -0.4,
        "stiffness": {"r2": {"max": 1.0}},
        "tick_us": {"p99": 130.0},
        "stops": [],
    }


def test_a_sending_that_is_repeated_was_lost_as_much_as_one_that_is_not() -> None:
    assert figures_of(summary(retransmitted=10)).to_robot.loss_share == pytest.approx(0.1)
    assert figures_of(summary(lost=9)).to_robot.loss_share == pytest.approx(0.1)
    counted = figures_of(summary(lost=9), {"to_robot": 0.01, "to_operator": 0.01})
    assert counted == FIGURES
    assert figures_of(summary() | {"first_contact": None}).contact_speed_mm_s is None


def test_both_ways_of_telling_the_sides_say_the_same() -> None:
    trial = Trial("lte", False, 3, force_n=2.5)
    robot, operator = trial.robot_arguments(), trial.operator_arguments()
    link = trial.link_arguments()
    assert parse_settings(RobotSettings, "robot", [*robot, *link]) == trial.robot_settings()
    assert parse_settings(OperatorSettings, "operator", [*operator, *link]) == trial.operator_settings()


# The matrix


class Counting:
    """A medium in which nothing takes any time."""

    name = "nowhere"

    def __init__(self, fails: str | None = None) -> None:
        self.ran: list[Trial] = []
        self._fails = fails

    def run(self, trial: Trial) -> TrialFigures:
        self.ran.append(trial)
        if trial.link == self._fails:
            raise FeelaheadError("the robot side ended early")
        return FIGURES if trial.haptics else STILL


def test_what_is_kept_is_not_done_again_and_what_failed_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = LatencySettings(links=("lan", "wifi"), seeds=2, resume=tmp_path / "kept.jsonl")
    first, second = Counting(fails="wifi"), Counting()
    rows, failed = run_matrix(settings, [first])
    assert (len(first.ran), len(rows), len(failed)) == (8, 4, 4)
    assert failed[0] == "wifi/on/0/nowhere: the robot side ended early"
    assert failed[0] in capsys.readouterr().err
    rows, failed = run_matrix(settings, [second])
    assert {trial.link for trial in second.ran} == {"wifi"}
    assert (len(second.ran), len(rows), failed) == (4, 8, [])
    assert rows[0].figures == FIGURES
    assert rows[0].trial == Trial("lan", True, 0)


def test_containers_are_opened_only_when_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    containers = Counting()
    fake = SimpleNamespace(open_medium=lambda: nullcontext(containers))
    monkeypatch.setitem(sys.modules, "containers_of_this_test", fake)
    monkeypatch.setattr(matrix, "_CONTAINERS", "containers_of_this_test")
    with media(LatencySettings(compose=True, media=("virtual",))) as found:
        assert [one.name for one in found] == ["virtual", "nowhere"]
    monkeypatch.setattr(matrix, "_CONTAINERS", "feelahead.no_containers_here")
    with media(LatencySettings()) as found:
        assert [one.name for one in found] == ["virtual", "loopback"]
    with pytest.raises(ConfigurationError, match="--compose: No module named"), media(LatencySettings(compose=True)):
        pass


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--links", "lan", "lan"], "--links lan lan: valid: one or more, each once"),
        (["--links", "wify"], "'wify' is unknown there; valid: lan, wifi"),
        (["--links", "delay 1s"], "valid: below 2 s"),
        (["--seeds", "0"], "--seeds 0: valid: 1 or more"),
        (["--force", "nan"], "--force nan: valid: 0 to 20"),
        (["--duration", "1"], "--duration 1.0: valid: 2 to 1000"),
        (["--out", "no/such/folder"], "--out no/such/folder: the folder around it is not there"),
        (["--out", "pyproject.toml"], "--out pyproject.toml: is no folder"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(arguments: list[str], complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint) as raised:
        try_latency(arguments)
    assert "\n" not in str(raised.value)


@pytest.mark.long
def test_a_tiny_matrix_in_virtual_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "latency"
    arguments = ["--links", "wifi", "--seeds", "1", "--media", "virtual", "--duration", "4", "--out", str(out)]
    assert try_latency(arguments) == 0
    assert "| wifi | off     | virtual |      1 |" in capsys.readouterr().out
    told = json.loads((out / "latency.json").read_text(encoding="utf-8"))
    felt, unfelt = told["trials"]
    assert felt["contact_speed_mm_s"] is None or felt["contact_speed_mm_s"] < 40.0
    assert 200.0 < unfelt["contact_speed_mm_s"] < 220.0
    assert unfelt["first_contact"] == "wall"
    assert felt["to_robot"]["mean_ms"] == pytest.approx(6.6, abs=1.5)
    assert felt["to_operator"]["samples"] > 3900
    with (out / "trials.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert [line["haptics"] for line in lines] == ["True", "False"]
    assert (out / "latency.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_virtual_time_gives_the_same_figures_again() -> None:
    trial = Trial("low-orbit", True, 1, duration_s=2.0)
    one, other = (replace(VirtualMedium().run(trial), tick_p99_us=None) for _ in range(2))
    assert one == other
    assert one.to_operator.loss_share == pytest.approx(0.01, abs=0.009)


@pytest.mark.processes
def test_one_trial_in_two_processes() -> None:
    figures = LoopbackMedium().run(Trial("delay 20ms", False, 0, duration_s=5.0))
    for way in (figures.to_robot, figures.to_operator):
        assert way.samples > 0
        assert way.mean_ms is not None
        assert way.mean_ms >= 20.0
        assert way.loss_share == 0.0
    assert figures.min_distance_mm is not None
