import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.protocol.around import AXES, CHANGE_STEP_S, LISTS, PROBES, STEP_M, Around

INT64 = LISTS * PROBES
CHANGES_S = np.full((6, AXES), 0.05)


@pytest.mark.parametrize(
    ("full_s", "count", "changes", "said"),
    [
        *((full_s, INT64, 2 * AXES, "full_s") for full_s in (0.0, -1.0, float("nan"), float("inf"), 101.0)),
        *((0.8, count, 2 * AXES, f"steps has {count} bytes; valid: {INT64}") for count in (0, INT64 - 1, INT64 + 1)),
        *((0.8, INT64, n, f"changes has {n} bytes; valid: 10 for each of 1 to 32") for n in (0, AXES, 66 * AXES)),
    ],
)
def test_what_cannot_be_is_named(full_s: float, count: int, changes: int, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Around(full_s, bytes(count), bytes(changes))


def test_changes_are_told_to_a_quarter_of_a_millisecond_up_to_8_s() -> None:
    changes_s = np.random.default_rng(4).uniform(-9.0, 9.0, (7, AXES))
    told_s = Around.of(0.8, np.full((LISTS, PROBES), 0.1), changes_s).changes_s()
    np.testing.assert_allclose(told_s, np.clip(changes_s, -8.0, 8.0 - CHANGE_STEP_S), atol=0.5 * CHANGE_STEP_S)


@given(st.lists(st.floats(-0.1, 1.0) | st.just(float("inf")), min_size=INT64, max_size=INT64), st.floats(0.1, 2.0))
def test_no_way_gets_longer_and_by_two_millimetres_at_most_shorter(metres: list[float], horizon_m: float) -> None:
    sent_m = np.array(metres).reshape(LISTS, PROBES)
    told_m, within_m = Around.of(0.8, sent_m, CHANGES_S).onsets_m(horizon_m), np.clip(sent_m, 0.0, horizon_m)
    assert (told_m <= within_m).all()
    assert (told_m >= np.minimum(within_m, 254 * STEP_M) - STEP_M).all()
    np.testing.assert_array_equal(told_m[np.isinf(sent_m)], horizon_m)


def test_it_differs_by_more_than_a_step_or_by_its_time() -> None:
    def all_at(way_m: float, full_s: float = 0.8) -> Around:
        return Around.of(full_s, np.full((LISTS, PROBES), way_m), CHANGES_S)

    told = all_at(0.1)
    assert not told.differs(told)
    assert not told.differs(all_at(0.1 + STEP_M))
    assert told.differs(all_at(0.1 + 2.0 * STEP_M))
    assert told.differs(all_at(0.1, 0.81))
