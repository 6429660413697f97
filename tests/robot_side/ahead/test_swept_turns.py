"""When the swept law looks, tick by tick in virtual time, and what holds until it looks again."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.ahead.looks import STEADY_S
from robot_side.ahead.turns import FIELD_PERIOD_S, MOST_WORK
from robot_side.arm.port import GripperPose
from robot_side.objects.perceived import PerceivedObjects
from tests.helpers.ahead.fields import RADIUS_M, ball_pose
from tests.helpers.ahead.situations import Senses, at, situation, swept, walls
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import Scene

# When it looks


class Watched:
    """A law that is used tick by tick, and where it looked in each."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.law = swept()
        self.looks: list[tuple[float, str]] = []
        self.now_s = 7.0
        look: Callable[..., Any] = self.law.ahead.begin

        def watched(pose: GripperPose, scene: Any, standing: Any, along: Any, widest_m: float) -> Any:
            along_z = float(along.direction @ pose.tool_rotation[:, 2])
            self.looks.append((self.now_s, {1: "r2", -1: "l2"}.get(round(along_z), "stick")))
            return look(pose, scene, standing, along, widest_m)

        monkeypatch.setattr(self.law.ahead, "begin", watched)

    def tick(self, step_s: float, count: int, **changes: Any) -> list[int]:
        """How often it looked in each tick."""
        numbers = []
        for _ in range(count):
            self.now_s += step_s
            before = len(self.looks)
            self.law.sense(situation(ball_pose(), walls(0.1), **changes), self.now_s)
            numbers.append(len(self.looks) - before)
        return numbers

    def pauses_s(self, side: str) -> FloatArray:
        times = [when_s for when_s, where in self.looks if where == side]
        return np.diff(times)


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch) -> Watched:
    return Watched(monkeypatch)


@pytest.mark.parametrize("lateral", [(0.0, 0.0), (0.5, 0.2)])
def test_fields_are_looked_at_in_turns_a_hundred_times_a_second(watched: Watched, lateral: tuple[float, float]) -> None:
    numbers = watched.tick(0.001, 200, lateral=lateral)
    sides = ["r2", "l2"] + ["stick"] * (lateral != (0.0, 0.0))
    # The triggers must never be without a field.
    assert numbers[0] == len(sides)
    assert max(numbers[1:]) == 1
    for side in sides:
        pauses_s = watched.pauses_s(side)
        assert len(pauses_s) >= 18
        # The first pause is longer by a tick for each side before it.
        assert pauses_s[0] <= FIELD_PERIOD_S + 0.002 + 1e-9
        np.testing.assert_allclose(pauses_s[1:], FIELD_PERIOD_S, atol=1e-9)


@pytest.mark.parametrize("step_s", [0.004, 0.005, 0.012, 0.05])
def test_no_side_starves_however_late_the_ticks_are(watched: Watched, step_s: float) -> None:
    watched.tick(step_s, 60, lateral=(1.0, 0.0))
    for side in ("r2", "l2", "stick"):
        assert watched.pauses_s(side).max() <= max(2.0 * FIELD_PERIOD_S, step_s) + step_s + 1e-9


def test_a_stick_that_is_deflected_is_looked_along_within_a_tick_or_two(watched: Watched) -> None:
    watched.tick(0.001, 25)
    assert "stick" not in {side for _, side in watched.looks}
    watched.tick(0.001, 3, lateral=(0.3, 0.0))
    assert "stick" in {side for _, side in watched.looks}
    before = len([1 for _, side in watched.looks if side == "stick"])
    watched.tick(0.001, 30)
    assert len([1 for _, side in watched.looks if side == "stick"]) == before


CROWD = free_pose(
    [[x, y, 0.001 * abs(x - y)] for x in np.linspace(-0.05, 0.05, 12) for y in np.linspace(-0.05, 0.05, 12)],
    [RADIUS_M] * 144,
)


class Measured:
    """A law that is used by a crowd of spheres, and how much it did in each tick."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.law, self.now_s = swept(), 7.0
        self.done = 0
        go_on: Callable[..., Any] = self.law.ahead.go_on

        def measured(most: int) -> Any:
            before = self.law.ahead.work
            found = go_on(most)
            self.done += self.law.ahead.work - before
            return found

        monkeypatch.setattr(self.law.ahead, "go_on", measured)

    def tick(self, objects: PerceivedObjects, count: int, pose: GripperPose = CROWD) -> list[int]:
        """How much it did in each tick."""
        numbers = []
        for _ in range(count):
            self.now_s += 0.001
            self.done = 0
            self.sensed = self.law.sense(situation(pose, objects), self.now_s)
            numbers.append(self.done)
        return numbers


def test_what_is_done_in_a_tick_is_bounded_where_much_is_near(monkeypatch: pytest.MonkeyPatch) -> None:
    measured, objects = Measured(monkeypatch), walls(0.03, 0.03)
    numbers = measured.tick(objects, 100)
    # At first everything is looked at, at once.
    assert numbers[0] > 2 * MOST_WORK
    # The last ramps that a round meets, and the last nodes of one ramp, may go beyond.
    assert 0.5 * MOST_WORK < max(numbers[1:]) <= MOST_WORK + 150
    assert sum(number > 0 for number in numbers) >= 36
    assert 18 <= measured.law.summary()["fields"] <= 21


def test_a_look_that_took_a_few_ticks_finds_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    measured, objects = Measured(monkeypatch), walls(0.03, 0.03)
    measured.tick(objects, 1)
    at_once = measured.sensed
    numbers = measured.tick(objects, 30)
    assert 0 < numbers.count(0) < 25
    np.testing.assert_allclose(measured.sensed.r2.fast_m, at_once.r2.fast_m, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(measured.sensed.l2.slow_m, at_once.l2.slow_m, rtol=0.0, atol=1e-12)


def test_a_look_counts_from_where_it_began(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else what the tool moved while it looked would be counted twice, or not at all."""
    measured, objects = Measured(monkeypatch), walls(0.08, 0.08, front_m=0.05)
    for tick in range(120):
        way_m = 0.0001 * tick
        measured.tick(
            objects,
            1,
            replace(
                CROWD,
                tool_position_m=np.array([0.0, 0.0, way_m]),
                sphere_centers_m=CROWD.sphere_centers_m + np.array([0.0, 0.0, way_m]),
            ),
        )
        if tick == 0:
            first = np.array(measured.sensed.r2.fast_m)
        np.testing.assert_allclose(measured.sensed.r2.fast_m, first - way_m, rtol=0.0, atol=1e-9)


