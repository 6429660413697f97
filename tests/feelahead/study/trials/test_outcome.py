"""What came out of a trial, from the truth that its recording holds."""

from typing import Any

import pytest

from common.recording.topics import Truth
from feelahead.study.trials.outcome import outcome

LIMIT_S = 5.0


def truths(seconds: float, **of_time: Any) -> list[Truth]:
    """Return a truth each 10 ms; `of_time`: functions of the time, by the truth's fields, beside those that rest."""
    usual: dict[str, Any] = {
        "armed": lambda t: t >= 1.0,
        "tool_m": lambda t: (0.1 * t, 0.0, 0.0),
        "obstacle_mm": lambda _: 100.0,
        "held": lambda _: None,
        "hits": lambda _: 0,
        "hit_first": lambda _: None,
        "fastest_hit_mm_s": lambda _: None,
        "impulse_n_s": lambda _: 0.0,
        "placed": lambda _: False,
    }
    times = [0.01 * step for step in range(round(100.0 * seconds) + 1)]
    return [Truth(time_s=t, **{name: value(t) for name, value in (usual | of_time).items()}) for t in times]


def test_a_trial_counts_from_arming_until_the_target_stands() -> None:
    found = outcome(
        truths(
            8.0,
            placed=lambda t: t >= 4.0,
            hits=lambda t: 1 * (t >= 0.5) + 2 * (t >= 2.0) + 5 * (t >= 6.0),
            fastest_hit_mm_s=lambda t: None if t < 0.5 else 40.0 + 10.0 * (t >= 2.0) + 90.0 * (t >= 6.0),
            impulse_n_s=lambda t: 0.25 * max(t - 0.5, 0.0),
            obstacle_mm=lambda t: 4.0 if 2.0 <= t < 2.5 or t > 6.0 else 30.0,
        ),
        LIMIT_S,
    )
    assert found is not None
    assert (found.completed, found.contacts, found.hit, found.fastest_mm_s) == (True, 2, True, 50.0)
    assert found.time_s == pytest.approx(3.0)
    assert found.path_m == pytest.approx(0.3, abs=0.002)
    assert found.impulse_n_s == pytest.approx(0.75, abs=0.01)
    assert found.least_mm == 4.0
    assert found.exposure_s == pytest.approx(0.5, abs=0.011)


def test_a_target_that_stands_too_late_and_one_that_never_does_are_not_completed() -> None:
    for placed_s in (1.0 + LIMIT_S + 0.02, 100.0):
        found = outcome(truths(9.0, placed=lambda t, when=placed_s: t >= when), LIMIT_S)
        assert found is not None
        assert (found.completed, found.time_s, found.hit, found.fastest_mm_s) == (False, None, False, None)
        assert found.path_m == pytest.approx(0.1 * LIMIT_S, abs=0.002)


def test_without_arming_nothing_came_out_and_what_is_far_has_no_distance() -> None:
    assert outcome(truths(3.0, armed=lambda _: False), LIMIT_S) is None
    assert outcome([], LIMIT_S) is None
    found = outcome(truths(3.0, obstacle_mm=lambda _: None), LIMIT_S)
    assert found is not None
    assert (found.least_mm, found.exposure_s) == (None, 0.0)


def test_a_target_that_stands_for_a_moment_has_not_been_placed_yet() -> None:
    found = outcome(truths(9.0, placed=lambda t: 2.0 <= t < 2.45 or t >= 3.0), LIMIT_S)
    assert found is not None
    assert found.time_s == pytest.approx(2.0)
    for placed in (lambda t: 2.0 <= t < 2.45, lambda t: t >= 1.0 + LIMIT_S - 0.45):
        found = outcome(truths(9.0, placed=placed), LIMIT_S)
        assert found is not None
        assert (found.completed, found.time_s) == (False, None)


def test_the_enlargement_counts_while_the_tool_moves_between_arming_and_the_end() -> None:
    moving = truths(8.0, tool_m=lambda t: (0.1 * min(t, 2.0), 0.0, 0.0), placed=lambda t: t >= 4.0)
    times_s = [0.05 * step for step in range(160)]
    at = [(t, 900.0 if not 1.001 < t < 2.001 else 30.0 if t < 1.501 else 50.0) for t in times_s]
    found = outcome(moving, LIMIT_S, at)
    assert found is not None
    assert found.enlargement_mm == pytest.approx(40.0)
    for nothing in ([], [(0.5, 10.0)], [(4.5, 10.0)]):
        found = outcome(moving, LIMIT_S, nothing)
        assert found is not None
        assert found.enlargement_mm is None
