"""Map of onset distances around the gripper: distances from wherever sticks may take it, and when looks are made."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

from common.arrays import FloatArray
from common.protocol.around import PERIOD_S, PROBES
from common.reaction import HORIZON_S
from feelahead.lab.reference.onsets_by_definition import defined_onsets
from robot_side.arm.port import GripperPose
from robot_side.enlargement.prediction_errors import PredictionErrors
from robot_side.field.along import Along
from robot_side.field.object_class import OBSTACLE
from robot_side.laws.swept import SweptLaw
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.tick.sensed import R2
from tests.helpers.field.fields import ball_pose
from tests.helpers.field.situations import (
    ACCELERATION_M_S2,
    CAMERA_SD_M,
    FULL_SPEED_M_S,
    SIGMA_M,
    STICK_SPEED_M_S,
    situation,
    swept,
    walls,
)
from tests.helpers.perceived_scenes import Scene

LOOP_S = 0.2
FULL_S = LOOP_S + HORIZON_S + FULL_SPEED_M_S / ACCELERATION_M_S2
RIGHT, UP, LEFT, DOWN = (slice(1 + 5 * side, 4 + 5 * side) for side in range(4))
"""The three probes of each direction to which a stick moves the gripper across, without turning it"""
HALF, TURNED = [4, 9, 14, 19], [5, 10, 15, 20]
WALL = walls(0.1)


def asking(**changes: Any) -> SweptLaw:
    return swept(maps=True, **changes)


@pytest.fixture
def law() -> SweptLaw:
    return asking()


def around(law: SweptLaw, objects: PerceivedObjects, now_s: float = 0.0, **changes: Any) -> Any:
    asked = situation(ball_pose(), objects, loop_age_s=LOOP_S, **changes)
    law.sense(asked, now_s)
    return told_by(law, asked.pose)


class Told(NamedTuple):
    full_s: float
    r2_m: FloatArray
    r2_slow_m: FloatArray
    l2_m: FloatArray
    l2_slow_m: FloatArray


def told_by(law: SweptLaw, pose: GripperPose) -> Told | None:
    told = law.around(pose)
    return None if told is None else Told(told.full_s, *told.onsets_m(100.0))


def post(x_m: float, y_m: float, z_m: float = 0.06) -> PerceivedObjects:
    return Scene().add().box([x_m, y_m, z_m], [0.01, 0.01, 0.01]).objects()


def test_only_those_who_ask_get_a_map() -> None:
    assert around(swept(), walls(0.1)) is None


def test_a_wall_is_as_far_from_every_probe_across_and_nearer_or_farther_in_a_turn(law: SweptLaw) -> None:
    told = around(law, walls(0.08, 0.05))
    assert told.full_s == pytest.approx(FULL_S)
    for onsets_m, ahead_m in ((told.r2_m, 0.08), (told.l2_m, 0.05)):
        across = np.delete(np.array(onsets_m), [*HALF, *TURNED])
        np.testing.assert_allclose(across, ahead_m - SIGMA_M, atol=3e-3)
        # The look goes along the chord, aside by half of the turn, so the wall is farther by 1/cos. The distance is
        # that along the arc, which is longer than the chord.
        for probes, half in ((HALF, 0.125 * FULL_S), (TURNED, 0.25 * FULL_S)):
            farther = (ahead_m - SIGMA_M) / np.cos(half) * half / np.sin(half)
            np.testing.assert_allclose(np.array(onsets_m)[probes], farther, atol=3e-3)


def test_each_side_is_where_a_stick_leads_there() -> None:
    """The tool's x axis points to the right, its y axis down."""
    aside_m = STICK_SPEED_M_S * FULL_S
    for side, x_m, y_m in ((RIGHT, 1, 0), (UP, 0, -1), (LEFT, -1, 0), (DOWN, 0, 1)):
        near = np.array(around(asking(), post(x_m * aside_m, y_m * aside_m)).r2_m) < 0.06
        assert near[side][2], side
        assert near.sum() - near[TURNED].sum() - near[HALF].sum() <= 2


def test_what_is_under_way_is_gone_by_the_time_that_a_probe_is_reached(law: SweptLaw) -> None:
    """At 0.2 m/s, commands under way still move the gripper by 40 mm.

    So it passes nearer objects at its side before the stick takes it there.
    """
    aside_m = STICK_SPEED_M_S * FULL_S
    forth = np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    still = around(law, post(aside_m, 0.0, 0.03))
    moving = around(asking(), post(aside_m, 0.0, 0.03), joint_velocities_rad_s=forth)
    assert still.r2_m[3] < 0.03
    assert moving.r2_m[3] > 0.1


