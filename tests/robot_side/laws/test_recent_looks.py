"""Onset distances kept from the looks of the last tenth of a second, against plain lists; and fields made of them."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.reaction import HORIZON_S
from robot_side.arm.ability import Ability
from robot_side.laws.recent_looks import ROOM, STEADY_S, WAYPOINT_PERIOD_S, RecentLooks
from robot_side.laws.trigger_field import rumble, trigger_field

ABLE = Ability(0.25, 3.0, within_reach=True)


@dataclass
class Look:
    waypoint: int
    at_s: float
    direction: FloatArray
    tool_m: FloatArray
    onsets_m: FloatArray


def random_look(rng: np.random.Generator, waypoint: int, now_s: float) -> Look:
    direction = np.array([0.0, 0.0, 1.0]) + rng.choice([0.005, 0.1]) * rng.normal(size=3)
    onsets_m = np.sort(rng.uniform(-0.01, 0.3, (2, 8)))
    onsets_m[:, rng.integers(0, 9) :] = np.inf
    return Look(waypoint, now_s, direction / np.linalg.norm(direction), 0.01 * rng.normal(size=3), onsets_m)


def add(looks: RecentLooks, new: Look) -> None:
    looks.add(new.waypoint, new.at_s, new.direction, float(new.direction @ new.tool_m), new.onsets_m)


@settings(derandomize=True, deadline=None, max_examples=25)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_shortest_ways_hold_less_what_the_tool_has_moved(seed: int) -> None:
    rng, looks, kept, now_s = np.random.default_rng(seed), RecentLooks(), list[Look](), 0.0
    for _ in range(150):
        waypoints = int(rng.integers(0, 10))
        looks.keep_up_to(waypoints)
        kept = [one for one in kept if one.waypoint <= waypoints]
        for waypoint in sorted({0, int(rng.integers(0, waypoints + 1))}):
            now_s += rng.uniform(0.0, 0.005)
            new = random_look(rng, waypoint, now_s)
            kept = [
                one
                for one in kept
                if one.waypoint != waypoint or (now_s - one.at_s < STEADY_S and one.direction @ new.direction > 0.999)
            ]
            kept.append(new)
            add(looks, new)
    tool_m = 0.01 * rng.normal(size=3)
    expected_m = np.min([one.onsets_m - one.direction @ (tool_m - one.tool_m) for one in kept], axis=0)
    np.testing.assert_allclose(looks.shortest_m(tool_m), expected_m, atol=1e-12)
    looks.forget()
    assert np.isinf(looks.shortest_m(tool_m)).all()


def test_more_looks_than_there_is_room_for_cost_the_oldest() -> None:
    looks, new = RecentLooks(), random_look(np.random.default_rng(2), 0, 0.0)
    for number in range(2 * ROOM):
        new.at_s, new.onsets_m = 1e-6 * number, np.full((2, 8), 1.0 + number)
        add(looks, new)
    np.testing.assert_allclose(looks.shortest_m(new.tool_m), 1.0 + ROOM)


@pytest.mark.parametrize("passed_s", [0.001, 0.004, 0.01, 0.02, 0.2])
def test_every_waypoint_has_its_turn_in_time_and_a_new_one_at_once(passed_s: float) -> None:
    looks, new, now_s, looked_s = RecentLooks(), random_look(np.random.default_rng(1), 0, 0.0), 0.0, dict[int, float]()
    for waypoints in (3, 10, 7):
        looks.keep_up_to(waypoints)
        for _ in range(60):
            now_s += passed_s
            for number in looks.due(passed_s, now_s):
                new.waypoint, new.at_s, looked_s[number] = number, now_s, now_s
                add(looks, new)
            assert min(looked_s[number] for number in range(1, waypoints + 1)) > now_s - WAYPOINT_PERIOD_S - passed_s
    assert looks.due(0.001, now_s) != []
    assert RecentLooks().due(passed_s, 1.0) == []


def test_the_nearest_waypoint_is_that_of_the_shortest_onset_distance_of_full_strength() -> None:
    looks, new = RecentLooks(), random_look(np.random.default_rng(3), 0, 0.0)
    looks.keep_up_to(3)
    for waypoint, onset_m in enumerate((0.3, 0.2, 0.05, 0.1)):
        new.waypoint, new.onsets_m = waypoint, np.full((2, 8), onset_m)
        add(looks, new)
    assert [looks.nearest(even) for even in range(4)] == [0, 1, 2, 2]


@settings(derandomize=True, deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), loop_s=st.floats(0.0, 0.3), stick=st.floats(0.0, 0.1))
def test_a_field_is_cut_to_what_is_known_and_counts_the_strengths_within_reach(
    seed: int, loop_s: float, stick: float
) -> None:
    rng = np.random.default_rng(seed)
    onsets_m, (known_m, displacement_m) = random_look(rng, 0, 0.0).onsets_m, rng.uniform(-0.1, 0.3, 2).tolist()
    found = trigger_field(onsets_m, ABLE, displacement_m, known_m)
    np.testing.assert_array_equal([found.fast_m, found.slow_m], np.minimum(onsets_m, known_m))
    assert found.course_stiffness == np.count_nonzero(np.minimum(onsets_m[0], known_m) <= displacement_m) / 8
    assert (found.full_speed_m_s, found.acceleration_m_s2) == (0.25, 3.0)
    reach_m = stick * (loop_s + HORIZON_S) + stick**2 / 6.0
    listed = onsets_m[1 if stick < 0.05 else 0]
    assert rumble(onsets_m, ABLE, stick, 0.05, loop_s) == np.count_nonzero(listed <= reach_m) / 8


def test_an_unstable_simulation_is_still_reported() -> None:
    found = trigger_field(np.full((2, 8), -1e9), ABLE, 1e9, 1e9)
    assert (found.fast_m[0], found.displacement_m) == (-100.0, 100.0)
    assert trigger_field(np.full((2, 8), np.inf), ABLE, 0.0, -1e9).fast_m[0] == -100.0
