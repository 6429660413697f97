"""`bench link`: the model beside recordings of the kernel's netem, real ends beside bare ones, and clock estimates."""

import csv
import functools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from common.emulation.profile import LinkProfile
from common.emulation.trace import Trace
from common.errors import ConfigurationError
from common.protocol.codec import decode
from common.protocol.messages import MotionCommand, StiffnessUpdate
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from feelahead.lab.link import clocks
from feelahead.lab.link.ends import BYTES, OperatorEnd, RobotEnd
from feelahead.lab.link.samples import (
    LinkSample,
    compare,
    distance,
    independent_delays,
    judge,
    measure_band,
    play,
    read_link_sample,
)
from feelahead.lab.questions.link import QUESTION, ratio
from feelahead.lab.sweep import ask
from feelahead.lab.table import Table
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


def nothing() -> None:
    pass


def test_every_message_is_written_and_can_be_replayed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "messages.csv"
    arguments = ["--virtual", "--link", "delay 50ms loss 10%", "--count", "500", "--messages", str(path)]
    assert ask(QUESTION, arguments) == 0
    assert "asked delay 50ms loss 10%" in capsys.readouterr().out
    written = rows(path)
    assert [int(row["sent_ns"]) for row in written] == [number * 1_000_000 for number in range(500)]
    assert {int(row["received_ns"]) - int(row["sent_ns"]) for row in written if row["received_ns"]} == {50_000_000}
    lost = [row["received_ns"] == "" for row in written]
    assert sum(lost) == pytest.approx(50, abs=20)
    assert [delay_s is None for delay_s in Trace.read(path, "trace").delays_s] == lost


def test_a_comparison_has_a_row_for_each_seed_and_a_verdict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rows.csv"
    against = str(DATA / "netem" / "normal.csv.gz")
    assert ask(QUESTION, ["--virtual", "--against", against, "--seeds", "3", "--csv", str(path)]) == 0
    assert "at most 0.03 asked" in capsys.readouterr().out
    written = rows(path)
    assert [row["seed"] for row in written] == ["0", "1", "2"]
    assert len({row["distance"] for row in written}) == 3


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--link", "delay 5"], "50ms"),
        (["--rate", "0"], "1 to 100000"),
        (["--bytes", "3"], "16 to"),
        (["--virtual", "--realtime"], "one of them"),
        (["--against", "x.csv"], "--virtual"),
        (["--virtual", "--against", "nowhere.csv"], "delay_ns"),
        (["--workers", "2"], "--workers 1"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], named: str) -> None:
    with pytest.raises(ConfigurationError, match=r"\A.*\Z") as refusal:
        ask(QUESTION, arguments)
    assert named in str(refusal.value)


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
    reference, left_out = recording(name).without_stalls(profile)
    assert left_out == stalls
    assert independent_delays(profile)
    # All twenty seeds of the benchmark: fewer would leave the median to chance.
    goals = judge(profile, reference, compare(profile, reference, 20, SIZE_BYTES, nothing), None)
    assert [goal.limit for goal in goals] == [0.03, 0.3, 0.3, 0.02]
    assert {goal.verdict for goal in goals} == {"met"}, goals


@pytest.mark.long
@pytest.mark.parametrize(("name", "spec"), [("norm_rate", f"{NORMAL} rate 10mbit"), ("gemodel", "loss gemodel 1% 25%")])
def test_what_depends_on_its_past_is_within_the_models_own_band(name: str, spec: str) -> None:
    profile = LinkProfile.parse(spec)
    reference, _ = recording(name).without_stalls(profile)
    band = measure_band(profile, reference, 40, SIZE_BYTES, nothing)
    goals = judge(profile, reference, compare(profile, reference, 10, SIZE_BYTES, nothing), band)
    assert len(goals) == (5 if name == "norm_rate" else 4)
    assert {goal.verdict for goal in goals} == {"met"}, goals


@pytest.mark.long
@pytest.mark.parametrize(
    "spec", ["delay 50ms 10ms", "delay 50.6ms 10ms distribution normal", "delay 50ms 11ms distribution normal"]
)
def test_another_link_is_told_apart(spec: str) -> None:
    profile = LinkProfile.parse(spec)
    goals = judge(profile, recording("normal"), compare(profile, recording("normal"), 5, SIZE_BYTES, nothing), None)
    assert "missed" in {goal.verdict for goal in goals}


