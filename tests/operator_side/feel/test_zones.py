"""Strengths of the ten zones: exact in examples computed by hand, and monotone for any travel and field."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.protocol.messages import Header, OnsetDistances, StiffnessUpdate, TriggerField
from common.reaction import HORIZON_S
from common.touch_speed import touch_speed_m_s
from operator_side.feel.commands_under_way import Displacement
from operator_side.feel.zones import moving_along, zone_strengths, zone_travels
from operator_side.hands.travel_calibration import TriggerTravel
from tests.helpers.messages import field, onsets

USUAL = zone_travels(TriggerTravel())
STILL = Displacement(0.0, 0.0)
HORIZON_M = 0.4
TRAVEL = st.floats(0.0, 1.0)
WAY = st.floats(-0.1, 0.3)
WAYS = st.lists(st.floats(-0.1, HORIZON_M), min_size=8, max_size=8).map(lambda metres: onsets(*sorted(metres)))


@st.composite
def fields(draw: st.DrawFn) -> TriggerField:
    """Draw fields whose slow onset distances are never shorter than the fast ones."""
    fast: OnsetDistances = draw(WAYS)
    slow = onsets(*(metres + draw(st.floats(0.0, 0.1)) for metres in fast)) if draw(st.booleans()) else fast
    full, acceleration = draw(st.floats(0.05, 0.5)), draw(st.floats(1.0, 20.0))
    return field(fast, onsets(*sorted(slow)), full_speed_m_s=full, acceleration_m_s2=acceleration)


def test_the_middles_of_the_zones_are_of_the_mechanical_travel() -> None:
    whole = zone_travels(TriggerTravel(0.0, 1.0))
    assert whole == pytest.approx((1 / 15, 0.2, 1 / 3, 7 / 15, 0.6, 11 / 15, 13 / 15, 1.0, 1.0, 1.0))
    assert USUAL[0] == pytest.approx((1 / 15 - 0.05) / 0.93)
    assert zone_travels(TriggerTravel(0.2, 0.5))[:5] == pytest.approx((0.0, 0.0, 4 / 9, 8 / 9, 1.0))


def one_by_one(ahead: TriggerField, travels: tuple[float, ...], other: float, moving: Displacement) -> list[int]:
    """Compute each zone's strength directly by the equation of D_z."""
    full, strengths = ahead.full_speed_m_s, [0]
    advancing = [travel for travel in travels if travel > other]
    for travel in travels:
        u, w = (travel - other) * full, moving.speed_m_s
        needed = (
            moving.displacement_m + u * HORIZON_S + (u * u + max(0.0, w - u) ** 2) / (2.0 * ahead.acceleration_m_s2)
        )
        slow = travel == advancing[0] or u < touch_speed_m_s(full) if advancing else True
        stiff = sum(way <= needed for way in (ahead.slow_m if slow else ahead.fast_m))
        strengths.append(max(strengths[-1], 8 if needed > HORIZON_M else stiff) if u > 0.0 else strengths[-1])
    return strengths[1:]


@given(fields(), TRAVEL, st.builds(Displacement, WAY, st.floats(-0.3, 0.3)), st.floats(0.0, 0.4))
def test_each_zone_is_what_the_equation_gives(
    ahead: TriggerField, other: float, moving: Displacement, away: float
) -> None:
    farther = field(
        onsets(*(min(way + away, HORIZON_M) for way in ahead.fast_m)),
        onsets(*(min(way + away, HORIZON_M) for way in ahead.slow_m)),
        full_speed_m_s=ahead.full_speed_m_s,
        acceleration_m_s2=ahead.acceleration_m_s2,
    )
    found = zone_strengths(farther, HORIZON_M, USUAL, other, moving)
    assert list(found.strengths) == one_by_one(farther, USUAL, other, moving)


def test_what_is_beyond_the_horizon_is_full_and_counted_and_no_sooner() -> None:
    free = field(onsets(0.05))
    # u = 0.25 m/s from zone 7 on: 0.3 * 0.25 + 0.25²/6 = 85.4 mm.
    assert zone_strengths(free, 0.0855, USUAL, 0.0, STILL).beyond_horizon == 0
    beyond = field(onsets(10.0))
    assert zone_strengths(beyond, 0.0855, USUAL, 0.0, STILL) == ((0,) * 10, 0)
    assert zone_strengths(beyond, 0.0853, USUAL, 0.0, STILL) == ((0,) * 7 + (8,) * 3, 3)
    assert zone_strengths(beyond, 0.0853, USUAL, 1.0, Displacement(1.0, 0.0)) == ((0,) * 10, 0)


@pytest.mark.parametrize(("full_speed_m_s", "slow_zones"), [(0.25, 2), (0.1, 2), (0.5, 1), (2.0, 1)])
def test_slow_zones_take_the_slow_ways(full_speed_m_s: float, slow_zones: int) -> None:
    # Slow zones: below 45 mm/s, or below 18 % of full speed if that is less.
    touching = field(onsets(-1.0), onsets(1.0), full_speed_m_s=full_speed_m_s)
    strengths = zone_strengths(touching, 10.0, USUAL, 0.0, STILL).strengths
    assert strengths == (0,) * slow_zones + (8,) * (10 - slow_zones)


def update(**changes: Any) -> StiffnessUpdate:
    l2, r2 = field(onsets(1.0), displacement_m=-0.02), field(onsets(1.0), displacement_m=0.03)
    return StiffnessUpdate(Header(1, 1, 0.0), l2, r2, horizon_m=1.0, rumble=0.0, state="armed", **changes)


def test_what_brings_r2_nearer_takes_l2_away() -> None:
    assert moving_along(update(speed_m_s=0.1), Displacement(0.04, -0.2)) == ((-0.04, 0.2), (0.04, -0.2))


def test_without_our_own_the_robot_sides_displacement_of_each_trigger_counts() -> None:
    assert moving_along(update(speed_m_s=0.1), None) == ((-0.02, -0.1), (0.03, 0.1))
