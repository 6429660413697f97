"""What a law leaves out, counted by hand in a few ticks."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from common.protocol.around import PROBES
from common.skipped import Part, shares
from robot_side.arm.limits import JointLimits
from robot_side.laws import looking
from robot_side.laws.gripper_motion import gripper_motion
from robot_side.laws.swept import SweptLaw
from robot_side.laws.vicinity import farthest_m
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import RADIUS_M, ball_pose
from tests.helpers.field.situations import inputs, moving, paper, situation, swept, walls
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import Scene

FAR_M = 20.0


def balls(*places_m: tuple[float, float, float]) -> PerceivedObjects:
    scene = Scene()
    for place_m in places_m:
        scene = scene.add().sphere(list(place_m), 0.02)
    return scene.objects()


def after(law: Any, ticks: int, objects: PerceivedObjects, step_s: float = 0.005, **changes: Any) -> dict[str, Part]:
    for tick in range(ticks):
        law.sense(situation(ball_pose(), objects, **changes), 7.0 + step_s * tick)
    found: dict[str, Part] = law.skipped()
    return found


AHEAD, BEHIND, BESIDE = (0.0, 0.0, 0.1), (0.0, 0.0, -0.1), (0.3, 0.0, 0.0)


@pytest.mark.parametrize(
    ("places_m", "entered"),
    [
        ([AHEAD, BEHIND, BESIDE], 2),  # R2 meets one, and L2 another.
        ([AHEAD, BESIDE, BESIDE], 1),
        ([BESIDE, (0.0, 0.0, FAR_M), (0.0, 0.0, -FAR_M)], 0),
        ([(0.0, 0.0, RADIUS_M), BESIDE, BESIDE], 2),  # What it overlaps it meets both ways, and once each.
    ],
)
def test_pairs_are_all_spheres_with_all_primitives_in_all_looks(places_m: list[Any], entered: int) -> None:
    # Looks along R2 and L2: one sphere with three primitives in each.
    assert after(swept(), 1, balls(*places_m))["pairs"] == Part(entered, 2 * 3)


def test_looks_at_rest_are_two_in_ten_ticks_and_along_a_stick_there_would_be_three_in_each() -> None:
    assert after(swept(), 21, walls(0.1))["looks"] == Part(3 * 2, 21 * 2)
    assert after(swept(), 4, walls(0.1), 0.004, lateral=(1.0, 0.0))["looks"] == Part(3, 4 * 3)


def test_looks_from_waypoints_and_probes_count_while_there_are_any() -> None:
    first = 2 + 2 * PROBES
    assert after(swept(maps=True), 3, walls(0.1), compensation="operator")["looks"] == Part(first, 3 * first)
    aside = moving(np.array([0.1, 0.0, 0.0]))
    law = swept()
    done, of = after(law, 1, walls(0.1), joint_velocities_rad_s=aside)["looks"]
    waypoints = sum(law.looking.sides[side].waypoints for side in (0, 1))
    assert done == of == 2 + waypoints
    assert waypoints > 4


def test_the_papers_law_looks_in_one_of_three_ticks_of_4_ms() -> None:
    assert after(paper(), 9, walls(0.1), 0.004) == {"looks": Part(3, 9)}


def test_of_what_has_no_whole_nothing_is_said() -> None:
    assert shares(looks=Part(1, 4), pairs=Part(0, 0)) == {"looks": {"done": 1, "of": 4, "skipped": 0.75}}


def brisk() -> SweptLaw:
    """Return a law of an arm that stands within a third of a second, with errors of its encoders."""
    return SweptLaw(replace(inputs(1e-3), limits=JointLimits(np.full(6, 1.0), np.full(6, 3.0))), maps=True)


def test_what_any_look_finds_is_nearer_than_the_farthest_that_counts_and_not_much(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rng, pose, shares_found = np.random.default_rng(5), free_pose([[0.0] * 3, [0.0, 0.0, 0.1]], [0.02] * 2), []
    monkeypatch.setattr(looking, "nothing_within", lambda *_: False)
    for _ in range(200):
        drift = rng.uniform(-1.0, 1.0, 6) * [0.4, 0.4, 0.4, 0.5, 0.5, 0.5]
        way = drift[:3] / np.linalg.norm(drift[:3]) + [0.0, 0.0, 1.0]
        away_m = rng.uniform(0.1, 1.2)
        objects = balls(tuple(away_m * way / np.linalg.norm(way)))
        for compensation in ("operator", "robot"):
            law, asked = brisk(), situation(pose, objects, joint_velocities_rad_s=drift, loop_age_s=0.2)
            asked = replace(asked, compensation=compensation)
            law.sense(asked, 0.0)
            told = law.around(pose)
            mapped = told is not None and min(one.min() for one in told.onsets_m(100.0)) < 100.0
            if mapped or any(side.found for side in law.looking.sides):
                motion = gripper_motion(pose, drift, None)
                farthest = farthest_m(asked, motion, law.assumed, law.looking.ahead.encoder_sigma_rad)
                shares_found.append((away_m - 0.02) / farthest)
    assert 0.45 < max(shares_found) <= 1.0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("compensation", ["operator", "robot"])
def test_looks_that_are_passed_over_as_nothing_is_near_change_nothing(
    monkeypatch: pytest.MonkeyPatch, compensation: str, seed: int
) -> None:
    """A gripper drifts, turns and closes; a ball comes near, and goes again, by frames without velocities."""

    def run() -> tuple[list[Any], Part]:
        law = brisk()
        rng, told = np.random.default_rng(seed), []
        drift, tool_m, objects = rng.uniform(-0.2, 0.2, 6), np.zeros(3), balls((9.0, 0.0, 0.0))
        for tick in range(150):
            if tick % 15 == 0:
                away_m = abs(tick - 75) / 75 * 3.0
                way = np.array([0.0, 0.0, 1.0]) + rng.normal(0.0, 0.2, 3)
                objects = balls(tuple(tool_m + (0.06 + away_m) * way / np.linalg.norm(way)))
            tool_m = tool_m + 0.008 * drift[:3]
            pose = free_pose([tool_m, tool_m + np.array([0.03, 0.0, 0.002 * (tick % 40)])], [0.02, 0.01])
            pose = replace(pose, tool_position_m=tool_m)
            moves = situation(pose, objects, joint_velocities_rad_s=drift, compensation=compensation, loop_age_s=0.1)
            sensed = law.sense(moves, 0.008 * tick)
            around = law.around(pose)
            told.append((sensed, None if around is None else [one.tolist() for one in around.onsets_m(100.0)]))
        return told, law.skipped()["looks"]

    passing, looks = run()
    monkeypatch.setattr(looking, "nothing_within", lambda *_: False)
    expected, all_looks = run()
    assert passing == expected
    assert any(sensed.r2.course_stiffness > 0.0 or min(sensed.r2.fast_m) < 0.1 for sensed, _ in passing)
    assert looks.of == all_looks.of
    assert looks.done < 0.9 * all_looks.done
