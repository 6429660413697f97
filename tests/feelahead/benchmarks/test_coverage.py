"""When a release still avoids a contact, what a false alarm is, and what the benchmark makes of them."""

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.reaction import HORIZON_S
from feelahead.benchmarks.coverage import bench, closed_loop
from feelahead.benchmarks.coverage.cells import LINKS, Cell, Motion, Plan, full_plan, quick_plan
from feelahead.benchmarks.coverage.closed_loop import check
from feelahead.benchmarks.coverage.collisions import first_touch_s, last_release_s
from feelahead.benchmarks.coverage.covered import (
    false_alarms,
    statistical_distance_m,
    stopping_path_m,
    zone_speed_m_s,
)
from feelahead.benchmarks.coverage.evaluate import Row, evaluate
from feelahead.benchmarks.coverage.intervals import draws_needed, share
from feelahead.benchmarks.coverage.laws import make_law
from feelahead.benchmarks.coverage.replay import coasting_s
from feelahead.benchmarks.coverage.settings import CoverageSettings
from feelahead.benchmarks.coverage.work import pieces
from feelahead.lab.approaches.frozen import AHEAD, ASIDE, PASSED
from feelahead.lab.approaches.laws import Law
from feelahead.lab.approaches.spoilt import Spoil
from operator_side.dualsense.simulated.trigger_model import zone_of
from tests.feelahead.benchmarks.recorded_pulls import SEED, staged

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("coverage")]


@given(st.floats(0.0, 0.3), st.floats(0.1, 1.0))
def test_an_arm_coasts_at_least_as_its_brakes_and_as_the_finger_alone_would(braking_s: float, travel: float) -> None:
    coasting = coasting_s(braking_s, travel)
    assert coasting >= 0.5 * braking_s - 1e-3
    assert coasting >= coasting_s(0.0, travel) - 1e-3
    assert coasting <= coasting_s(0.0, travel) + 0.5 * braking_s + 1e-3


def test_a_light_pull_comes_back_to_the_dead_zone_sooner() -> None:
    assert coasting_s(0.0, 0.1) < coasting_s(0.0, 0.3) < coasting_s(0.0, 0.7) < 0.04


def test_draws_and_intervals() -> None:
    assert [draws_needed(p) for p in (0.5, 0.9, 0.99, 0.999)] == [20, 100, 1000, 10000]
    whole = share([10, 10], [10, 10])
    assert whole is not None
    assert (whole.value, whole.low, whole.high, whole.draws, whole.approaches) == (1.0, 1.0, 1.0, 20, 2)
    # Two approaches that agree prove nothing.
    assert not whole.holds(0.5)
    half = share([10, 0], [10, 10])
    assert half is not None
    # All that speaks for an interval is two approaches, however many draws each has.
    assert (half.value, half.low, half.high) == (0.5, 0.0, 1.0)
    assert not half.holds(0.5)
    assert share([0, 0], [0, 0]) is None
    nine = share([9] * 40, [10] * 40)
    assert nine is not None
    assert nine.holds(0.9)
    assert not nine.holds(0.99)


def test_zones_and_their_speeds() -> None:
    assert [zone_of(travel) for travel in (0.0, 0.0999, 0.1, 0.55, 1.0)] == [0, 0, 1, 5, 9]
    speeds = [zone_speed_m_s(zone) for zone in range(10)]
    assert speeds == sorted(speeds)
    # The sensor ends at three quarters of the travel.
    assert speeds[7] == speeds[9] == pytest.approx(0.25)
    assert speeds[0] == pytest.approx(0.25 * (0.05 / 0.75 - 0.05) / 0.93)


def test_a_release_at_the_last_moment_leaves_a_gap_and_a_later_one_none() -> None:
    replay, posed, _ = staged("wall")
    touch_s = first_touch_s(replay, posed, np.zeros(3))
    assert touch_s is not None
    axis_m = np.interp(touch_s, replay.record.pose_time_s, replay.along_m)
    assert axis_m == pytest.approx(0.320, abs=0.001)
    last_s = last_release_s(replay, posed, np.zeros(3), touch_s)
    assert last_s is not None
    speed = replay.approach_speed_m_s[replay.record.pose_row(touch_s)]
    # 8 rad/s² of the fastest joint, and the finger's own return.
    assert 0.03 < touch_s - last_s < 0.04 + speed / 3.0
    assert first_touch_s(replay, posed, 1.0 * replay.axis) is None


def test_whoever_lets_go_at_once_always_avoids_it() -> None:
    shift_m = -0.29 * staged("wall")[0].axis
    replay, posed, _ = staged("wall", LINKS["200 ms"], ahead_m=-0.29)
    touch_s = first_touch_s(replay, posed, shift_m)
    assert touch_s is not None
    last_s = last_release_s(replay, posed, shift_m, touch_s)
    assert last_s is not None
    # 30 mm from the start, a command that takes 200 ms has to be taken back before it arrives.
    assert replay.record.began_s <= last_s < replay.record.began_s + 0.15


