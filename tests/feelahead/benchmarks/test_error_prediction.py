"""Predictions are compared with the right piece of the way, on approaches whose every moment is known."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.arrays import FloatArray
from feelahead.benchmarks.error.figures import prediction_figures
from feelahead.benchmarks.error.prediction import COMPENSATIONS, VARIANTS, Judged, judge, moments
from feelahead.benchmarks.error.spread import (
    LOOP_AGE_EDGES_S,
    age_bins,
    by_compensation,
    error_table,
    over,
    spread,
)
from feelahead.benchmarks.error.tables import cell, prediction_tables
from feelahead.benchmarks.error.tool_path import ToolPath
from feelahead.lab.approaches.recording import RecordedApproach
from robot_side.arm.port import GripperPose
from robot_side.enlargement.prediction_errors import load_prediction_errors
from robot_side.simulation.joint_reference import MotionLimits

FULL_M_S = 0.25
LIMITS = MotionLimits()
TICK_S = 0.001
BEGAN_S = 2.0
END_S = 6.0


def pose_at(joints: FloatArray) -> GripperPose:
    """An arm of one joint that slides along x, its approach axis."""
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
    """An arm that follows to the letter over a steady link: `travels`, one every 4 ms from 0 s on, times full speed.

    Its speed changes by at most 8 m/s², in whole steps of a millisecond.
    """
    ticks = np.round(np.arange(0.0, END_S, TICK_S), 3)
    sent_s = np.round(0.004 * np.arange(len(travels)), 3)
    # A command sent at s is followed from s + there_ms on; a speed changes in the milliseconds after that.
    newest = (np.arange(len(ticks)) - there_ms) // 4
    followed = np.where(newest >= 0, sent_s[np.clip(newest, 0, None)], np.nan)
    way_m, speed, ways_m, speeds = 0.0, 0.0, [], []
    for index in newest:
        ways_m.append(way_m)
        speeds.append(speed)
        target = FULL_M_S * travels[index] if index >= 0 else 0.0
        most = LIMITS.acceleration_rad_s2 * TICK_S
        after = speed + min(max(target - speed, -most), most)
        way_m += 0.5 * (speed + after) * TICK_S
        speed = after
    poses = slice(0, None, 10)
    count = len(ticks[poses])
    return RecordedApproach(
        pull="bell",
        link="",
        seed=0,
        began_s=BEGAN_S,
        pose_time_s=ticks[poses],
        joint_positions_rad=np.array(ways_m)[poses, None],
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
    )


def bells() -> FloatArray:
    time_s = 0.004 * np.arange(round(END_S / 0.004))
    return np.where(time_s < BEGAN_S, 0.0, 0.5 - 0.5 * np.cos(2.0 * math.pi * (time_s - BEGAN_S)))


@pytest.mark.parametrize(("there_ms", "back_ms"), [(0, 0), (20, 100), (200, 200), (400, 400)])
def test_who_knows_the_commands_knows_where_an_obedient_arm_will_be(there_ms: int, back_ms: int) -> None:
    judged = judge(recorded(bells(), there_ms, back_ms), pose_at, LIMITS, FULL_M_S)
    assert len(judged.way_m) > 300
    assert judged.within_reach.all()
    # Poses are 10 ms apart, and speeds between them are interpolated: by so much they are off.
    assert np.abs(judged.errors_m["operator"]).max() < 0.15e-3
    assert np.abs(judged.speed_errors_m_s).max() < 2e-3
    loop_s = 1e-3 * (there_ms + back_ms)
    assert loop_s - 1e-9 <= judged.loop_age_s.min()
    assert judged.loop_age_s.max() <= loop_s + 0.005
    if loop_s >= 0.4:
        assert np.abs(judged.errors_m["momentary"]).max() > 0.02
        assert np.abs(judged.errors_m["robot"]).max() > 0.02


def test_a_constant_speed_is_speed_times_the_delay_and_a_quantile_of_it_too_far() -> None:
    record = recorded(np.full(1500, 0.8), 100, 100, quantile_s=0.25)
    judged = judge(record, pose_at, LIMITS, FULL_M_S)
    at = moments(record)
    speed_m_s = 0.8 * FULL_M_S
    np.testing.assert_allclose(judged.way_m, speed_m_s * (at.arrives_s - at.reported_s), atol=1e-9)
    np.testing.assert_allclose(at.arrives_s - at.reported_s, 0.2, atol=1e-9)
    np.testing.assert_allclose(judged.errors_m["robot"], speed_m_s * (0.2 - 0.25), atol=1e-9)
    # The age of the newest command that the report knew of has up to a period in it for which it was held.
    np.testing.assert_allclose(judged.errors_m["momentary"], -speed_m_s * at.echo_held_s, atol=1e-9)
    assert set(np.round(1e3 * at.echo_held_s).astype(int)) <= {0, 1, 2, 3}


def test_the_acceleration_that_is_taken_matters_when_the_hand_lets_go() -> None:
    travels = np.where(np.arange(1500) * 0.004 < 4.0, 1.0, 0.0)
    judged = judge(recorded(travels, 200, 200), pose_at, LIMITS, FULL_M_S)
    greatest_mm = {name: 1e3 * np.abs(judged.by_variant_m[name]).max() for name in VARIANTS}
    assert greatest_mm["as reported"] == pytest.approx(greatest_mm["a of home"], abs=1e-9)
    assert greatest_mm["as reported"] < 0.6
    assert greatest_mm["a infinite"] == pytest.approx(1e3 * FULL_M_S**2 / (2.0 * 8.0), abs=0.6)
    assert greatest_mm["a 2 m/s²"] == pytest.approx(1e3 * FULL_M_S**2 / 2.0 * (1.0 / 2.0 - 1.0 / 8.0), abs=0.6)
    # Full travel gives the set speed in every pose of this arm.
    np.testing.assert_array_equal(judged.by_variant_m["v_max as set"], judged.by_variant_m["as reported"])


def test_moments_are_those_that_can_be_compared() -> None:
    record = recorded(bells(), 200, 100)
    at = moments(record)
    # Every 10 ms, the newest command of each; the last ones have not arrived within the record.
    assert len(at) == pytest.approx((END_S - BEGAN_S - 0.2) / 0.01, abs=2)
    assert at.now_s[0] == BEGAN_S
    assert (at.now_s % 0.004 < 1e-6).sum() + (at.now_s % 0.004 > 0.004 - 1e-6).sum() == len(at)
    np.testing.assert_allclose(at.reported_s, at.now_s - 0.1)
    np.testing.assert_allclose(at.arrives_s, at.now_s + 0.2)
    assert (at.arrives_s <= record.pose_time_s[-1]).all()

    deaf = replace(record, seen_sent_s=np.full_like(record.seen_sent_s, np.nan))
    assert len(moments(deaf)) == 0
    assert len(judge(deaf, pose_at, LIMITS, FULL_M_S).way_m) == 0
    gap = record.applied_sent_s.copy()
    gap[(record.tick_time_s > 3.0) & (record.tick_time_s < 3.5)] = np.nan
    without = moments(replace(record, applied_sent_s=gap))
    assert len(at) - len(without) == pytest.approx(50, abs=2)
    assert len(moments(replace(record, command_time_s=np.empty(0), command=np.empty(0)))) == 0


def test_an_arm_that_cannot_give_full_speed_is_at_the_edge_of_its_reach() -> None:
    record = recorded(bells(), 100, 100)
    slow = judge(record, pose_at, MotionLimits(velocity_rad_s=0.2), FULL_M_S)
    assert not slow.within_reach.any()

    def far(joints: FloatArray) -> GripperPose:
        pose = pose_at(joints)
        return replace(pose, tool_jacobian=pose.tool_jacobian * (1.0 if joints[0] < 0.2 else 0.05))

    path = ToolPath(record, far, LIMITS, FULL_M_S)
    crossed_s = float(np.interp(0.2, record.joint_positions_rad[:, 0], record.pose_time_s))
    from_s = np.array([crossed_s - 1.0, crossed_s - 0.2, crossed_s + 0.2])
    assert path.within_reach(from_s, from_s + 0.3).tolist() == [True, False, False]


def test_the_way_is_taken_along_the_axis_at_its_beginning() -> None:
    record = recorded(np.full(1500, 1.0), 0, 0)

    def oblique(joints: FloatArray) -> GripperPose:
        pose = pose_at(joints)
        turned = np.array([[1.0, 0.0, 0.6], [0.0, 1.0, 0.8], [0.0, 0.0, 0.0]])
        return replace(pose, tool_rotation=turned)

    path = ToolPath(record, oblique, LIMITS, FULL_M_S)
    way_m = path.ways_m(np.array([3.0]), np.array([3.4]))
    assert way_m[0] == pytest.approx(0.6 * 0.4 * FULL_M_S)
    assert path.speeds_m_s(np.array([3.0]))[0] == pytest.approx(0.6 * FULL_M_S)


def made_up(errors_mm: list[float], age_s: float = 0.4, link: str = "") -> Judged:
    errors_m = 1e-3 * np.array(errors_mm)
    return Judged(
        pull="bell",
        link=link,
        seed=3,
        loop_age_s=np.full(len(errors_mm), age_s),
        way_m=np.zeros(len(errors_mm)),
        within_reach=np.arange(len(errors_mm)) > 0,
        errors_m={"operator": errors_m, "robot": 10.0 * errors_m, "momentary": -errors_m},
        by_variant_m=dict.fromkeys(VARIANTS, errors_m),
        speed_errors_m_s=np.zeros(len(errors_mm)),
    )


def test_spreads_have_the_mean_the_deviation_and_the_largest_magnitudes() -> None:
    found = spread(np.array([0.001, -0.003, np.nan, 0.002]), np.array([0.1, 0.2, 9.0, 0.3]))
    assert found.count == 3
    assert (found.loop_age_ms, found.mean_mm, found.max_mm) == pytest.approx((200.0, 0.0, 3.0))
    assert (found.sd_mm, found.p99_mm) == pytest.approx((math.sqrt(14.0 / 3.0), 2.98))
    assert cell(found) == "+0.00  2.16  2.98  3.00"
    nothing = spread(np.array([np.nan]), np.array([1.0]))
    assert nothing.count == 0
    assert math.isnan(nothing.mean_mm)
    assert cell(nothing) == "-"


def test_moments_at_the_edge_of_reach_are_counted_apart() -> None:
    judged = [made_up([100.0, 1.0, 3.0]), made_up([200.0, 5.0], age_s=0.8)]
    assert over(judged, by_compensation("operator")).mean_mm == pytest.approx(3.0)
    assert over(judged, by_compensation("robot"), within_reach=False).mean_mm == pytest.approx(1500.0)
    assert over(judged, by_compensation("operator"), ages_s=(0.5, 1.0)).count == 1
    assert over(judged, by_compensation("operator"), pull="yaw").count == 0


def test_every_moment_counts_to_the_loop_age_of_its_link() -> None:
    one = made_up([100.0, 1.0, 3.0])
    short_by_chance = replace(one, loop_age_s=np.array([0.4, 0.01, 0.4]))
    assert over([short_by_chance], by_compensation("operator"), ages_s=(0.28, 0.58)).count == 2
    assert over([short_by_chance], by_compensation("operator"), ages_s=(0.0, 0.02)).count == 0
    # Two ways, less what the fastest of many messages gain, and the command's period.
    rows = [np.searchsorted(LOOP_AGE_EDGES_S, loop_s) for loop_s in (0.004, 0.044, 0.084, 0.184, 0.384, 0.784)]
    assert rows == list(range(1, len(LOOP_AGE_EDGES_S)))


def test_the_table_is_toml_with_units_and_a_row_for_each_loop_age_and_compensation() -> None:
    judged = [made_up([100.0, 1.0, 3.0]), made_up([200.0, 5.0], age_s=0.8, link="delay 400ms")]
    table = tomllib.loads(error_table(judged, "f1a9", "abc123", FULL_M_S))
    assert table["arm"] == "f1a9"
    assert table["frozen"] == "abc123"
    assert table["full_speed_m_s"] == FULL_M_S
    assert table["pulls"] == ["bell"]
    assert table["links"] == ["", "delay 400ms"]
    assert table["seeds"] == [3]
    for kind in COMPENSATIONS:
        assert [row["loop_age_ms"] for row in table[kind]] == [400.0, 800.0]
        assert {"loop_age_ms", "mu_mm", "sigma_mm", "p99_mm", "n"} == set(table[kind][0])
    assert table["operator"][0] == {"loop_age_ms": 400.0, "mu_mm": 2.0, "sigma_mm": 1.0, "p99_mm": 2.98, "n": 2}
    assert table["robot"][1]["mu_mm"] == 50.0
    assert len(list(age_bins())) == len(LOOP_AGE_EDGES_S) - 1


def test_the_robot_side_takes_from_the_table_what_is_in_it(tmp_path: Path) -> None:
    judged = [made_up([100.0, 1.0, 3.0]), made_up([200.0, 5.0], age_s=0.8, link="delay 400ms")]
    path = tmp_path / "table.toml"
    path.write_text(error_table(judged, "f1a9", "abc123", FULL_M_S), encoding="utf-8")
    found = load_prediction_errors(path)
    assert found.arm == "f1a9"
    assert found.at("operator", 0.4, FULL_M_S) == pytest.approx((0.002, 0.001))
    assert found.at("robot", 0.8, FULL_M_S) == pytest.approx((0.05, 0.0))
    # Between two loop ages, what lies between.
    assert found.at("operator", 0.6, FULL_M_S) == pytest.approx((0.0035, 0.0005))


def test_tables_and_figures_have_every_kind() -> None:
    judged = [made_up([100.0, 1.0, 3.0]), made_up([200.0, 5.0], age_s=0.8)]
    overall, by_pull, edge, variants = prediction_tables(judged)
    assert [row[:2] for row in overall.rows] == [("400", "2"), ("800", "1")]
    assert by_pull.rows[0][1] == "bell"
    assert edge.rows[0][1] == "1"
    assert [row[0] for row in variants.rows] == list(VARIANTS)
    assert all(len(row) == len(table.columns) for table in (overall, by_pull, edge, variants) for row in table.rows)
    figures = list(prediction_figures(judged))
    assert {figure.case for figure in figures} == {"all", "bell", "edge of reach"}
    one = next(f for f in figures if (f.method, f.case, f.at, f.quantity) == ("robot", "all", "400 ms", "mean"))
    assert one.value == pytest.approx(20.0)
    assert one.unit == "mm"
