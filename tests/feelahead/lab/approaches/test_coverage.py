"""Last releases that avoid a contact, false alarms, and the figures of `bench coverage` that follow from both."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feelahead.lab.approaches.approach import Approach, PullRun
from feelahead.lab.approaches.evaluation import LINKS, Placement, Pulls, draws_needed, evaluate, interval
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.judging import (
    false_alarms,
    strength_before_release,
)
from feelahead.lab.approaches.laws import TriedLaw
from feelahead.lab.approaches.placements import first_touch_s, last_release_s
from feelahead.lab.approaches.pulls import PullKind, make_pull
from feelahead.lab.approaches.recording import RecordedApproach, record_approach
from feelahead.lab.approaches.replay import Replay, coasting_s
from feelahead.lab.approaches.strengths import Draw, Judged
from feelahead.lab.questions.coverage import QUESTION, CoverageSettings
from feelahead.lab.sweep import ask
from feelahead.lab.table import Row
from operator_side.people.port import FingerInput, Pulling
from robot_side.drivers.mujoco.camera import CameraError
from robot_side.drivers.mujoco.posed_scene import PosedScene
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.settings import EncoderSettings

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("coverage")]

SEED = 1
"""Seed that draws a steady pull of up to 0.24 m/s."""


@cache
def recorded(link: str = "", pull: PullKind = "steady") -> RecordedApproach:
    return record_approach(pull, link, SEED, duration_s=2.0)


def staged(
    scene_name: str, link: str = "", ahead_m: float = 0.0, pull: PullKind = "steady"
) -> tuple[Replay, PosedScene, Draw]:
    scene = load_scene(frozen_scene(scene_name), SITE)
    posed, replay = PosedScene(scene), Replay(recorded(link, pull), scene, EncoderSettings(), SEED)
    posed.set_pose(replay.record.joint_positions_rad[0], replay.record.finger_positions[0], ahead_m * replay.axis)
    errors_m = np.zeros((len(scene.objects), 3))
    return replay, posed, Draw(replay, posed.perceived(errors_m), 0.003)


@cache
def approaching(link: str = "0 ms", ahead_m: float = 0.0) -> tuple[Draw, float, float]:
    """Put a wall ahead; return the approach, the time of contact, and that of the last release that avoids it."""
    replay, posed, draw = staged("wall", LINKS[link], ahead_m)
    touch_s = first_touch_s(replay, posed, ahead_m * replay.axis)
    assert touch_s is not None
    last_s = last_release_s(replay, posed, ahead_m * replay.axis, touch_s)
    assert last_s is not None
    return draw, touch_s, last_s


# The last release


@given(st.floats(0.0, 0.3), st.floats(0.1, 1.0))
def test_an_arm_coasts_at_least_as_its_brakes_and_as_the_finger_alone_would(braking_s: float, travel: float) -> None:
    coasting = coasting_s(braking_s, travel)
    assert coasting >= 0.5 * braking_s - 1e-3
    assert coasting_s(0.0, travel) - 1e-3 <= coasting <= coasting_s(0.0, travel) + 0.5 * braking_s + 1e-3


def test_a_release_at_the_last_moment_leaves_a_gap_and_a_later_one_none() -> None:
    draw, touch_s, last_s = approaching()
    replay = draw.replay
    assert np.interp(touch_s, replay.record.pose_time_s, replay.along_m) == pytest.approx(0.320, abs=0.001)
    speed = replay.approach_speed_m_s[replay.record.pose_row(touch_s)]
    # 8 rad/s² of the fastest joint, and the finger's own return.
    assert 0.03 < touch_s - last_s < 0.04 + speed / 3.0
    # 30 mm from the start, a command that takes 200 ms must be released before it arrives.
    far, _, last_s = approaching("200 ms", -0.29)
    assert far.replay.record.began_s <= last_s < far.replay.record.began_s + 0.15


@pytest.mark.parametrize("speed_m_s", [-0.06, 0.05])
def test_moving_objects_are_touched_where_they_are_by_then(speed_m_s: float) -> None:
    replay, posed, draw = staged("wall", ahead_m=-0.1)
    shift_m = -0.1 * replay.axis
    still_s, touch_s = (first_touch_s(replay, posed, shift_m, speed) for speed in (0.0, speed_m_s))
    assert still_s is not None
    assert touch_s is not None
    assert (touch_s < still_s) is (speed_m_s < 0.0)
    since_s = touch_s - replay.record.began_s
    along_m = np.interp(touch_s, replay.record.pose_time_s, replay.along_m)
    assert along_m == pytest.approx(0.22 + speed_m_s * since_s, abs=0.001)
    then = replace(draw, speed_m_s=speed_m_s).objects_at(replay.record.began_s + 1.0)
    moved_m = then.box_centers_m - draw.objects_at(replay.record.began_s).box_centers_m
    np.testing.assert_allclose(moved_m, [speed_m_s * replay.axis], atol=0.034 * abs(speed_m_s))
    assert then.velocities_m_s is not None
    np.testing.assert_allclose(then.velocities_m_s, [speed_m_s * replay.axis])


# Covered, alarmed


def strength(law: TriedLaw, link: str = "0 ms", ahead_m: float = 0.0) -> int:
    draw, _, last_s = approaching(link, ahead_m)
    return strength_before_release(Judged(law, 0.99), draw, last_s)


@pytest.mark.parametrize(("link", "ahead_m"), [("0 ms", 0.0), ("200 ms", -0.15)])
def test_a_steady_pull_is_covered_by_either_compensation_and_not_by_the_plain_law(link: str, ahead_m: float) -> None:
    laws: tuple[TriedLaw, ...] = ("full", "swept", "swept_robot", "paper", "none")
    found = {law: strength(law, link=link, ahead_m=ahead_m) for law in laws}
    assert found["full"] == found["swept"] == found["swept_robot"] == 8
    assert max(found["paper"], found["none"]) < 8


def test_strength_without_cause_is_an_alarm_and_only_that() -> None:
    replay, posed, draw = staged("empty")
    began_s = replay.record.began_s
    full = false_alarms(Judged("full", 0.99), draw, posed, np.zeros(3), replay.end_s)
    assert full.number == 1
    assert full.alarm_s == pytest.approx(full.judged_s)
    assert full.judged_s == pytest.approx(replay.end_s - began_s, abs=0.1)
    none = false_alarms(Judged("none", 0.99), draw, posed, np.zeros(3), replay.end_s)
    assert (none.number, none.alarm_s) == (0, 0.0)
    # With a wall so near that any zone's stopping path meets it, nothing is a false alarm.
    replay, posed, draw = staged("wall", ahead_m=-0.30)
    near = false_alarms(Judged("full", 0.99), draw, posed, -0.30 * replay.axis, began_s + 0.1)
    assert near.number == 0


# The judged pipeline is the shipped one


@pytest.mark.parametrize("law", ["swept", "swept_robot", "paper"])
def test_over_a_whole_pull_it_is_what_both_sides_show_live(law: TriedLaw) -> None:
    link = LINKS["200 ms"]
    approach = Approach(frozen_scene("wall"), 0.0, strongest_n=0.0, link=link, law=law, seed=SEED, full_rate=True)
    run = PullRun(approach, Pulling(make_pull("steady", SEED)))
    began_s = run.arm()
    for _ in run.go_on(began_s + 2.0):
        pass
    assert run.onset is not None
    trace = run.trace()

    replay, posed, _ = staged("wall", link)
    # The camera's errors are those of the robot side with that seed, see `assemble`.
    _, camera_seed = np.random.SeedSequence(SEED).generate_state(2)
    names = tuple(thing.name for thing in posed.scene.objects)
    draw = Draw(replay, posed.perceived(CameraError(names, 0.0, 0.003, 0.0, int(camera_seed)).next_frame()), 0.003)
    strengths = Judged(law, 0.99).strengths(draw, began_s + trace.time_s)[:, 1]
    # Its poses are 10 ms apart and its encoders draw other errors, so it may be off for a moment.
    differs = strengths - trace.strengths
    assert np.count_nonzero(differs) < 0.04 * differs.size
    assert abs(differs.mean()) < 0.05
    assert trace.strengths.max() > 0


# Shares, cells, and the whole question


def test_intervals_are_over_approaches() -> None:
    assert [draws_needed(p) for p in (0.5, 0.9, 0.99, 0.999)] == [20, 100, 1000, 10000]
    assert interval([10, 10], [10, 10]) == (1.0, 1.0)
    # Two approaches are all the evidence, however many draws each has.
    assert interval([10, 0], [10, 10]) == (0.0, 1.0)
    assert interval([9], [10]) == (0.9, 0.9)
    low, high = interval([9, 10, 8, 10, 9, 7, 10, 9, 10, 10], [10] * 10)
    assert 0.8 < low < 0.92 < high < 1.0


def judged(laws: tuple[TriedLaw, ...], *scenes: str) -> list[Row]:
    placements = tuple(map(Placement, scenes))
    return list(evaluate(Pulls("bell", "200 ms", "empty", placements, (1, 2), (0.5,), laws, judged_s=12.0), 1))


def test_a_cell_has_what_it_takes_to_judge_it() -> None:
    rows = judged(("swept", "none", "full"), "wall", "wall_beside")
    wall = {row["law"]: row for row in rows if row["scene"] == "wall"}
    assert {(row["places"], row["unavoidable"], row["draws"]) for row in wall.values()} == {(2, 0, 20)}
    assert wall["full"]["coverage"] == wall["full"]["low"] == wall["swept"]["coverage"] == 1.0
    # One approach is too few to say so.
    assert wall["full"]["holds"] is False
    assert wall["none"]["coverage"] == wall["none"]["high"] == wall["none"]["alarms_per_min"] == 0.0
    assert wall["full"]["alarms_per_min"]
    beside = {row["law"]: row for row in rows if row["scene"] == "wall_beside"}
    assert beside["full"]["coverage"] is beside["full"]["holds"] is None
    assert beside["full"]["alarm_share"] > 0.5
    assert beside["swept"]["alarms_per_min"] == 0.0
    for row in (*wall.values(), *beside.values()):
        assert 12.0 <= row["judged_s"] < 17.0
        assert row["alarm_s"] == pytest.approx(row["alarm_share"] * row["judged_s"])


def test_strengths_on_the_other_trigger_show(monkeypatch: pytest.MonkeyPatch) -> None:
    strengths = Judged.strengths
    monkeypatch.setattr(Judged, "strengths", lambda *asked: strengths(*asked)[:, ::-1])
    assert [row["coverage"] for row in judged(("swept",), "wall")] == [0.0]


def test_placements_whose_stick_moves_after_judgement_are_counted_apart() -> None:
    (row,) = evaluate(
        Pulls("drift", "200 ms", "empty", (Placement("rod_5mm"),), (1, 8), (0.5,), ("full",), judged_s=1.0), 0
    )
    assert (row["places"], row["unavoidable"], row["unknowable"], row["coverage"]) == (8, 0, 1, 1.0)
    # The same number of draws in each other placement, 20 or more in all.
    assert row["draws"] == 3 * 7


@pytest.mark.parametrize("link", ["0 ms", "200 ms"])
@pytest.mark.parametrize("around_s", [-0.02, 0.02])
def test_full_physics_does_as_reckoned_around_the_last_moment(link: str, around_s: float) -> None:
    draw, touch_s, last_s = approaching(link)
    wall, delays = frozen_scene("wall"), LINKS[link]
    approach = Approach(wall, 0.0, strongest_n=0.0, link=delays, law="none", seed=SEED, full_rate=True)
    began_s, pulls = draw.replay.record.began_s, make_pull("steady", SEED)
    pull = Pulling(lambda since_s: FingerInput() if began_s + since_s >= last_s + around_s else pulls(since_s))
    run = PullRun(approach, pull)
    assert run.arm() == began_s
    for _ in run.go_on(touch_s + 1.0):
        pass
    assert (run.onset is not None) is (around_s > 0.0)


def test_the_question_is_answered_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("feelahead.lab.questions.coverage.QUICK_SIZES", (1, 2))
    flags = ["--quick", "--workers", "1", "--laws", "swept", "none", "--only", "wall/bell", "--probabilities", "0.5"]
    table, picture = tmp_path / "out.csv", tmp_path / "out.png"
    assert ask(QUESTION, [*flags, "--csv", str(table), "--picture", str(picture)]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "covered: full strength stood in time" in shown
    assert "| bell | 200 ms |" in shown
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert len(table.read_text().splitlines()) == 1 + 2


def test_each_cell_by_depth_is_a_piece_of_work_of_its_own_and_is_judged_for_a_minute() -> None:
    settings = CoverageSettings(quick=True, perception="depth", only=("both, noise x2", "wrist, noise x2"))
    pulls = settings.pulls()
    assert {len(one.cells) for one in pulls} == {1}
    assert {one.judged_s for one in pulls} == {60.0}
    names = [cell.key(one.pull, one.link) for one in pulls for cell in one.cells]
    assert len({*names}) == len(names) == 18
    shared = CoverageSettings(quick=True).pulls()
    assert max(len(one.cells) for one in shared) > 1
