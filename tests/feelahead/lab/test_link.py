"""`bench link`: the model compared with recordings of the kernel's netem, and our ends with bare ZeroMQ."""

import csv
import functools
import statistics
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from common.emulation.profile import LinkProfile
from common.protocol.codec import decode
from common.protocol.messages import MotionCommand, StiffnessUpdate
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from feelahead.lab.goals import Goal
from feelahead.lab.link.ends import BYTES, OperatorEnd, RobotEnd
from feelahead.lab.link.samples import (
    LinkSample,
    band_of,
    compare_one,
    distance,
    independent_delays,
    judge,
    pair_of_runs,
    read_link_sample,
)
from feelahead.lab.questions.link import QUESTION
from feelahead.lab.sweep import ask
from tests.helpers.repository import DATA
from tests.helpers.socket_talk import EPHEMERAL, PATIENT_S

NORMAL = "delay 50ms 10ms distribution normal"
SIZE_BYTES = 142


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@functools.cache
def recording(name: str) -> LinkSample:
    return read_link_sample(DATA / "netem" / f"{name}.csv.gz", "--against")


def held(name: str, spec: str, seeds: int, pairs: int = 0) -> list[Goal]:
    profile = LinkProfile.parse(spec)
    reference, _ = recording(name).without_stalls(profile)
    results = [compare_one(profile, reference, seed, SIZE_BYTES) for seed in range(seeds)]
    runs = [pair_of_runs(profile, reference, pair, SIZE_BYTES) for pair in range(pairs)]
    return judge(profile, reference, results, band_of(runs) if runs else None)


def test_a_comparison_has_a_row_for_each_seed_and_a_verdict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rows.csv"
    against = str(DATA / "netem" / "normal.csv.gz")
    assert ask(QUESTION, ["--virtual", "--against", against, "--seeds", "3", "--csv", str(path)]) == 0
    assert "at most 0.03 asked" in capsys.readouterr().out
    written = rows(path)
    assert [row["seed"] for row in written] == ["0", "1", "2"]
    assert len({row["distance"] for row in written}) == 3


# The model beside recordings


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "spec", "stalls"),
    [
        ("normal", NORMAL, 0),
        ("uniform", "delay 50ms 10ms", 38),
        ("pareto", "delay 50ms 10ms distribution pareto", 1),
    ],
)
def test_independent_delays_are_netems(name: str, spec: str, stalls: int) -> None:
    profile = LinkProfile.parse(spec)
    assert recording(name).without_stalls(profile)[1] == stalls
    assert independent_delays(profile)
    # All twenty seeds of the benchmark: fewer would leave the median to chance.
    goals = held(name, spec, 20)
    assert [goal.limit for goal in goals] == [0.03, 0.3, 0.3, 0.02]
    assert {goal.verdict for goal in goals} == {"met"}, goals


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "spec", "count"), [("norm_rate", f"{NORMAL} rate 10mbit", 5), ("gemodel", "loss gemodel 1% 25%", 4)]
)
def test_what_depends_on_its_past_is_within_the_models_own_band(name: str, spec: str, count: int) -> None:
    goals = held(name, spec, 10, pairs=40)
    assert len(goals) == count
    assert {goal.verdict for goal in goals} == {"met"}, goals


@pytest.mark.long
@pytest.mark.parametrize(
    "spec", ["delay 50ms 10ms", "delay 50.6ms 10ms distribution normal", "delay 50ms 11ms distribution normal"]
)
def test_another_link_is_told_apart(spec: str) -> None:
    assert "missed" in {goal.verdict for goal in held("normal", spec, 5)}


def test_figures_of_samples_are_what_they_are_defined_to_be() -> None:
    def delays(*values: float) -> LinkSample:
        return LinkSample(np.arange(len(values), dtype=np.float64), np.array(values))

    assert distance(delays(1, 2), delays(3, 4)) == 1.0
    assert distance(delays(1, 2, 3, 4), delays(1, 2, 3, 9, np.nan)) == pytest.approx(0.25)
    # In order of arrival 1, 0, 3: one of three came after a later one.
    sample = delays(2.5, 0.1, np.nan, 0.1)
    assert sample.late_share == pytest.approx(1 / 3)
    assert (sample.loss_share, sample.mean_burst) == (0.25, 1.0)


# Real ends


@pytest.fixture
def robot() -> Iterator[RobotSockets]:
    with RobotSockets(EPHEMERAL, heartbeat_timeout_s=PATIENT_S) as opened:
        yield opened


def test_our_ends_drive_and_feel_with_messages_of_the_size_that_bare_ends_send(robot: RobotSockets) -> None:
    sent: list[bytes] = []
    with OperatorSockets(robot.control_endpoint, robot.view_endpoint, heartbeat_timeout_s=PATIENT_S) as operator:
        ours, theirs = RobotEnd(robot), OperatorEnd(operator)
        here, there = robot.send, operator.send

        def from_robot(peer: bytes, payload: bytes, *, everywhere: bool = False) -> bool:
            sent.append(payload)
            return here(peer, payload, everywhere=everywhere)

        def from_operator(payload: bytes, *, everywhere: bool = False) -> bool:
            sent.append(payload)
            return there(payload, everywhere=everywhere)

        robot.send, operator.send = from_robot, from_operator  # type: ignore[method-assign]
        robot_turns, operator_turns = ours.run(0.0, 1e12, 1e-3), theirs.run(0.0, 1e12, 1e-3)
        for _ in range(60_000):
            next(robot_turns)
            next(operator_turns)
            kinds = [type(decode(payload)) for payload in sent[-4:]]
            if MotionCommand in kinds and StiffnessUpdate in kinds and len(sent) > 1000:
                break
        else:
            pytest.fail("no commands and fields")
    for kind, size in zip((StiffnessUpdate, MotionCommand), BYTES, strict=True):
        sizes = [len(payload) for payload in sent if isinstance(decode(payload), kind)]
        assert abs(statistics.median(sizes) - size) <= 0.1 * size


@pytest.mark.processes
def test_both_kinds_of_ends_are_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rows.csv"
    assert ask(QUESTION, ["--quick", "--rate", "200", "--csv", str(path)]) == 0
    assert "whole ends by bare ZeroMQ" in capsys.readouterr().out
    written = rows(path)
    assert [row["kind"] for row in written] == ["whole ends", "bare ZeroMQ"] * 2
    assert min(float(row["sent_per_s"]) for row in written if row["kind"] == "bare ZeroMQ") > 0.0
