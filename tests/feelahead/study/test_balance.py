"""Who replaces one who withdrew, and which orders participants had."""

from dataclasses import replace

from feelahead.study.balance import next_number, orders, replacement, whole_square
from tests.feelahead.study.made_up import PROTOCOL


def test_who_replaces_one_has_the_same_order_and_a_number_of_their_own() -> None:
    assert whole_square(PROTOCOL) == 4
    assert replacement(PROTOCOL, 3, ()) == 15
    assert replacement(PROTOCOL, 3, {15}) == 19
    assert replacement(PROTOCOL, 15, {15}) == 19
    assert replacement(PROTOCOL, 3, range(13, 996)) == 999
    assert replacement(PROTOCOL, 4, range(13, 1000)) is None
    with_one, without = orders(PROTOCOL, (1, 2, 15, 4)), orders(PROTOCOL, (1, 2, 13, 4))
    assert set(with_one.values()) == {1}
    assert sorted(without.values()) == [0, 1, 1, 2]


def test_a_single_condition_has_one_order() -> None:
    alone = replace(PROTOCOL, conditions={"off": PROTOCOL.conditions["off"]}, contrasts=())
    assert orders(alone, (1, 2, 3)) == {("off",): 3}


def test_the_next_participant_is_planned_or_replaces_one_in_the_same_order() -> None:
    planned = set(range(1, PROTOCOL.participants + 1))
    assert next_number(PROTOCOL, planned - {5}, [3]) == 5
    assert next_number(PROTOCOL, planned, [3, 4]) == 15
    assert next_number(PROTOCOL, planned | {15}, [3, 4]) == 16
    assert next_number(PROTOCOL, planned | {15, 16}, [3, 4, 15]) == 19
    assert next_number(PROTOCOL, planned, []) == PROTOCOL.participants + 1
