from hypothesis import given
from hypothesis import strategies as st

from common.sockets.traffic import BURST_S, Traffic

STEP_S = 0.1


@given(st.lists(st.integers(0, 100), min_size=1, max_size=200))
def test_a_steady_sender_within_the_budget_is_never_over(sizes: list[int]) -> None:
    traffic, received = Traffic(1000.0), 0
    for step, size in enumerate(sizes):
        received += size
        assert traffic.over({1: received}, STEP_S * step) == ([], {1: size})


def test_what_waited_may_come_at_once_and_more_may_not() -> None:
    traffic, most = Traffic(1000.0), round(1000.0 * BURST_S)
    assert traffic.over({1: most, 2: most + 1}, 0.0)[0] == [2]
    assert traffic.over({1: most + 100}, STEP_S)[0] == []
    assert traffic.over({1: most + 301}, 2.0 * STEP_S)[0] == [1]


def test_another_connection_begins_anew() -> None:
    traffic = Traffic(1000.0)
    assert traffic.over({1: 3000}, 0.0) == ([], {1: 3000})
    assert traffic.over({2: 3000}, 0.0) == ([], {2: 3000})
