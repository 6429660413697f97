from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.following import follow_together
from common.protocol.around import AXES, LISTS, PROBES, Around
from common.protocol.messages import Compensation, Header, MotionCommand, StiffnessUpdate
from common.protocol.uniform_field import FAR_M, uniform_field
from common.reaction import HORIZON_S
from operator_side.controller.feel import ZONE_COUNT
from operator_side.feel.blindness import Blindness
from operator_side.feel.commands_under_way import AT_REST, CommandsUnderWay, Course, Report, Sticks
from operator_side.feel.haptics import MAP_EXPIRES_S, Haptics
from operator_side.feel.path_ahead import Asked, CourseOnMap, _ahead, contact_distances_m, traced_zones
from operator_side.feel.rendering import RenderingSettings
from operator_side.feel.zones import zone_travels
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from tests.helpers.messages import onsets

FULL_S = 0.8
FIELD = uniform_field(0)
TRAVELS = zone_travels(TriggerTravel())
RIGHT_ACROSS, RIGHT_TURNED, UP_ACROSS = (1, 2, 3), (4, 5), (6, 7, 8)
RIGHT: Sticks = (1.0, 0.0, 0.0, 0.0)
CHANGES_S = np.diag([FIELD.full_speed_m_s / FIELD.acceleration_m_s2, 0.0, 0.0, 0.0, 0.0])
"""K of Course for one joint per axis: only changes of the trigger take time"""
REPORT = Report(0.0, 0.0, 0.0, FIELD.full_speed_m_s)

HORIZON_M = 0.4


def around(near: dict[int, float], *, advancing: bool = True) -> Around:
    onsets_m = np.full((LISTS, PROBES), np.inf)
    for probe, displacement_m in near.items():
        onsets_m[slice(0, 2) if advancing else slice(2, 4), probe] = displacement_m
    return Around.of(FULL_S, onsets_m, CHANGES_S)


def under_way(now_s: float, sticks: Sticks, travel: float = 0.0, since_s: float = 0.0) -> CommandsUnderWay:
    """Return a history with a command every 4 ms: at rest until `since_s`, and as given from then on."""
    commands = CommandsUnderWay()
    for number in range(round(now_s / 0.004) + 1):
        moves = number * 0.004 >= since_s - 1e-9
        commands.sent(number * 0.004, travel if moves else 0.0, sticks if moves else AT_REST)
    return commands


def first_zone(
    commanded: Around, sticks: Sticks, *, now_s: float = 0.4, travel: float = 0.0, forth: bool = True
) -> int:
    commands = under_way(now_s, sticks, travel)
    course = commands.course(now_s, REPORT, CHANGES_S)
    if course is None:
        return ZONE_COUNT
    aside = CourseOnMap(commanded, HORIZON_M, course, commands.sticks_at(now_s))
    strengths = traced_zones(aside, [Asked(FIELD, TRAVELS, 0.0, forth)], HORIZON_S)[0].strengths
    return sum(strength < 8 for strength in strengths)


@pytest.mark.parametrize("forth", [True, False])
def test_what_stands_where_the_stick_leads_makes_the_zones_full_that_get_so_far(forth: bool) -> None:
    """With 0.4 s of commands under way, the stick leads beyond the probe at two thirds and to the outermost one."""
    commanded = around(dict.fromkeys(RIGHT_ACROSS, 0.03), advancing=forth)
    found = first_zone(commanded, RIGHT, forth=forth)
    assert 0 < found < ZONE_COUNT
    # The last zone gets less far, this one farther: u h + u²/2a, less the distance that starting from rest costs.
    for zone, reaches in ((found - 1, False), (found, True)):
        u = TRAVELS[zone] * FIELD.full_speed_m_s
        assert (u * HORIZON_S >= 0.03) is reaches
    for elsewhere in ((-1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)):
        assert first_zone(commanded, elsewhere, forth=forth) == ZONE_COUNT
    assert first_zone(commanded, RIGHT, forth=not forth) == ZONE_COUNT


