"""Balance of the plans, over as many participants as the square has rows."""

from collections import Counter
from itertools import pairwise, product
from math import gcd

from hypothesis import given
from hypothesis import strategies as st

from feelahead.study.protocol import Protocol
from feelahead.study.schedule import schedule, williams
from tests.feelahead.study.protocols import protocol

SCENES = ("table", "wall", "slot", "shelf")


@st.composite
def protocols(draw: st.DrawFn) -> Protocol:
    return protocol(
        conditions={f"c{number}": {} for number in range(draw(st.integers(1, 6)))},
        delays_ms=[50.0 * number for number in range(draw(st.integers(1, 4)))],
        scenes=SCENES[: draw(st.integers(1, 3))],
        trials=draw(st.integers(1, 3)),
        seed=draw(st.integers(0, 2**32 - 1)),
        practice=None,
    )


def _blocks(of: Protocol, participant: int) -> list[str]:
    return list(dict.fromkeys(planned.condition for planned in schedule(of, participant)))


def _delays(of: Protocol, participant: int, condition: str) -> list[float]:
    mine = (planned.delay_ms for planned in schedule(of, participant) if planned.condition == condition)
    return list(dict.fromkeys(mine))


@given(protocols())
def test_each_condition_stands_equally_often_at_each_place_and_after_each_other(of: Protocol) -> None:
    number = len(of.conditions)
    orders = [_blocks(of, participant) for participant in range(1, len(williams(number)) + 1)]
    places = Counter((place, name) for order in orders for place, name in enumerate(order))
    assert places.keys() == set(product(range(number), of.conditions))
    assert len(set(places.values())) == 1
    follows = Counter(pair for order in orders for pair in pairwise(order))
    assert follows.keys() == {(one, other) for one, other in product(of.conditions, repeat=2) if one != other}
    assert len(set(follows.values())) <= 1


@given(protocols())
def test_under_each_condition_each_delay_stands_equally_often_at_each_place_and_after_each_other(of: Protocol) -> None:
    rows, delays = len(williams(len(of.conditions))), williams(len(of.delays_ms))
    few = rows * len(delays) // gcd(len(of.conditions), len(delays))
    for condition in of.conditions:
        orders = [_delays(of, participant, condition) for participant in range(1, few + 1)]
        places = Counter((place, delay) for order in orders for place, delay in enumerate(order))
        assert places.keys() == set(product(range(len(of.delays_ms)), of.delays_ms))
        assert len(set(places.values())) == 1
        follows = Counter(pair for order in orders for pair in pairwise(order))
        assert len(follows) == len(of.delays_ms) * (len(of.delays_ms) - 1)
        assert len(set(follows.values())) <= 1


@given(protocols())
def test_over_more_participants_the_delays_orders_do_not_depend_on_the_place_of_the_condition(of: Protocol) -> None:
    rows, delays = len(williams(len(of.conditions))), len(williams(len(of.delays_ms)))
    met = Counter(
        (condition, _blocks(of, participant).index(condition), tuple(_delays(of, participant, condition)))
        for participant in range(1, rows * delays + 1)
        for condition in of.conditions
    )
    assert len(met) == len(of.conditions) ** 2 * len({*williams(len(of.delays_ms))})
    assert len(set(met.values())) == 1


@given(protocols(), st.integers(1, 999))
def test_each_cell_comes_once_in_blocks_of_one_condition(of: Protocol, participant: int) -> None:
    plan = schedule(of, participant)
    assert [planned.number for planned in plan] == list(range(1, len(plan) + 1))
    assert [planned.block for planned in plan] == sorted(planned.block for planned in plan)
    assert len({(planned.block, planned.condition) for planned in plan}) == len(of.conditions)
    cells = Counter((planned.condition, planned.delay_ms, planned.scene, planned.repeat) for planned in plan)
    assert cells == Counter(product(of.conditions, of.delays_ms, of.scenes, range(1, of.trials + 1)))


@given(protocols(), st.integers(1, 999))
def test_seeds_are_pairs_over_conditions_and_differ_otherwise(of: Protocol, participant: int) -> None:
    plan = (*schedule(of, participant), *schedule(of, participant % 999 + 1))
    whose = [participant] * (len(plan) // 2) + [0] * (len(plan) // 2)
    by_cell = {
        (who, planned.delay_ms, planned.scene, planned.repeat): planned.seed
        for who, planned in zip(whose, plan, strict=True)
    }
    assert all(
        by_cell[who, planned.delay_ms, planned.scene, planned.repeat] == planned.seed
        for who, planned in zip(whose, plan, strict=True)
    )
    assert len({*by_cell.values()}) == len(by_cell)


def test_the_order_within_a_delay_is_drawn_anew_for_each_participant_and_block() -> None:
    of = protocol(scenes=SCENES, trials=3)
    orders = {
        tuple((planned.scene, planned.repeat) for planned in plan if (planned.block, planned.delay_ms) == (block, 0.0))
        for plan in (schedule(of, participant) for participant in (1, 2, 3))
        for block in (1, 2)
    }
    assert len(orders) == 6
