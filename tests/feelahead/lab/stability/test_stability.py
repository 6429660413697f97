"""`bench stability` passes on a small part of itself, and notices a fault in each part."""

import csv
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.rate.budget import Budget
from common.timing.clock_offset import ClockOffset
from feelahead.lab.approaches.outcome import Trace
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.questions import stability
from feelahead.lab.questions.stability import CLOSED_LOOP, PARTS, QUESTION, Tried, fails
from feelahead.lab.stability import clocks, joints, rates
from feelahead.lab.stability.closed_loop import Loop, judged
from feelahead.lab.stability.tally import Tally
from feelahead.lab.sweep import ask
from robot_side.arm.joint_estimate import JointEstimate
from robot_side.field.field import Ahead
from robot_side.field.scratch import MOST_WORK
from robot_side.overlap import kernels

_FEW = {"resolved rate": 1, "forward kinematics": 3, "joint estimate": 1, "clock offset": 1, "looks": 5}
_QUICKLY: dict[str, str] = {"overlaps": "1 000 km off", "looks": "1 000 km off"}


@pytest.fixture
def few_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Try rate control over two links, for 6 s."""
    monkeypatch.setattr(rates, "LINES", {name: rates.LINES[name] for name in ("2 Mbit/s", "peer's clock jumps by 1 s")})
    monkeypatch.setattr(rates, "LASTS_S", 6.0)
    monkeypatch.setattr(rates, "SETTLED_S", 4.0)
    monkeypatch.setattr(clocks, "PEERS", {name: clocks.PEERS[name] for name in ("steady", "jumps by -0.2 s")})


def tried(part: str) -> list[Tally]:
    group = _QUICKLY.get(part, PARTS[part].groups[0])
    return list(PARTS[part].check(group, _FEW.get(part, 1), np.random.default_rng(1)))


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.usefixtures("few_lines")
def test_each_part_holds_under_stress(part: str) -> None:
    tallies = tried(part)
    assert [tally for tally in tallies if tally.failed] == []
    assert sum(tally.cases for tally in tallies) >= 2


def _off(function: Callable[..., Any], by: float) -> Callable[..., Any]:
    """Return `function` with its first result multiplied by 1 + `by`."""

    def perturbed(*arguments: Any, **named: Any) -> Any:
        first, *rest = function(*arguments, **named)
        return (first * (1.0 + by), *rest)

    return perturbed


FAULTS: dict[str, tuple[str, object, str, Callable[[Any], Any]]] = {
    "a volume's last digits": ("overlaps", kernels, "box_pairs", lambda real: _off(real, 1e-13)),
    "an overlap of NaN": ("overlaps", kernels, "sphere_pairs", lambda real: _off(real, math.nan)),
    "a look half a millimetre late": (
        *("looks", Ahead, "look"),
        lambda real: lambda *given: replace(found := real(*given), onsets_m=found.onsets_m + 5e-4),
    ),
    "a tool a picometre off": (
        *("forward kinematics", PosedGripper, "at"),
        lambda real: lambda *given: replace(there := real(*given), tool_position_m=there.tool_position_m + 1e-11),
    ),
    "no damping": (
        *("resolved rate", joints, "joint_velocities"),
        lambda _: lambda jacobian, twist, *_: np.linalg.pinv(jacobian, rcond=0.0) @ twist,
    ),
    "an estimate that overshoots": (
        *("joint estimate", JointEstimate, "update"),
        lambda real: lambda own, state: real(own, replace(state, joint_positions_rad=2.0 * state.joint_positions_rad)),
    ),
    "an offset that is too sure": (
        *("clock offset", ClockOffset, "bound_at"),
        lambda real: lambda own, now_s: None if (bound := real(own, now_s)) is None else 1e-3 * bound,
    ),
    "a loop age that forgets its peak": (
        *("ages", clocks, "LoopAge"),
        lambda real: lambda worst_s: real(worst_s, time_constant_s=0.4),
    ),
    "a rate that ignores queues": (
        *("rate control", Budget, "hear"),
        lambda _: lambda own, *_: setattr(own.controller, "rate_bit_s", 5e6),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.usefixtures("few_lines")
def test_each_part_notices_a_fault(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    part, where, name, change = FAULTS[fault]
    monkeypatch.setattr(where, name, change(getattr(where, name)))
    assert any(tally.failed for tally in tried(part))


def test_a_tally_fails_by_errors_nan_exceptions_steps_and_without_cases() -> None:
    fine = Tally("fine", "mm", 1.0, most_steps=10)
    assert fine.failed
    fine.note([0.5, -1.0], "first", steps=10)
    assert not fine.failed
    for errors, steps in ((1.1, 1), (math.nan, 1), (math.inf, 1), (0.0, 11)):
        bad = replace(fine)
        bad.note(errors, "second", steps)
        assert (bad.failed, bad.cases) == (True, 2)
    with fine.tried("third"):
        raise ZeroDivisionError("by 0")
    assert (fine.failed, fine.exceptions, fine.where) == (True, 1, "third: ZeroDivisionError: by 0")


def _trace(travel: Callable[[Any], Any], speed_m_s: float = 0.0) -> Trace:
    time_s = np.arange(0.0, 6.0, 0.01)
    speeds, gaps = np.full(len(time_s), speed_m_s), np.full(len(time_s), 0.014)
    return Trace(time_s, speeds, gaps, travel(time_s) + 0.0 * time_s, np.zeros((len(time_s), 10), np.int64))


@pytest.mark.parametrize(
    ("travel", "speed_m_s", "touches", "state"),
    [
        (lambda _: 0.2, 0.0, False, "rests"),
        (lambda t: 0.2 + 0.005 * np.sin(20.0 * t), 0.0, False, "rests"),
        (lambda t: 0.2 + 0.05 * np.sin(20.0 * t), 0.0, False, "chatters"),
        (lambda _: 0.2, 0.05, False, "moves on"),
        (lambda _: 0.2, 0.05, True, "touches"),
    ],
)
def test_the_loops_state_is_judged_by_its_last_two_seconds(
    travel: Callable[[Any], Any], speed_m_s: float, touches: bool, state: str
) -> None:
    found = judged(_trace(travel, speed_m_s), touches=touches)
    assert found["state"] == state
    at = {"part": CLOSED_LOOP, "why": None, "effect_of_pull": 1.5}
    assert fails(at | found) == (state != "rests")


@pytest.mark.long
def test_the_question_prints_tables_and_goals_and_draws_the_map(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written, picture = tmp_path / "out.csv", tmp_path / "out.png"
    few = replace(QUESTION, cells=lambda _: [Tried("ages", "ages", 1), Loop(0.0, 1.5, 40.0, 5.0), Loop(0.0, 0.5, 40.0)])
    assert ask(few, ["--workers=1", f"--csv={written}", f"--picture={picture}"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "met ages: worst error, of its limit" in shown
    assert "met closed loop: points that chatter: 0" in shown
    with written.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["part"] == CLOSED_LOOP]
    assert [row["state"] for row in rows] == ["rests", "touches"]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_failed_tally_and_a_look_that_is_cut_short_are_failures_of_the_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = Tally("class", "m", 1.0, MOST_WORK)
    bad.note(0.0, "cut short", MOST_WORK + 1)
    part = replace(PARTS["looks"], check=lambda *_: iter([bad]))
    monkeypatch.setitem(stability.PARTS, "looks", part)
    assert ask(replace(QUESTION, cells=lambda _: [Tried("looks", "as drawn", 1)]), ["--workers=1"]) == 1
    assert "missed looks: most steps" in " ".join(capsys.readouterr().out.split())