def test_strength_rises_before_full_as_it_does_straight_ahead_and_no_farther() -> None:
    rising = onsets(*(0.193 + 0.001 * k for k in range(8)))
    two_things = onsets(0.05, 0.06, *(0.195 + 0.001 * k for k in range(6)))
    # From rest: braking adds the distance that starting costs.
    reaches_m = FIELD.full_speed_m_s * TRAVELS[-1] * HORIZON_S
    for field in (rising, two_things):
        commanded = around(dict.fromkeys((*RIGHT_ACROSS, 0), reaches_m + 0.003))
        commands = under_way(0.4, RIGHT)
        course = commands.course(0.4, REPORT, CHANGES_S)
        assert course is not None
        aside = CourseOnMap(commanded, HORIZON_M, course, RIGHT)
        along = msgspec.structs.replace(FIELD, fast_m=field, slow_m=field)
        strengths = traced_zones(aside, [Asked(along, TRAVELS, 0.0, forth=True)], HORIZON_S)[0].strengths
        assert strengths[0] == 0
        assert 0 < strengths[-1] < 8
        assert list(strengths) == sorted(strengths)


def test_both_sticks_at_once_take_the_shorter_way() -> None:
    commanded = around(dict.fromkeys(RIGHT_TURNED, 0.02))
    assert first_zone(commanded, RIGHT) == ZONE_COUNT
    turned = first_zone(commanded, (0.0, 0.0, 1.0, 0.0))
    assert turned < ZONE_COUNT
    assert first_zone(commanded, (1.0, 0.0, 1.0, 0.0)) == turned
    # A stick deflected between two directions meets objects in either direction.
    assert first_zone(around(dict.fromkeys(RIGHT_ACROSS, 0.02)), (0.7, 0.4, 0.0, 0.0)) < ZONE_COUNT
    assert first_zone(around(dict.fromkeys(UP_ACROSS, 0.02)), (0.9, 0.05, 0.0, 0.0)) == ZONE_COUNT
    diagonal = around(dict.fromkeys((*RIGHT_ACROSS, *UP_ACROSS), 0.02))
    assert first_zone(diagonal, (0.7, 0.7, 0.0, 0.0)) < ZONE_COUNT


def probes_at() -> FloatArray:
    """Return the probes' positions (PROBES, 4), as shares of the outermost probe's displacement."""
    found = [[0.0, 0.0, 0.0, 0.0]]
    for x, y in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
        found += [[part * x / 3, part * y / 3, 0.0, 0.0] for part in (1, 2, 3)]
        found += [[0.0, 0.0, 0.5 * x, 0.5 * y], [0.0, 0.0, x, y]]
    return np.array(found)


