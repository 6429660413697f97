"""At most 100 writes in any second, and no release that waits."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.write_bound import MOST_WRITES_PER_S, WriteBound

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=30)


def most_in_a_second(times_s: list[float]) -> int:
    times = np.array(times_s)
    return int((np.searchsorted(times, times + 1.0) - np.arange(len(times))).max()) if len(times) else 0


def test_a_change_after_a_rest_goes_at_once() -> None:
    bound = WriteBound()
    assert all(bound.allows(1.0, releasing=False) for _ in range(10))
    assert not bound.allows(1.0, releasing=False)
    assert bound.allows(1.02, releasing=False)


def test_a_flood_is_held_to_the_bound_and_not_far_below_it() -> None:
    bound = WriteBound()
    allowed = [tick / 1000 for tick in range(5000) if bound.allows(tick / 1000, releasing=False)]
    assert 80 <= most_in_a_second(allowed) <= MOST_WRITES_PER_S
    assert len(allowed) > 400


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
@REPEATABLE
def test_parts_that_are_set_and_released_as_fast_as_can_be_stay_within_it(seed: int, share: float) -> None:
    generator = np.random.default_rng(seed)
    bound, parts, written = WriteBound(), [False] * 3, []
    for tick in range(3000):
        now_s, part = tick / 1000, int(generator.integers(3))
        releasing = parts[part] and bool(generator.random() < share)
        if bound.allows(now_s, releasing=releasing):
            written.append(now_s)
            parts[part] = not releasing
        else:
            assert not releasing
    assert most_in_a_second(written) <= MOST_WRITES_PER_S
