"""`bench turn`: both sides as real processes, of this version and of another one."""

import sys

import pytest

from feelahead.lab.questions.turn import Case, _figures, run


@pytest.mark.parametrize(
    ("pacing", "expected"),
    [
        ({"period_ms": 5.0, "turn_cpu_us": {"p99": 1000.0}}, (5.0, 0.2)),
        ({"overruns": 7}, (1.0, None)),  # from before there was a period
    ],
)
def test_figures_are_those_of_the_measured_time(
    pacing: dict[str, object], expected: tuple[float, float | None]
) -> None:
    statuses = [{"overruns": count} for count in (None, 3, 4, 9)]
    found = _figures({"pacing": {"robot": pacing}}, "robot", statuses)
    assert (found["robot_period_ms"], found["robot_p99_of_period"]) == expected
    assert found["robot_missed"] == 6


@pytest.mark.processes
@pytest.mark.parametrize("version", ["this", sys.executable])
def test_real_sides_are_measured(version: str) -> None:
    (found,) = run(Case("aside", version, "5ms", 2.0), 0)
    assert 0.0 < found["robot_share"] < 1.0
    assert 0.0 < found["operator_share"] < 1.0
    assert 0.0 < found["door_share"] < 1.0
    assert found["loop_age_ms"] > 0.0
    # Another version is not told the period.
    assert found["robot_period_ms"] >= (5.0 if version == "this" else 4.0)


@pytest.mark.processes
def test_a_throttled_robot_side_is_set_free_and_ends() -> None:
    (found,) = run(Case("throttled", "this", "4ms", 1.0), 0)
    assert found["robot_period_ms"] >= 4.0