@pytest.mark.parametrize("speed_m_s", [-0.06, 0.05])
def test_what_moves_is_touched_where_it_is_by_then(speed_m_s: float) -> None:
    replay, posed, draw = staged("wall", ahead_m=-0.1)
    shift_m = -0.1 * replay.axis
    still_s, touch_s = (first_touch_s(replay, posed, shift_m, speed) for speed in (0.0, speed_m_s))
    assert still_s is not None
    assert touch_s is not None
    assert (touch_s < still_s) is (speed_m_s < 0.0)
    since_s = touch_s - replay.record.began_s
    along_m = np.interp(touch_s, replay.record.pose_time_s, replay.along_m)
    assert along_m == pytest.approx(0.22 + speed_m_s * since_s, abs=0.001)
    last_s = last_release_s(replay, posed, shift_m, touch_s, speed_m_s)
    assert last_s is not None
    # Whoever lets go must stand before it is there.
    assert (touch_s - last_s > still_s - (last_release_s(replay, posed, shift_m, still_s) or 0.0)) is (speed_m_s < 0.0)
    moving = replace(draw, speed_m_s=speed_m_s)
    then = moving.objects_at(replay.record.began_s + 1.0)
    np.testing.assert_allclose(
        then.box_centers_m - draw.objects.box_centers_m, [speed_m_s * replay.axis], atol=0.034 * abs(speed_m_s)
    )
    assert then.velocities_m_s is not None
    np.testing.assert_allclose(then.velocities_m_s, [speed_m_s * replay.axis])
    assert draw.objects_at(replay.record.began_s + 1.0) is draw.objects


def test_strength_without_cause_is_an_alarm_and_only_that() -> None:
    replay, posed, draw = staged("empty")
    began_s = replay.record.began_s
    full = false_alarms(make_law("full", 0.99), draw, posed, np.zeros(3), replay.end_s, 0.99)
    assert full.count == 1
    assert full.alarm_s == pytest.approx(full.judged_s)
    assert full.judged_s == pytest.approx(replay.end_s - began_s, abs=0.1)
    none = false_alarms(make_law("none", 0.99), draw, posed, np.zeros(3), replay.end_s, 0.99)
    assert (none.count, none.alarm_s) == (0, 0.0)
    # With a wall so near that any zone's stopping path meets it, nothing is a false alarm.
    replay, posed, draw = staged("wall", ahead_m=-0.30)
    near = false_alarms(make_law("full", 0.99), draw, posed, -0.30 * replay.axis, began_s + 0.1, 0.99)
    assert near.count == 0


def test_a_stopping_path_is_what_is_under_way_the_horizon_and_the_braking() -> None:
    replay, _, draw = staged("wall", LINKS["200 ms"])
    time_s = replay.record.began_s + 1.0
    speed = zone_speed_m_s(5)
    path_m = stopping_path_m(replay, time_s, 5)
    assert path_m - replay.under_way_m(time_s) - speed * HORIZON_S == pytest.approx(
        speed**2 / (2.0 * replay.deceleration_m_s2(time_s))
    )
    # A command takes 200 ms to the arm, which goes at 0.24 m/s meanwhile.
    assert replay.under_way_m(time_s) == pytest.approx(0.2 * 0.24, abs=0.006)
    assert statistical_distance_m(draw, time_s, 0.5) == pytest.approx(0.0, abs=1e-9)
    assert statistical_distance_m(draw, time_s, 0.99) == pytest.approx(2.326 * 0.003, rel=0.02)


TINY = Plan((), approaches=1, places=2, probabilities=(0.5,), laws=("swept", "none", "full"), checked=1, raced=1)


@cache
def judged(spoil: Spoil = "nothing") -> Sequence[Row]:
    motion = Motion("bell", "200 ms")
    both = [Cell(motion, "wall"), Cell(motion, "wall_beside")]
    return [row for rows in evaluate(motion, both, TINY, 1, spoil) for row in rows]


def test_a_cell_has_what_it_takes_to_judge_it() -> None:
    wall = {row.law: row for row in judged() if row.scene == "wall"}
    assert {(row.places, row.unavoidable, row.draws) for row in wall.values()} == {(2, 0, 20)}
    assert wall["full"].coverage == wall["full"].low == 1.0
    # One approach is too few to say so.
    assert not wall["full"].holds
    assert wall["swept"].coverage == wall["full"].coverage
    assert wall["none"].coverage == wall["none"].high == 0.0
    assert not wall["none"].holds
    assert wall["full"].alarms_per_min
    assert wall["none"].alarms_per_min == 0.0
    beside = {row.law: row for row in judged() if row.scene == "wall_beside"}
    assert beside["full"].coverage is None
    assert beside["full"].alarm_share is not None
    assert beside["full"].alarm_share > 0.5
    assert beside["swept"].alarms_per_min == 0.0


