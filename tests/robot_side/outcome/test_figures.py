from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from common.protocol.uniform_field import uniform_field
from common.roles import Role
from robot_side.arm.port import ArmState
from robot_side.outcome.figures import MOVING_M_S, RunFigures
from robot_side.tick.events import Found, Tick
from robot_side.tick.explained import Overlaps, Trigger
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation
from robot_side.tick.truth import Truth
from tests.helpers.field.situations import situation
from tests.helpers.gripper_poses import gripper_pose

ROLES = {"post": Role.OBSTACLE, "cup": Role.TARGET, "table": Role.SUPPORT}


def sensed(enlargement_m: float, l2: int = 0, r2: int = 0, tool_speed_m_s: float = 0.0) -> Sensed:
    return Sensed(
        l2=uniform_field(l2),
        r2=uniform_field(r2),
        horizon_m=0.2,
        enlargement_m=enlargement_m,
        tool_speed_m_s=tool_speed_m_s,
    )


def truth(
    *contacts: tuple[str, str], min_distance_m: float | None = None, min_obstacle_distance_m: float | None = None
) -> Truth:
    return Truth(min_distance_m, min_obstacle_distance_m, frozenset(contacts))


def leaves(summary: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in summary.items():
        found |= leaves(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return found


def test_what_was_never_seen_is_none_and_only_counts_are_0() -> None:
    empty = leaves(RunFigures().summary())
    counted = {name for name, value in empty.items() if value == 0}
    assert counted == {"ticks", "task.lifted_mm"}
    assert {name for name, value in empty.items() if value is None} == empty.keys() - counted
    assert RunFigures().placed is None


def test_figures_are_in_the_units_of_their_names() -> None:
    figures = RunFigures()
    figures.tick(sensed(0.030, l2=1, r2=8))
    figures.tick(sensed(0.050, l2=3, r2=4))
    figures.tick(sensed(0.509, l2=2, r2=6), settled=False)
    summary = figures.summary()
    assert summary["ticks"] == 3
    assert summary["enlargement_mm"] == pytest.approx({"min": 30.0, "mean": 40.0, "max": 50.0, "mean_moving": None})
    assert summary["stiffness"]["l2"] == pytest.approx({"mean": 0.25, "max": 0.375})
    assert summary["stiffness"]["r2"] == pytest.approx({"mean": 0.75, "max": 1.0})


@pytest.mark.parametrize("asked_every", [1, 100, 10_000])
def test_figures_of_many_ticks_are_those_of_each(asked_every: int) -> None:
    generator = np.random.default_rng(0)
    enlargements = generator.uniform(0.0, 0.1, 5000)
    speeds = generator.choice([0.0, MOVING_M_S, 0.25], 5000)
    figures = RunFigures()
    for enlargement_m, speed_m_s in zip(enlargements, speeds, strict=True):
        figures.tick(sensed(float(enlargement_m), tool_speed_m_s=float(speed_m_s)), armed=False)
        if figures.ticks % asked_every == 0:
            figures.on_sent(0.0)
    summary = figures.summary()
    assert summary["ticks"] == 5000
    assert summary["enlargement_mm"]["mean"] == pytest.approx(1e3 * np.mean(enlargements), rel=1e-12)
    assert summary["enlargement_mm"]["max"] == pytest.approx(1e3 * np.max(enlargements), rel=1e-12)
    assert summary["enlargement_mm"]["mean_moving"] == pytest.approx(
        1e3 * np.mean(enlargements[speeds > 0.01]), rel=1e-12
    )


class Growing:
    """Enlarged gripper whose overlap is its loop age, 1 mm³ for each ms."""

    def overlaps_m3(self, trigger: Trigger, situation: Situation) -> Overlaps:
        raise AssertionError(f"{trigger}, {situation.loop_age_s} s: only the total is a figure")

    def overlap_m3(self, situation: Situation) -> float:
        return 1e-6 * situation.loop_age_s


def test_the_overlap_is_worked_out_ten_times_a_second_once_the_loop_age_is_known() -> None:
    figures, state = RunFigures(enlarged=Growing()), ArmState(0.0, np.zeros(6), np.zeros(6), np.zeros(2), 0.0, False)
    for tick in range(151):
        now_s = 7.0 + 0.004 * tick
        here = situation(gripper_pose(), loop_age_s=0.004 * tick, loop_age_known=tick >= 25)
        # In the last 50 ticks there is too much to look at.
        seen = replace(sensed(0.0), cut=tick > 100)
        found = Found("armed", None, state, here, seen, False, None, None)
        figures.on_tick(Tick(now_s, state, None, 0.0, (), found))
        figures.on_sent(now_s)
        assert (figures.overlap_m3 is None) is (tick < 25)
    assert figures.overlap_m3 == pytest.approx(4e-7)
    assert figures.summary()["overlap_mm3"] == pytest.approx({"max": 400.0, "mean": 250.0})


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="enlargement_m"):
        sensed(wrong)


def test_the_smallest_distance_is_kept_and_absence_is_no_distance() -> None:
    figures = RunFigures()
    figures.truth(truth(), ROLES, 0.0)
    assert figures.summary()["min_distance_mm"] is None
    for nearest, obstacle in ((0.3, None), (0.05, 0.4), (None, None), (-0.001, 0.2), (0.2, 0.3), (None, None)):
        figures.truth(truth(min_distance_m=nearest, min_obstacle_distance_m=obstacle), ROLES, 0.0)
    assert figures.summary()["min_distance_mm"] == pytest.approx(-1.0)
    assert figures.summary()["task"]["min_obstacle_distance_mm"] == pytest.approx(200.0)


def contacts(touching_s: list[float], step_s: float = 0.01) -> int:
    """Return the number of contacts counted for a pair that touches in the times `touching_s`: from, to, from, to."""
    figures = RunFigures()
    for step in range(200):
        now_s = step * step_s
        touches = any(start <= now_s < end for start, end in zip(touching_s[::2], touching_s[1::2], strict=True))
        figures.truth(truth(("tip", "post")) if touches else truth(), ROLES, now_s)
    count = figures.summary()["contacts"]
    assert isinstance(count, int)
    return count


def test_a_contact_that_chatters_is_one_and_one_that_comes_back_is_another() -> None:
    assert contacts([0.305, 0.405, 0.465, 0.505, 0.585, 0.605]) == 1
    assert contacts([0.305, 0.405, 0.525, 0.605]) == 2
    assert contacts([0.305, 0.405, 0.455, 0.505, 1.005, 1.105]) == 2


def test_contacts_are_counted_by_object_and_those_with_obstacles_apart() -> None:
    figures = RunFigures()
    figures.truth(truth(("tip", "table"), ("tip", "cup")), ROLES, 0.0)
    figures.truth(truth(("palm", "post"), ("tip", "cup")), ROLES, 0.05)
    figures.truth(truth(), ROLES, 0.5)
    figures.truth(truth(("palm", "post")), ROLES, 1.0)
    summary = figures.summary()
    assert summary["contacts"] == 4
    assert summary["task"]["contacts_by_object"] == {"cup": 1, "post": 2, "table": 1}
    assert summary["task"]["obstacle_contacts"] == 2


def test_the_time_to_the_grasp_counts_from_the_first_arming() -> None:
    figures = RunFigures()
    for now_s, armed, held in ((1.0, False, False), (2.0, True, False), (3.0, False, False), (4.0, True, False)):
        figures.task(armed, held, None, now_s)
        assert figures.summary()["task"]["time_to_grasp_s"] is None
    figures.task(True, True, None, 6.5)
    figures.task(True, False, None, 7.0)
    figures.task(True, True, None, 8.0)
    assert figures.summary()["task"]["time_to_grasp_s"] == pytest.approx(4.5)


def lifted_mm(*ticks: tuple[bool, float | None]) -> float:
    figures = RunFigures()
    for number, (held, height_m) in enumerate(ticks):
        figures.task(True, held, None if height_m is None else np.array([0.5, 0.1, height_m]), 0.1 * number)
    value = figures.summary()["task"]["lifted_mm"]
    assert isinstance(value, float)
    return value


def test_lifted_is_how_far_a_held_target_rose_above_where_it_rested() -> None:
    assert lifted_mm((False, 0.05), (True, 0.05), (True, 0.12), (True, 0.09), (False, 0.05)) == pytest.approx(70.0)
    assert lifted_mm((False, 0.05), (True, 0.03)) == 0.0
    # Without a height at first; thrown up, or seen higher, without being held.
    assert lifted_mm((False, np.nan), (False, 0.05), (True, 0.05), (True, 0.15)) == pytest.approx(100.0)
    assert lifted_mm((False, 0.05), (False, 0.5), (True, 0.5)) == 0.0
    assert lifted_mm((False, None), (True, None)) == 0.0
