"""What a person is shown, from a core in virtual time."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.protocol.messages import StiffnessUpdate, TriggerField
from common.reaction import HORIZON_S
from operator_side.dualsense.reports.controller_state import SENSED_TRAVEL, Button
from operator_side.facts import OperatorFacts
from operator_side.facts_of_core import Surroundings, operator_facts
from operator_side.feel.commands_under_way import Displacement
from operator_side.feel.zones import needed_m
from operator_side.hands.travel_calibration import TriggerTravel
from tests.operator_side.operator_bench import Bench

FULL_M_S, A_M_S2, DISPLACED_M = 0.25, 2.0, 0.03


def field(first_m: float, displacement_m: float, stiffness: float) -> TriggerField:
    ways = tuple(first_m + 0.005 * step for step in range(8))
    return TriggerField(ways, ways, FULL_M_S, A_M_S2, displacement_m, stiffness)  # type: ignore[arg-type]


def facts_of(bench: Bench, surroundings: Surroundings | None = None) -> OperatorFacts:
    facts = operator_facts(
        bench.side, bench.side.status(bench.now_s), surroundings or Surroundings(hands="controller"), bench.now_s
    )
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(facts), type=OperatorFacts) == facts
    return facts


def felt_bench(*, swap_sides: bool = False, l2: float = 0.0, r2: float = 0.0) -> Bench:
    """Nothing moves yet; the robot side reckons with the delay."""
    bench = Bench(compensation="robot", swap_sides=swap_sides)
    bench.hands(Button.L1, l2=l2, r2=r2)
    bench.feel_field(
        StiffnessUpdate(
            bench.robot.stamp(bench.now_s),
            l2=field(0.2, -DISPLACED_M, 0.25),
            r2=field(0.04, DISPLACED_M, 0.75),
            speed_m_s=0.0,
            horizon_m=0.5,
            rumble=0.5,
            state="armed",
        )
    )
    return bench


def test_before_anything_has_come_nothing_is_invented() -> None:
    facts = facts_of(Bench())
    assert (facts.r2.travel, facts.r2.raw, facts.r2.stiffness, facts.r2.needed_m, facts.r2.fast_m) == (None,) * 4 + (
        (),
    )
    assert (facts.r2.zones, facts.r2.meets, facts.r2.free) == ((0,) * 10, 0, 1.0)
    assert (facts.field_age_ms, facts.round_trip_ms, facts.to_operator.mean_ms) == (
        None,
        None,
        facts.to_operator.p99_ms,
    )


def test_each_trigger_is_told_as_it_is_written_and_where_the_finger_is() -> None:
    bench = felt_bench(r2=0.8)
    facts = facts_of(bench)
    assert facts.r2.raw == pytest.approx(0.8, abs=0.01)
    assert facts.r2.travel == pytest.approx(TriggerTravel().travel(0.8), abs=0.01)
    assert facts.r2.zones == bench.side.haptics.written.r2.zone_strengths  # type: ignore[union-attr]
    assert facts.r2.zones[0] == 0 < facts.r2.zones[9]
    assert facts.r2.meets == facts.r2.zones[int(10 * SENSED_TRAVEL * 0.8)]
    assert (facts.l2.stiffness, facts.r2.stiffness) == (0.25, 0.75)
    assert facts.r2.fast_m[0] == 0.04
    assert facts.rumble == pytest.approx(0.5, abs=0.01)
    assert (facts.field_age_ms, facts.advancing) == (0.0, "R2")


def test_the_first_stiff_zone_is_where_it_says_it_ends_to_be_free() -> None:
    facts = facts_of(felt_bench())
    first = next(zone for zone, strength in enumerate(facts.r2.zones) if strength)
    assert facts.r2.free == pytest.approx(TriggerTravel().travel(first / 10 / SENSED_TRAVEL))


def test_what_is_needed_is_d_at_the_present_travel() -> None:
    facts = facts_of(felt_bench(r2=1.0))
    assert facts.r2.needed_m == pytest.approx(DISPLACED_M + FULL_M_S * HORIZON_S + FULL_M_S**2 / (2 * A_M_S2))
    assert facts.l2.needed_m == pytest.approx(-DISPLACED_M)


def test_swapped_sides_are_told_by_the_controllers_own_names() -> None:
    plain, swapped = (
        facts_of(felt_bench(r2=1.0)),
        facts_of(felt_bench(l2=1.0, swap_sides=True), Surroundings(hands="controller", swap_sides=True)),
    )
    assert swapped.advancing == "L2"
    assert swapped.l2 == plain.r2
    assert swapped.r2 == plain.l2


@given(
    st.floats(0.0, 1.0), st.floats(-0.1, 0.3), st.floats(-0.3, 0.3), st.floats(0.0, 0.5), st.sampled_from([0.0, 0.3])
)
def test_more_is_needed_the_more_is_pulled_and_never_less_than_what_is_under_way(
    travel: float, way_m: float, speed_m_s: float, more: float, horizon_s: float
) -> None:
    moving, along = Displacement(way_m, speed_m_s), field(0.1, 0.0, 0.0)
    here_m = needed_m(along, travel * FULL_M_S, moving, horizon_s)
    assert here_m >= way_m
    if travel * FULL_M_S >= speed_m_s:
        assert needed_m(along, (travel + more) * FULL_M_S, moving, horizon_s) >= here_m


def test_delays_are_those_of_the_last_second() -> None:
    bench = felt_bench()
    facts = facts_of(bench, Surroundings(hands="person", asked_to_robot="delay 5ms"))
    assert facts.offset_s == 0.0
    assert (facts.to_robot.asked, facts.hands) == ("delay 5ms", "person")
    bench.side.link.recent.clear()
    for number in range(100):
        bench.side.link.recent.append((bench.now_s - 1.5 + 0.01 * number, 9.9, None))
    for number in range(100):
        bench.side.link.recent.append((bench.now_s, 0.001 * number, 0.2))
    facts = facts_of(bench)
    there, back = facts.to_operator, facts.to_robot
    assert back.mean_ms == pytest.approx(200.0 - 49.5)
    assert there.p99_ms == pytest.approx(9900.0)
    assert there.newest_ms == pytest.approx(99.0)
    bench.now_s += 1.1
    assert facts_of(bench).to_operator.mean_ms is None


def test_half_of_the_round_trip_stands_for_a_way_that_nobody_knows() -> None:
    bench = felt_bench()
    bench.side.link.recent.clear()
    bench.side.link.recent.append((bench.now_s, None, 0.2))
    facts = facts_of(bench)
    assert facts.to_operator.mean_ms is None
    assert facts.to_robot.mean_ms == pytest.approx(100.0)
