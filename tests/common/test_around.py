"""A map of ways is refused for what cannot be, never says a longer way, and tells what differs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.protocol.around import LISTS, PROBES, STEP_M, Around

COUNT = LISTS * PROBES
ways = st.floats(-0.1, 1.0) | st.just(float("inf"))


@pytest.mark.parametrize("full_s", [0.0, -1.0, float("nan"), float("inf"), 101.0])
def test_a_time_that_cannot_be_is_named(full_s: float) -> None:
    with pytest.raises(ValueError, match="full_s"):
        Around(full_s, bytes(COUNT))


@pytest.mark.parametrize("count", [0, COUNT - 1, COUNT + 1])
def test_another_number_of_ways_is_named(count: int) -> None:
    with pytest.raises(ValueError, match=f"steps has {count} bytes; valid: {COUNT}"):
        Around(0.8, bytes(count))


@given(st.lists(ways, min_size=COUNT, max_size=COUNT), st.floats(0.1, 2.0))
def test_no_way_gets_longer_and_by_two_millimetres_at_most_shorter(metres: list[float], horizon_m: float) -> None:
    sent_m = np.array(metres).reshape(LISTS, PROBES)
    told_m, within_m = Around.of(0.8, sent_m).ways_m(horizon_m), np.clip(sent_m, 0.0, horizon_m)
    assert (told_m <= within_m).all()
    assert (told_m >= np.minimum(within_m, 254 * STEP_M) - STEP_M).all()
    np.testing.assert_array_equal(told_m[np.isinf(sent_m)], horizon_m)


def test_it_differs_by_more_than_a_step_or_by_its_time() -> None:
    told = Around.of(0.8, np.full((LISTS, PROBES), 0.1))
    assert not told.differs(told)
    assert not told.differs(Around.of(0.8, np.full((LISTS, PROBES), 0.1 + STEP_M)))
    assert told.differs(Around.of(0.8, np.full((LISTS, PROBES), 0.1 + 2.0 * STEP_M)))
    assert told.differs(Around.of(0.81, np.full((LISTS, PROBES), 0.1)))
