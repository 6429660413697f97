import math

import pytest

from robot_side.operators.safety import SafetySettings


def test_the_limits_are_those_of_the_contract() -> None:
    expected = SafetySettings(gap_s=0.1, age_s=0.1, jitter_s=0.08, max_delay_s=2.0, healthy_s=1.0, lease_s=0.9)
    assert SafetySettings() == expected


@pytest.mark.parametrize(
    ("name", "bad"),
    [(name, (0.0, -1.0, 60.0, math.nan, math.inf)) for name in ("gap_s", "age_s", "max_delay_s")]
    + [(name, (-1.0, 60.0, math.nan, math.inf)) for name in ("jitter_s", "healthy_s")]
    + [("lease_s", (0.0, 0.1, 60.0, math.nan))],
)
def test_no_limit_can_be_switched_off_and_a_lease_outlasts_a_gap(name: str, bad: tuple[float, ...]) -> None:
    for value in bad:
        with pytest.raises(ValueError, match=name):
            SafetySettings(**{name: value})