def test_of_two_copies_the_first_counts() -> None:
    sample, line = play(LinkProfile.parse("delay 50ms 10ms duplicate 100%"), [0.1 * n for n in range(2000)], SIZE_BYTES)
    assert line.figures.delivered == 4000
    # The lesser of two uniform numbers: a third of the range from its bottom.
    assert sample.mean_s == pytest.approx(0.040 + 0.020 / 3.0, abs=0.5e-3)


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
        robot.send = lambda peer, payload: sent.append(payload) or here(peer, payload)  # type: ignore[method-assign, func-returns-value]
        operator.send = lambda payload: sent.append(payload) or there(payload)  # type: ignore[method-assign, func-returns-value]
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
        assert abs(max(sizes) - size) <= 0.1 * size


def test_each_turn_is_compared_with_the_peer_of_the_same_turn() -> None:
    shares = {"whole ends": (0.6, 0.3), "bare ZeroMQ": (0.5, 0.25)}
    turns = Table({"kind": kind, "robot": one, "operator": 0.0} for kind, both in shares.items() for one in both)
    assert ratio(turns, "whole ends", "bare ZeroMQ") == pytest.approx(1.2)


@pytest.mark.processes
def test_real_messages_take_the_delay_asked_for_and_every_kind_is_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "messages.csv"
    arguments = ["--link", "delay 40ms duplicate 10%", "--rate", "200", "--count", "200", "--messages", str(path)]
    assert ask(QUESTION, arguments) == 0
    said = capsys.readouterr().out
    for text in ("link to_operator: asked delay 40ms duplicate 10%", "share of one core", "whole ends by bare ZeroMQ"):
        assert text in said
    delays_ms = [1e-6 * (int(row["received_ns"]) - int(row["sent_ns"])) for row in rows(path) if row["received_ns"]]
    # Never early; how late, and how many leave at once after a pause and are refused, is the machine's affair.
    assert min(delays_ms) >= 40.0


# Estimates of clocks


def test_estimates_say_errors_of_both_sides_and_of_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rows.csv"
    assert ask(QUESTION, ["--estimates", "--quick", "--seconds", "2", "--csv", str(path)]) == 0
    said = capsys.readouterr().out
    assert "mean of offsets" in said
    assert "violations of the bound: 0" in said
    written = rows(path)
    assert {row["link"] for row in written} == set(clocks.SCENARIOS)
    assert {row["side"] for row in written} == {"robot", "operator"}


def test_a_bound_that_is_too_tight_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("common.timing.clock_offset.ClockOffset.bound_at", lambda *_: 1e-9)
    found = clocks.run(clocks.ClockCell("estimates", "N(50, 10) both ways", 20.0, 1.0), 0)
    assert sum(row["violations"] for row in found) > 100


def test_a_missing_estimate_never_passes_for_a_good_one() -> None:
    link = next(iter(clocks.SCENARIOS))
    complete = {"link": link, "offset_error_ms": 0.1, "one_way_error_ms": 0.1, "judged": 1, "violations": 0}
    lacking = {"link": link, "judged": 0, "violations": 0}
    verdicts = [goal.verdict for goal in clocks.goals(Table([complete, lacking]))]
    assert verdicts == ["not measured", "not measured", "met"]


def test_other_estimators_do_what_their_names_say() -> None:
    traffic = clocks.Traffic(clocks.scenario("likewise, asymmetry told", 0.0), 1, 0.5)
    sent_s = 0.004 * np.arange(500)
    there_s = np.full(500, 0.07)
    there_s[10], there_s[-8:-1], there_s[-1] = 0.150, 0.090, 0.080
    ahead_s = traffic.clock.ahead_s
    stamps = np.stack(
        [sent_s, sent_s + there_s + ahead_s, sent_s + there_s + 0.001 + ahead_s, sent_s + there_s + 0.051]
    )
    traffic.exchanges = [tuple(row) for row in stamps.T.tolist()]
    found_s = clocks.other_errors_s(traffic)
    # The asymmetry that both ends know is 20 ms, as is the difference of the least delays.
    assert found_s["least both ways"] == pytest.approx(0.010 + 0.010, abs=1e-6)
    assert found_s["best round trip of 8"] == pytest.approx(0.015 + 0.010, abs=1e-6)
    assert found_s["mean of offsets"] == pytest.approx(0.010 + 0.010 + 0.5 * (0.08 + 7 * 0.02 + 0.01) / 500, abs=1e-6)