def test_ways_are_those_of_the_definition_and_follow_the_gripper(law: SweptLaw) -> None:
    objects = Scene().add().sphere([0.03, 0.01, 0.08], 0.03).objects()
    told = around(law, objects)
    for part in range(1, 4):
        moved_m = np.array([STICK_SPEED_M_S * FULL_S * part / 3, 0.0, 0.0])
        pose = ball_pose(tool_position_m=moved_m)
        along = Along(np.array([0.0, 0.0, 1.0]), 0.0, CAMERA_SD_M**2, SIGMA_M / CAMERA_SD_M, 0.3)
        defined = defined_onsets(pose, objects, np.array([OBSTACLE]), along, np.inf, np.zeros(6))
        expected_m = min(float(defined.onsets_m[0, 0, 7]), 100.0)
        assert told.r2_m[part] == pytest.approx(expected_m, abs=2.2e-3) or (
            told.r2_m[part] == 100.0 and expected_m > 0.2
        )
    ahead = told_by(law, ball_pose(tool_position_m=[0.0, 0.0, 0.01]))
    assert ahead is not None
    assert ahead.r2_m[0] == pytest.approx(told.r2_m[0] - 0.01, abs=2e-3)


def looks(law: SweptLaw, ticks: int, velocity: FloatArray, now_s: float, **changes: Any) -> int:
    before = law.summary()["looks"]
    for tick in range(ticks):
        asked = situation(ball_pose(), WALL, joint_velocities_rad_s=velocity, loop_age_s=LOOP_S, **changes)
        law.sense(asked, now_s + 1e-3 * tick)
    return law.summary()["looks"] - before


def test_at_rest_nothing_is_looked_at_from_around_and_in_motion_every_probe_in_turn(law: SweptLaw) -> None:
    still, forth = np.zeros(6), np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    looks(law, 1000, still, 0.0)
    resting = looks(law, 1000, still, 1.0)
    moving = looks(law, 1000, forth, 2.0)
    # R2 and L2 are looked along every 50 ms at rest. In motion it is every 8 ms, and every 32 ms against it.
    assert resting == pytest.approx(2 / 0.05, abs=2)
    assert moving - 1 / 0.008 - 1 / 0.032 == pytest.approx(PROBES * (1.0 + 0.25) / PERIOD_S, rel=0.1)


def test_looks_that_are_made_again_are_spread_over_ticks_and_soon_complete(law: SweptLaw) -> None:
    looks(law, 1000, np.zeros(6), 0.0)
    law.expect(0.9)
    made = [looks(law, 1, np.zeros(6), 1.0 + 0.004 * tick) for tick in range(25)]
    assert max(made) <= 11
    assert law.around(ball_pose()) is not None


def test_the_map_follows_what_approaches_between_two_looks(law: SweptLaw) -> None:
    comes = replace(walls(0.45), velocities_m_s=np.array([[0.0, 0.0, -0.5]]))
    told = []
    for tick in range(12):
        law.sense(situation(ball_pose(), comes, loop_age_s=LOOP_S), 1.0 + 0.004 * tick)
        told.append(law.around(ball_pose()))
    first, last = told[0], told[-1]
    assert first is not None
    assert last is not None
    nearer_m = Told(0.0, *first.onsets_m(1.0)).r2_m - Told(0.0, *last.onsets_m(1.0)).r2_m
    np.testing.assert_allclose(nearer_m, 0.5 * 11 * 0.004, atol=4e-3)


def test_what_has_just_appeared_straight_ahead_is_in_the_next_map(law: SweptLaw) -> None:
    looks(law, 300, np.zeros(6), 0.0)
    for tick in range(30):
        law.sense(situation(ball_pose(), walls(0.05), loop_age_s=LOOP_S), 0.3 + 0.001 * tick)
    told = told_by(law, ball_pose())
    assert told is not None
    assert told.r2_m[0] < 0.05
    assert told.r2_m[1:].max() > 0.09  # From looks before the wall came nearer.


def test_what_is_held_or_ignored_shortens_no_way_by_moving(law: SweptLaw) -> None:
    lifted = Scene().add().box([0.0, 0.0, 0.3], [0.01] * 3).add().box([0.0, 0.0, 0.2], [0.5, 0.5, 0.05]).objects()
    moved = replace(lifted, velocities_m_s=np.array([[0.0, 0.0, -0.1], [0.0, 0.0, 0.0]]))
    for tick in range(300):
        law.sense(situation(ball_pose(), lifted, loop_age_s=LOOP_S, held=0), 0.001 * tick)
    before = told_by(law, ball_pose())
    for tick in range(100):
        law.sense(situation(ball_pose(), moved, loop_age_s=LOOP_S, held=0), 0.3 + 0.001 * tick)
    after = told_by(law, ball_pose())
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(before.r2_m, after.r2_m)


