import numpy as np
import pytest

import feelahead.main
from common.errors import ConfigurationError
from feelahead.benchmarks.felt.approaching import Approached
from feelahead.benchmarks.felt.errors import errors
from feelahead.benchmarks.felt.ladders import ladders
from feelahead.benchmarks.felt.measuring import Found
from feelahead.benchmarks.felt.replay import WAYS, Replayed
from feelahead.benchmarks.felt.tables import report
from feelahead.benchmarks.felt.turning import Turned

HORIZON_M = 0.5


def replayed(how: Turned, *rows_m: float) -> Replayed:
    """The same way of every kind in each tick."""
    ways = np.repeat(np.array(rows_m)[:, None], len(WAYS), axis=1)
    return Replayed(how, np.arange(1.0, len(ways) + 1.0), ways, np.full(len(ways), HORIZON_M), 246, 200.0)


def test_too_late_is_above_0_and_what_neither_feels_does_not_count() -> None:
    found = errors(
        replayed(Turned(), 0.101, 0.2, 0.3, HORIZON_M, HORIZON_M),
        replayed(Turned(), 0.1, 0.204, 0.3, HORIZON_M, 0.49),
        "fast first",
    )
    assert found.count == 8
    assert found.mean_mm == pytest.approx((1.0 - 4.0 + 0.0 + 10.0) / 4.0)
    assert found.earliest_mm == pytest.approx(-4.0)
    assert found.latest_mm == pytest.approx(10.0)
    assert found.p95_mm == pytest.approx(10.0)


def test_nothing_felt_is_no_error() -> None:
    nothing = replayed(Turned(), HORIZON_M, HORIZON_M)
    assert errors(nothing, nothing, "slow full").count == 0


def test_a_report_has_a_row_for_each_setting_and_compares_it_with_the_finest() -> None:
    rungs = ladders(quick=True)
    found = Found()
    found.replayed["demo"] = [
        replayed(how, *(0.1 + 0.001 * place for _ in range(3)))
        for rung in rungs.values()
        for place, how in enumerate(reversed(rung))
    ]
    found.approached = [
        Approached(Turned("one"), "wall", 3.0, "contact", 31.9, -0.02),
        Approached(Turned("one"), "wall", 2.0, "stopped", None, 14.4),
    ]
    made = report(found, rungs)
    assert len(made.tables[0].rows) == sum(len(rung) for rung in rungs.values())
    assert made.value("felt", "ours", "demo", "demo, field rate 50 Hz", "fast full mean") == pytest.approx(4.0)
    assert made.value("felt", "ours", "demo", "demo, field rate 1000 Hz", "slow first latest") == 0.0
    assert made.value("felt", "ours", "demo", "demo, field rate 100 Hz (as it is)", "p50") == 2.0
    assert made.tables[1].rows == [("one (as it is)", "hits at 31.9", "stopped, 14.4 mm off")]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [(["--seed", "-1"], "--seed -1"), (["--equality", "--csv", "out.csv"], "--equality with --csv")],
)
def test_bad_input_is_named(arguments: list[str], named: str) -> None:
    with pytest.raises(ConfigurationError, match=named):
        feelahead.main.command(["bench", "felt", *arguments])