def test_looks_come_to_an_end_although_every_tick_has_other_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    measured = Measured(monkeypatch)
    for tick in range(60):
        away_m = 0.06 - 0.0001 * tick
        measured.tick(walls(away_m, 0.03), 1)
        # A wall that comes at 0.1 m/s is seen a few hundredths of a second later.
        assert away_m < measured.sensed.r2.fast_m[-1] + 0.012 < away_m + 0.0125
    assert measured.law.summary()["fields"] > 10


def test_what_could_not_begin_is_not_gone_on_with(monkeypatch: pytest.MonkeyPatch) -> None:
    measured, objects = Measured(monkeypatch), walls(0.03, 0.03)
    measured.tick(objects, 1)
    at_once, fields = measured.sensed, measured.law.summary()["fields"]
    measured.now_s += 0.02
    broken = replace(CROWD, sphere_centers_m=np.full_like(CROWD.sphere_centers_m, np.nan))
    with pytest.raises(ValueError, match="sphere_centers_m"):
        measured.tick(objects, 1, broken)
    # What was seen before holds, and both sides, which are overdue, are looked along anew.
    measured.tick(objects, 1)
    assert measured.law.summary()["fields"] == fields + 2
    np.testing.assert_allclose(measured.sensed.r2.fast_m, at_once.r2.fast_m, rtol=0.0, atol=1e-12)


def test_what_an_object_is_is_worked_out_when_roles_or_the_held_object_change() -> None:
    law = swept()
    first = law._stands(situation(ball_pose(), walls(0.1, 0.1)))
    assert law._stands(situation(ball_pose(), walls(0.2, 0.1))) is first
    held = law._stands(situation(ball_pose(), walls(0.2, 0.1), held=1))
    assert held.tolist() != first.tolist()


# What holds between two looks


def test_ways_are_shortened_by_what_the_tool_has_moved_along() -> None:
    senses = Senses(step_s=0.001)
    before = senses.sense(at(0.0), walls(0.08, 0.05))
    looked = senses.law.summary()["fields"]
    after = senses.sense(at(0.002, 0.004), walls(0.08, 0.05))
    assert senses.law.summary()["fields"] == looked
    np.testing.assert_allclose(after.r2.fast_m, np.array(before.r2.fast_m) - 0.002, atol=1e-12)
    np.testing.assert_allclose(after.r2.slow_m, np.array(before.r2.slow_m) - 0.002, atol=1e-12)
    np.testing.assert_allclose(after.l2.fast_m, np.array(before.l2.fast_m) + 0.002, atol=1e-12)


def test_a_way_that_was_found_holds_for_a_tenth_of_a_second_and_a_new_one_at_once() -> None:
    """Strength rises at once and falls slowly: where something is just passed, noise must not make it flicker."""
    senses = Senses(step_s=0.01)
    near, far = walls(0.05), walls(0.09)
    there = senses.sense(at(0.0), near).r2.fast_m
    for tick in range(1, 30):
        found = senses.sense(at(0.0), far).r2.fast_m
        if tick * 0.01 < STEADY_S - 1e-6:
            np.testing.assert_allclose(found, there, atol=1e-12)
        elif tick * 0.01 > STEADY_S + 0.01:
            np.testing.assert_allclose(found, np.array(there) + 0.04, atol=1e-6)
    for _ in range(2):
        again = senses.sense(at(0.0), near).r2.fast_m
    np.testing.assert_allclose(again, there, atol=1e-12)


def test_what_was_seen_along_another_direction_holds_no_more() -> None:
    senses = Senses(step_s=0.01)
    ball = Scene().add().sphere([0.0, 0.0, 0.1], 0.02).objects()
    assert senses.sense(at(0.0), ball).r2.fast_m[0] < 0.07
    turned = ball_pose(tool_rotation=np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]))
    for _ in range(2):
        found = senses.sense(turned, ball)
    assert found.r2.fast_m[0] == found.horizon_m
