"""A run that does not place the target says where it ended and what kept the arm still."""

from typing import Any

import pytest

from feelahead.both_sides.grasping_trial import Trial, run_trial
from operator_side.people.settings import PersonSettings
from tests.helpers.repository import DATA


@pytest.mark.parametrize(
    ("duration_s", "changed", "said"),
    [
        (1.0, {}, "the arm was never armed"),
        (3.5, {}, "time ran out while advancing without a grasp, the target "),
        (
            3.5,
            {"model": DATA / "empty.xml", "site": "tool"},
            "no object is a target, so there is nothing to advance to",
        ),
    ],
)
def test_the_reason_is_told(duration_s: float, changed: dict[str, Any], said: str) -> None:
    row = run_trial(Trial("table", "", "reacting", PersonSettings(), duration_s, **changed), seed=0)
    assert not row["placed"]
    assert row["why_not_placed"].startswith(said)
