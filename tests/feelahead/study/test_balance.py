"""Who replaces one who withdrew, and which orders participants had."""

from dataclasses import replace

from feelahead.study.balance import orders, replacement, whole_square
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
