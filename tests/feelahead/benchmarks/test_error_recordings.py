"""Whole recordings: what the built-in arm does, and that the same seed gives the same figures."""

from functools import cache

import numpy as np
import pytest

from feelahead.benchmarks.error.prediction import Judged
from feelahead.benchmarks.error.recordings import Job, judge_all, judge_job, link_spec
from feelahead.benchmarks.error.spread import by_compensation, over

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("error")]

BELL = Job("bell", link_spec(200), 0, 2.5)
ON_OFF = Job("on_off", link_spec(200), 0, 2.5)


@cache
def recorded(job: Job) -> Judged:
    found = judge_job(job)
    assert isinstance(found, Judged), found
    return found


@pytest.mark.parametrize("job", [BELL, ON_OFF], ids=["bell", "on_off"])
def test_own_commands_miss_a_tenth_of_what_speed_times_delay_misses(job: Job) -> None:
    judged = [recorded(job)]
    own, eq_8 = over(judged, by_compensation("operator")), over(judged, by_compensation("robot"))
    assert own.count == eq_8.count > 200
    assert own.p99_mm < 6.0
    assert own.p99_mm < 0.15 * eq_8.p99_mm
    assert own.sd_mm < 2.0


def test_the_same_seed_gives_the_same_figures() -> None:
    again = judge_job(BELL)
    assert isinstance(again, Judged)
    for kind, errors_m in recorded(BELL).errors_m.items():
        np.testing.assert_array_equal(again.errors_m[kind], errors_m)
    other = judge_job(Job("bell", link_spec(200), 1, 2.5))
    assert isinstance(other, Judged)
    assert not np.array_equal(other.errors_m["operator"], recorded(BELL).errors_m["operator"])


def test_without_a_delay_nothing_is_missed() -> None:
    found = judge_job(Job("on_off", link_spec(0), 0, 1.0))
    assert isinstance(found, Judged)
    assert np.abs(found.errors_m["operator"]).max() < 0.1e-3


@pytest.mark.processes
def test_several_processes_give_what_one_gives_in_the_same_order() -> None:
    steps: list[int] = []
    judged, failed = judge_all([BELL, ON_OFF], 2, lambda: steps.append(1))
    assert failed == []
    assert len(steps) == 2
    for one, job in zip(judged, (BELL, ON_OFF), strict=True):
        np.testing.assert_array_equal(one.errors_m["operator"], recorded(job).errors_m["operator"])