def test_what_comes_nearer_shortens_every_way_by_what_it_covers_until_it_is_told(law: SweptLaw) -> None:
    looks(law, 300, np.zeros(6), 0.0)
    comes_m_s, until_s, told = 0.12, 0.0, []
    for frame in range(20):
        for tick in range(33):
            moved = replace(
                walls(0.2 - comes_m_s * 0.033 * frame, 0.1), velocities_m_s=np.array([[0, 0, -comes_m_s], [0, 0, 0]])
            )
            until_s = 1.0 + 0.033 * frame + 0.001 * tick
            law.sense(situation(ball_pose(), moved, loop_age_s=LOOP_S), until_s)
        told.append(told_by(law, ball_pose()))
    first, last = told[10], told[19]
    assert first is not None
    assert last is not None
    # Each probe has a look every 250 ms, in turns; the camera's newest frame is 33 ms old.
    np.testing.assert_allclose(last.r2_m - first.r2_m, -9 * 0.033 * comes_m_s, atol=0.0045)
    np.testing.assert_array_equal(last.l2_m, first.l2_m)


@pytest.mark.parametrize("step_s", [0.001, 0.002, 0.004, 0.02])
def test_no_probe_starves_however_late_the_ticks_are(law: SweptLaw, step_s: float) -> None:
    drifting, now_s = np.array([0.1, 0.0, 0.2, 0.0, 0.0, 0.0]), 0.0
    while now_s < 3.0:
        now_s += step_s
        asked = situation(ball_pose(), WALL, joint_velocities_rad_s=drifting, loop_age_s=LOOP_S, lateral=(1.0, 0.0))
        law.sense(asked, now_s)
    probes = law.looking.probes
    assert probes is not None
    assert probes.known
    # The looks along the trigger that leads are as old as their period at most, and the others four periods.
    probes.begin(FULL_S, now_s + 1.5 - 4.0 * PERIOD_S - 2.0 * step_s, traced=True, moved=True)
    assert probes.known
    probes.begin(FULL_S, now_s + 1.5 + step_s, traced=True, moved=True)
    assert not probes.known


@pytest.mark.parametrize("loop_s", [0.2, 1.5, 5.0, 120.0])
def test_there_is_no_map_for_an_operator_who_is_not_heard_of(law: SweptLaw, loop_s: float) -> None:
    law.sense(situation(ball_pose(), WALL, loop_age_s=loop_s), 0.0)
    told = law.around(ball_pose())
    assert (told is None) is (loop_s > 3.0)
    assert told is None or told.full_s > loop_s


def test_a_map_of_before_is_withheld_and_the_robot_side_follows_the_path_itself(law: SweptLaw) -> None:
    """The map is withheld after a change of P, and while the robot side compensates the delay."""
    drifting = np.array([0.1, 0.0, 0.2, 0.0, 0.0, 0.0])
    looks(law, 300, drifting, 0.0)
    assert law.around(ball_pose()) is not None
    assert law.looking.sides[R2].waypoints == 0
    law.expect(0.5)
    looks(law, 20, drifting, 0.3)
    assert law.around(ball_pose()) is None
    assert law.looking.sides[R2].waypoints > 0
    looks(law, 300, drifting, 0.32)
    assert law.around(ball_pose()) is not None
    assert law.looking.sides[R2].waypoints == 0
    looks(law, 20, drifting, 0.62, compensation="robot")
    assert law.around(ball_pose()) is None


def test_errors_of_the_prediction_shorten_these_ways_too() -> None:
    told = []
    for mean_m in (0.0, 0.005):
        made = asking(prediction=PredictionErrors({"operator": ((1.0, mean_m, 0.0),), "robot": ((1.0, 0.0, 0.0),)}))
        told.append(around(made, walls(0.1)).r2_m[0])
    assert told[0] - told[1] == pytest.approx(0.005, abs=2e-3)


def test_explaining_a_moment_before_a_grip_changes_nothing() -> None:
    """A map's validity restarts once an object is held. An explanation of an earlier tick must not restart it again."""
    until_s = []
    for explains in (True, False):
        law, before = asking(), situation(ball_pose(), post(0.05, 0.0), loop_age_s=LOOP_S)
        sensed = law.sense(before, 0.0)
        held = replace(before, held=0)
        law.sense(held, 0.1)
        if explains:
            law.explain("r2", before, sensed)
        # The loop age is shorter, but by too little to make the map invalid.
        law.sense(replace(held, loop_age_s=0.99 * LOOP_S), 0.2)
        assert law.looking.probes is not None
        until_s.append(law.looking.probes.full_s)
    assert until_s[0] == until_s[1] == pytest.approx(FULL_S)
