"""Predictions of the displacement are compared with the true displacement."""

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray
from feelahead.lab.approaches.prediction import AGE_BINS_S, COMPENSATIONS, error_table, judge, moments, over
from feelahead.lab.approaches.recording import RecordedApproach
from feelahead.lab.questions import error as module
from feelahead.lab.questions.error import QUESTION
from feelahead.lab.sweep import ask
from feelahead.lab.table import Row, Table
from robot_side.arm.limits import ACCELERATION_RAD_S2, ArmLimits
from robot_side.arm.port import GripperPose
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.enlargement.prediction_errors import load_prediction_errors

FULL_M_S = 0.25
LIMITS = ArmLimits()
TICK_S = 0.001
BEGAN_S, END_S = 2.0, 6.0


def pose_at(joints: FloatArray) -> GripperPose:
    """Return the pose of an arm of one joint that slides along x, its approach axis."""
    jacobian = np.zeros((6, 1))
    jacobian[0] = 1.0
    return GripperPose(
        tool_position_m=np.array([joints[0], 0.0, 0.0]),
        tool_rotation=np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        tool_jacobian=jacobian,
        sphere_centers_m=np.zeros((0, 3)),
        sphere_radii_m=np.zeros(0),
        sphere_on_finger=np.zeros(0, dtype=bool),
    )


def recorded(travels: FloatArray, there_ms: int, back_ms: int, quantile_s: float = 0.5) -> RecordedApproach:
    """Return the record of an arm that follows its commands exactly, over a link with constant delays.

    travels: one every 4 ms; the arm is commanded to move at travel times full speed. Its speed changes by at most
    8 m/s², in steps of a millisecond.
    """
    ticks = np.round(np.arange(0.0, END_S, TICK_S), 3)
    sent_s = np.round(0.004 * np.arange(len(travels)), 3)
    # A command sent at s is followed from s + there_ms on; a speed changes in the milliseconds after that.
    newest = (np.arange(len(ticks)) - there_ms) // 4
    followed = np.where(newest >= 0, sent_s[np.clip(newest, 0, None)], np.nan)
    way_m, speed, onsets_m, speeds = 0.0, 0.0, [], []
    for index in newest:
        onsets_m.append(way_m)
        speeds.append(speed)
        target = FULL_M_S * travels[index] if index >= 0 else 0.0
        most = ACCELERATION_RAD_S2 * TICK_S
        after = speed + min(max(target - speed, -most), most)
        way_m += 0.5 * (speed + after) * TICK_S
        speed = after
    poses = slice(0, None, 10)
    count = len(ticks[poses])
    return RecordedApproach(
        seed=0,
        began_s=BEGAN_S,
        pose_time_s=ticks[poses],
        joint_positions_rad=np.array(onsets_m)[poses, None],
        joint_velocities_rad_s=np.array(speeds)[poses, None],
        finger_positions=np.zeros((count, 0)),
        loop_age_s=np.full(count, quantile_s),
        tick_time_s=ticks,
        applied_sent_s=followed,
        applied_at_s=np.round(followed + 1e-3 * there_ms, 3),
        seen_sent_s=np.where(ticks >= 1e-3 * back_ms, np.round(ticks - 1e-3 * back_ms, 3), np.nan),
        travel=np.zeros((len(ticks), 2)),
        command_time_s=sent_s,
        command=travels,
        lateral=np.zeros((len(travels), 2)),
        turning=np.zeros((len(travels), 2)),
    )


def bells() -> FloatArray:
    time_s = 0.004 * np.arange(round(END_S / 0.004))
    return np.where(time_s < BEGAN_S, 0.0, 0.5 - 0.5 * np.cos(2.0 * math.pi * (time_s - BEGAN_S)))


def greatest_m(row: Row, name: str) -> float:
    return float(np.abs(row[name]).max())


@pytest.mark.parametrize(("there_ms", "back_ms"), [(0, 0), (20, 100), (400, 400)])
def test_the_commands_under_way_predict_an_obedient_arm(there_ms: int, back_ms: int) -> None:
    lets_go = np.where(np.arange(1500) * 0.004 < 4.0, 1.0, 0.0)
    # An arm of infinite acceleration would be v²/2a = 3.9 mm off.
    assert greatest_m(judge(recorded(lets_go, there_ms, back_ms), pose_at, LIMITS, FULL_M_S), "operator") < 0.6e-3
    judged = judge(recorded(bells(), there_ms, back_ms), pose_at, LIMITS, FULL_M_S)
    assert len(judged["displacement_m"]) > 300
    assert all(judged["within_reach"])
    # Poses are 10 ms apart, and speeds between them are interpolated: hence the error.
    assert greatest_m(judged, "operator") < 0.15e-3
    assert greatest_m(judged, "speed at the end") < 2e-3
    loop_s = 1e-3 * (there_ms + back_ms)
    assert loop_s - 1e-9 <= min(judged["loop_age_s"]) <= max(judged["loop_age_s"]) <= loop_s + 0.005
    if loop_s >= 0.4:
        assert greatest_m(judged, "robot") > 0.02