def test_a_drift_counts_as_reported_once_a_report_of_it_is_back() -> None:
    drifting = staged("wall", LINKS["50 ms"], pull="drift")[0]
    times = drifting.record.began_s + np.arange(0.0, 0.8, 0.01)
    known = np.array([drifting.knows_aside(float(time_s)) for time_s in times])
    # There and back, with jitter, and 30 ms to look from all places; and the arm has to start.
    assert 0.1 < times[int(np.argmax(known))] - drifting.record.began_s < 0.3
    assert known[int(np.argmax(known)) :].all()
    steady = staged("wall")[0]
    assert steady.knows_aside(steady.record.began_s)


def test_the_same_seed_gives_the_same_rows_and_a_spoilt_law_others() -> None:
    again = judged.__wrapped__()
    assert again == judged()
    spoilt = {row.law: row for row in judged("swapped") if row.scene == "wall"}
    whole = {row.law: row for row in judged() if row.scene == "wall"}
    assert (spoilt["swept"].coverage, spoilt["swept"].mean_strength) == (0.0, 0.0)
    assert whole["swept"].mean_strength is not None
    assert whole["swept"].mean_strength > 6.0


def test_physics_does_as_reckoned() -> None:
    checks = list(check(0, 3, 0))
    assert [one.kind_of_check for one in checks] == ["released early", "released late", "reacting"]
    assert all(one.contact == one.expected_contact for one in checks[:2])


def test_checks_see_every_scene_link_and_pull(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[Cell, str, int]] = []

    def remember(cell: Cell, kind: str, seed: int) -> tuple[()]:
        seen.append((cell, kind, seed))
        return ()

    monkeypatch.setattr(closed_loop, "_check_one", remember)
    assert list(closed_loop.check(0, 300, 0)) == []
    assert len({seed for _, _, seed in seen}) == 300
    for kind in ("released early", "released late", "reacting"):
        some = [cell for cell, how, _ in seen if how == kind]
        assert len({cell.scene for cell in some}) == 5
        assert len({cell.motion.link for cell in some}) == 4
        assert len({cell.motion.pull for cell in some}) == 6


def test_the_plans() -> None:
    full = full_plan(("swept",))
    names = {cell.scene for cell in full.cells}
    assert names == {*AHEAD, *ASIDE, *PASSED} - {"moving", "fleeing", "place_held", "terrain_ahead"}
    assert {cell.speed_m_s for cell in full.cells} == {0.0, -0.06, 0.03}
    assert {cell.motion.link for cell in full.cells} == set(LINKS)
    assert {cell.camera_mm for cell in full.cells} == {1.0, 3.0, 6.0}
    assert len({cell.key for cell in full.cells}) == len(full.cells)
    assert full.checked == 300
    assert {cell.key for cell in quick_plan(("swept",)).cells} <= {cell.key for cell in full.cells}
    names_of_pieces = [piece.name for piece in pieces(full, 0, "nothing")]
    assert len(set(names_of_pieces)) == len(names_of_pieces)


@pytest.mark.parametrize(
    ("flags", "named"),
    [
        ({"seed": -1}, "--seed"),
        ({"workers": 0}, "--workers"),
        ({"laws": ()}, "--laws"),
        ({"probabilities": (0.9, 1.0)}, "--probabilities"),
        ({"checked": -1}, "--checked"),
        ({"raced": -1}, "--raced"),
        ({"laws": ("swept", "swept")}, "--laws"),
        ({"only": ("no such cell",)}, "--only"),
        ({"csv": Path("/no/such/folder/file.csv")}, "--csv"),
        ({"picture": Path("picture.xyz")}, "--picture picture.xyz: .*.png"),
    ],
)
def test_bad_settings_are_named(flags: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        CoverageSettings(**flags)


def test_the_command_prints_its_tables_writes_its_files_and_resumes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    motion = Motion("steady", "0 ms")

    def tiny(laws: tuple[Law, ...]) -> Plan:
        return replace(TINY, cells=(Cell(motion, "wall"),), laws=laws, approaches=1, checked=1)

    monkeypatch.setattr("feelahead.benchmarks.coverage.settings.quick_plan", tiny)
    monkeypatch.setattr("feelahead.benchmarks.coverage.work.SCENES", ("empty",))
    arguments = ["--quick", "--workers", "1", "--laws", "swept", "none", "--seed", str(SEED)]
    files = [f"--csv={tmp_path / 'c.csv'}", f"--picture={tmp_path / 'c.png'}", f"--resume={tmp_path / 'r.jsonl'}"]
    assert bench.bench_coverage([*arguments, *files]) == 0
    first = capsys.readouterr().out
    assert "covered: full strength stood in time" in first
    assert "| steady | 0 ms |" in first
    assert "of 1 as reckoned" in first
    assert (tmp_path / "c.png").stat().st_size > 1000
    assert (tmp_path / "c.csv").read_text().startswith("cell,scene,pull,link")
    setup = json.loads((tmp_path / "r.jsonl").read_text().splitlines()[0])
    assert setup["seed"] == SEED
    monkeypatch.setattr("feelahead.benchmarks.coverage.work.evaluate", None)
    assert bench.bench_coverage([*arguments, *files]) == 0
    assert capsys.readouterr().out == first
