from typing import Any

from feelahead.both_sides.summary import merge_summaries

ROBOT: dict[str, Any] = {
    "ticks": 10_000,
    "messages": {"stiffness_sent": 990, "motion_received": 240, "rejected": 3, "stale": 5},
    "delay_ms": {"to_robot": {"mean": 50.0, "p99": 71.0}},
    "applied_age_ms": {"to_robot": {"mean": 48.0}},
    "stops": [{"time_s": 3.0, "reason": "no command for 100 ms"}],
    "task": {"lifted_mm": 100.0},
    "min_distance_mm": None,
    "errors": ["robot: out of paper"],
}
OPERATOR: dict[str, Any] = {
    "messages": {"stiffness_received": 980, "motion_sent": 250, "rejected": 1, "stale": 20},
    "delay_ms": {"to_operator": {"mean": 20.0}, "round_trip": {"mean": 70.0}},
    "applied_age_ms": {"to_operator": {"mean": 19.0}},
    "errors": ["operator: asleep"],
}


def test_what_each_side_alone_knows_stands_beside_the_others() -> None:
    merged = merge_summaries(ROBOT, OPERATOR, [])
    assert merged["ticks"] == 10_000
    assert merged["min_distance_mm"] is None
    assert merged["stops"] == ROBOT["stops"]
    assert merged["task"] == {"lifted_mm": 100.0}
    assert merged["delay_ms"] == {
        "to_robot": {"mean": 50.0, "p99": 71.0},
        "to_operator": {"mean": 20.0},
        "round_trip": {"mean": 70.0},
    }
    assert merged["applied_age_ms"] == {"to_robot": {"mean": 48.0}, "to_operator": {"mean": 19.0}}
    # Counts that both have are added.
    assert merged["messages"] == {
        "stiffness_sent": 990,
        "stiffness_received": 980,
        "motion_sent": 250,
        "motion_received": 240,
        "rejected": 4,
        "stale": 25,
    }


def test_a_side_that_left_no_summary_takes_nothing_from_the_other_and_every_error_is_kept() -> None:
    alone = merge_summaries(ROBOT, {}, ["the operator side failed"])
    assert alone == ROBOT | {"errors": ["robot: out of paper", "the operator side failed"]}
    assert merge_summaries({}, OPERATOR, []) == OPERATOR
    assert merge_summaries(ROBOT, OPERATOR, [])["errors"] == ["robot: out of paper", "operator: asleep"]
