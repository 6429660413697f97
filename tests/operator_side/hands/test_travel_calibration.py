import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from operator_side.hands.travel_calibration import LARGEST_REST, StickRest, TriggerTravel

TRIGGERS = st.builds(TriggerTravel, st.floats(0.0, 0.3), st.floats(0.5, 1.0))
STICKS = st.builds(StickRest, st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(0.0, 0.6))
AXES = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), TRIGGERS)
def test_travel_is_monotone_and_in_range(one: float, other: float, trigger: TriggerTravel) -> None:
    low, high = (trigger.travel(raw) for raw in sorted((one, other)))
    assert 0.0 <= low <= high <= 1.0
    assert trigger.travel(trigger.dead_zone) == 0.0
    assert trigger.travel(trigger.saturation) == 1.0


@given(st.floats(0.0, 1.0), TRIGGERS)
def test_raw_undoes_travel(travel: float, trigger: TriggerTravel) -> None:
    assert trigger.dead_zone <= trigger.raw(travel) <= trigger.saturation
    assert trigger.travel(trigger.raw(travel)) == pytest.approx(travel, abs=1e-12)


@pytest.mark.parametrize(
    ("saturation", "zones"), [(1.0, 8), (0.98, 8), (0.94, 8), (0.93, 7), (0.8, 6), (0.5, 4), (0.25, 2)]
)
def test_number_of_zones_that_a_full_pull_reaches(saturation: float, zones: int) -> None:
    assert TriggerTravel(0.01, saturation).reachable_zones == zones


@given(AXES, st.floats(0.0, 0.9))
def test_sticks_keep_their_direction_and_lose_the_dead_zone(raw: tuple[float, float], dead_zone: float) -> None:
    x, y = StickRest(dead_zone=dead_zone).deflection(raw)
    radius = math.hypot(*raw)
    if radius <= dead_zone:
        assert (x, y) == (0.0, 0.0)
        return
    assert math.hypot(x, y) == pytest.approx(min((radius - dead_zone) / (1.0 - dead_zone), 1.0), abs=1e-12)
    assert x * raw[1] == pytest.approx(y * raw[0], abs=1e-12)


@given(STICKS, st.floats(0.0, 2.0 * math.pi), AXES)
def test_a_worn_stick_rests_at_zero_and_reaches_the_end_in_every_direction(
    stick: StickRest, angle: float, raw: tuple[float, float]
) -> None:
    assert stick.deflection((stick.x, stick.y)) == (0.0, 0.0)
    x, y = stick.deflection(raw)
    assert -1.0 <= x <= 1.0
    assert -1.0 <= y <= 1.0
    assert math.hypot(x, y) <= 1.0 + 1e-12
    rim = stick.deflection((math.cos(angle), math.sin(angle)))
    assert math.hypot(*rim) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("x", "y", "dead_zone", "wrong"),
    [
        (0.0, 0.0, -0.01, "dead_zone"),
        (0.0, 0.0, 1.0, "dead_zone"),
        (0.2, 0.0, 0.8, "dead_zone"),  # A span of nothing, and beyond it a stick that points the other way.
        (0.15, -0.15, 0.79, "dead_zone"),
        (0.0, 0.0, math.nan, "dead_zone"),
        (0.0, 1.01 * LARGEST_REST, 0.1, "x"),
        (math.nan, 0.0, 0.1, "x"),
    ],
)
def test_a_dead_zone_that_leaves_no_way_to_push_and_a_rest_too_far_out_are_refused(
    x: float, y: float, dead_zone: float, wrong: str
) -> None:
    with pytest.raises(ValueError, match=f"^{wrong} = "):
        StickRest(x, y, dead_zone)
    assert StickRest(x=0.2, dead_zone=0.79).deflection((1.0, 0.0)) == (1.0, 0.0)