def test_a_constant_speed_is_speed_times_the_delay_and_a_quantile_of_it_too_far() -> None:
    record = recorded(np.full(1500, 0.8), 100, 100, quantile_s=0.25)
    judged, at, speed_m_s = judge(record, pose_at, LIMITS, FULL_M_S), moments(record), 0.8 * FULL_M_S
    np.testing.assert_allclose(at.arrives_s - at.reported_s, 0.2, atol=1e-9)
    np.testing.assert_allclose(judged["displacement_m"], speed_m_s * 0.2, atol=1e-9)
    np.testing.assert_allclose(judged["robot"], speed_m_s * (0.2 - 0.25), atol=1e-9)


def made_up(errors_mm: list[float], age_s: float = 0.4, link: str = "") -> dict[str, Any]:
    errors_m, count = 1e-3 * np.array(errors_mm), len(errors_mm)
    row = {"pull": "bell", "link": link, "seed": 3, "loop_age_s": [age_s] * count}
    row |= {"within_reach": [False] + [True] * (count - 1), "way_m": [0.0] * count}
    return row | {"operator": errors_m.tolist(), "robot": (10.0 * errors_m).tolist()}


def test_spreads_pool_the_moments_within_reach_by_the_loop_age_of_their_link() -> None:
    judged = Table([made_up([100.0, 1.0, -3.0, math.nan, 2.0]), made_up([150.0, 5.0], age_s=0.8)])
    found = over(judged, "operator", (0.28, 0.58))
    assert (found.moments, found.loop_age_ms, found.max_mm) == (3, 400.0, 3.0)
    assert found.mean_mm == pytest.approx(0.0)
    assert found.sd_mm == pytest.approx(math.sqrt(14.0 / 3.0))
    assert over(judged, "robot", within_reach=False).mean_mm == pytest.approx(1250.0)
    assert over(judged, "operator", (0.0, 0.02)).moments == 0
    short_by_chance = made_up([100.0, 1.0, 3.0]) | {"loop_age_s": [0.4, 0.01, 0.4]}
    assert over(Table([short_by_chance]), "operator", (0.28, 0.58)).moments == 2
    # Both directions, less the gain of the fastest messages, and the command's period: each link has a bin.
    for loop_s, (low_s, high_s) in zip((0.004, 0.044, 0.084, 0.184, 0.384, 0.784), AGE_BINS_S, strict=True):
        assert low_s <= loop_s < high_s


def test_the_robot_side_reads_the_table(tmp_path: Path) -> None:
    judged = Table([made_up([100.0, 1.0, 3.0]), made_up([200.0, 5.0], age_s=0.8, link="delay 400ms")])
    path = tmp_path / "table.toml"
    path.write_text(error_table(judged, "f1a9", "abc123", FULL_M_S), encoding="utf-8")
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    known = {"arm": "f1a9", "frozen": "abc123", "full_speed_m_s": FULL_M_S, "pulls": ["bell"], "seeds": [3]}
    assert {key: table[key] for key in known} == known
    assert table["links"] == ["", "delay 400ms"]
    assert table["operator"][0] == {"loop_age_ms": 400.0, "mu_mm": 2.0, "sigma_mm": 1.0, "p99_mm": 2.98, "n": 2}
    assert all([row["loop_age_ms"] for row in table[kind]] == [400.0, 800.0] for kind in COMPENSATIONS)
    found = load_prediction_errors(path)
    assert found.arm == "f1a9"
    assert found.at("operator", 0.4, FULL_M_S) == pytest.approx((0.002, 0.001))
    assert found.at("robot", 0.8, FULL_M_S) == pytest.approx((0.05, 0.0))
    # Between two loop ages, interpolated.
    assert found.at("operator", 0.6, FULL_M_S) == pytest.approx((0.0035, 0.0005))


# The question


@pytest.mark.long
def test_the_question_is_answered_whole_and_the_same_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "QUICK_DELAYS_MS", (200,))
    monkeypatch.setattr(module, "QUICK_PULLS", ("bell",))
    tables = [tmp_path / "one.toml", tmp_path / "two.toml"]
    picture = tmp_path / "out.png"
    arguments = ["--quick", "--seeds", "1", "--workers", "1"]
    assert ask(QUESTION, [*arguments, "--table", str(tables[0]), "--picture", str(picture)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "own commands under way" in shown
    assert picture.read_bytes().startswith(b"\x89PNG")
    [own], [eq_8] = (load_prediction_errors(tables[0]).rows[kind] for kind in ("operator", "robot"))
    assert own[2] < 0.002 < 0.15 * eq_8[2]
    assert tomllib.loads(tables[0].read_text())["arm"] == load_scene().robot.fingerprint
    assert ask(QUESTION, [*arguments, "--table", str(tables[1])]) == 0
    assert tables[1].read_text() == tables[0].read_text()