@given(st.lists(st.floats(0.0, 0.3), min_size=PROBES, max_size=PROBES), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_ways_are_interpolated_between_probes_and_never_beyond_them(onsets: list[float], x: float, y: float) -> None:
    onsets_m, exact = np.array(onsets), probes_at()
    np.testing.assert_allclose(contact_distances_m(onsets_m[None], exact)[0], onsets_m, atol=1e-12)
    between = contact_distances_m(onsets_m[None], np.array([[x, y, 0.0, 0.0], [0.0, 0.0, x, y]]))
    assert (between >= onsets_m.min() - 1e-12).all()
    assert (between <= onsets_m.max() + 1e-12).all()


@given(
    st.floats(-0.3, 0.3),
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(0.01, 0.25),
    st.integers(0, 99),
    st.sampled_from([1.0, -1.0]),
)
def test_ways_ahead_are_those_of_the_arms_model(
    speed: float, was: float, stick: float, zone: float, seed: int, sign: float
) -> None:
    changes_s = np.random.default_rng(seed).uniform(-0.1, 0.1, (6, AXES))
    course = Course(np.array([0.01]), speed, np.zeros((1, 4)), np.array([was, 0.0, 0.0, 0.0]), changes_s)
    along = {"signs": np.array([[sign]]), "full_m_s": np.array([[0.25]])}
    onsets_m, aside_s = _ahead(
        course, speeds_m_s=np.array([[zone]]), sticks=np.array([[stick, 0.0, 0.0, 0.0]]), horizon_s=HORIZON_S, **along
    )
    began, going, rests = (
        np.array([travel, at, 0.0, 0.0, 0.0])
        for travel, at in ((speed / 0.25, was), (sign * zone / 0.25, stick), (0.0, stick))
    )
    first, then = follow_together(began, going, changes_s, HORIZON_S)
    braking_s = float(np.abs(changes_s @ (rests - then)).max())
    for k in range(8):
        after_s = (k + 1) / 8 * (HORIZON_S + braking_s)
        passed = follow_together(began, going, changes_s, min(after_s, HORIZON_S))[0]
        if after_s > HORIZON_S:
            passed = first + follow_together(then, rests, changes_s, after_s - HORIZON_S)[0]
        assert onsets_m[0, k] == pytest.approx(sign * (0.01 + 0.25 * passed[0]), abs=1e-9)
        np.testing.assert_allclose(aside_s[0, k], passed[1:], atol=1e-9)


def message(sent_s: float, commanded: Around | None, epoch: int = 1, **changes: Any) -> StiffnessUpdate:
    header = Header(epoch, round(1e3 * sent_s), sent_s, echo_sent_s=0.0, echo_held_s=0.0)
    update = StiffnessUpdate(header, FIELD, FIELD, 0.0, FAR_M, 0.0, "armed", around=commanded)
    return msgspec.structs.replace(update, **changes)


def haptics(compensation: Compensation = "operator") -> Haptics:
    made = Haptics(RenderingSettings(), TravelCalibration(), enabled=True, swap_sides=False, compensation=compensation)
    for number in range(101):
        made.commanded(MotionCommand(Header(9, number, 0.004 * number), 0.0, 0.8, lateral=(1.0, 0.0), run=True))
    return made


def strengths(made: Haptics, update: StiffnessUpdate, now_s: float = 0.4) -> tuple[int, ...]:
    made.keep_map(update)
    report = made.due(update, (0.0, 0.8), Blindness(), now_s)
    effect = None if report is None else report.r2
    return (0,) * ZONE_COUNT if effect is None else effect


def test_the_newest_map_holds_until_it_is_old_or_another_robot_side_speaks() -> None:
    commanded = around(dict.fromkeys((*RIGHT_ACROSS, 0), 0.03))
    made = haptics()
    assert strengths(made, message(0.3, commanded))[-1] == 8
    assert made.due(message(0.32, None), (0.0, 0.8), Blindness(), 0.41) is None  # Nothing changes.
    for later in (message(0.3 + MAP_EXPIRES_S + 0.01, None), message(0.35, None, epoch=2)):
        made = haptics()
        strengths(made, message(0.3, commanded))
        report = made.due(later, (0.0, 0.8), Blindness(), 0.6)
        assert report is not None
        assert report.r2 is not None
        assert report.r2[-1] < 8


def test_no_map_is_followed_where_the_robot_side_compensates() -> None:
    """It reckons with the sticks by itself."""
    commanded = around(dict.fromkeys((*RIGHT_ACROSS, 0), 0.03))
    assert strengths(haptics("robot"), message(0.3, commanded)) == strengths(haptics("robot"), message(0.3, None))
    assert strengths(haptics(), message(0.3, commanded)) != strengths(haptics(), message(0.3, None))


def test_a_path_is_traced_once_for_each_write_and_at_once_for_a_new_map() -> None:
    """So an object to which the stick leads is felt at most 10 ms late."""
    commanded, free = around(dict.fromkeys((*RIGHT_ACROSS, 0), 0.03)), around({})
    made = haptics()
    assert strengths(made, message(0.3, free)) == (0,) * ZONE_COUNT
    assert made.due(message(0.31, None), (0.0, 0.8), Blindness(), 0.405) is None
    made.keep_map(message(0.32, commanded))
    report = made.due(message(0.33, None), (0.0, 0.8), Blindness(), 0.406)
    assert report is not None
    assert report.r2 is not None
    assert report.r2[-1] == 8


def test_what_is_to_be_touched_is_felt_beside_a_stick_in_the_zones_that_touch_it() -> None:
    """A map has only distances of full strength. A target's slow list has strengths up to 4 before that."""
    target = msgspec.structs.replace(FIELD, slow_m=onsets(*[0.002] * 4, *[0.3] * 4), fast_m=onsets(*[0.002] * 8))
    slow, fast = around({0: 0.002}).onsets_m(FAR_M)[:2], around({}).onsets_m(FAR_M)[0]
    commanded = Around.of(FULL_S, np.stack([slow[0], fast, fast, fast]), CHANGES_S)
    made = haptics()
    update = message(0.3, commanded, r2=target)
    made.keep_map(update)
    report = made.due(update, (0.0, 0.1), Blindness(), 0.4)
    assert report is not None
    assert report.r2 is not None
    assert report.r2[1] == 4
