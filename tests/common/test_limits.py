"""Ranges that are declared once, in a field's type hint."""

import math
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta

from common.limits import Finite, Share, check_limits, check_value


@dataclass(frozen=True)
class _Record:
    gap_s: Annotated[float, Meta(gt=0.0, lt=60.0)] = 1.0
    share: Share = 0.5
    count: Annotated[int, Meta(ge=1)] = 1
    late_s: Finite | None = None
    stick: tuple[Annotated[float, Meta(ge=-1.0, le=1.0)], ...] = (0.0, 0.0)
    why: Annotated[str, Meta(max_length=5)] = ""
    free: float = math.inf

    def __post_init__(self) -> None:
        check_limits(self)


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("gap_s", 0.0, "gap_s = 0.0; valid: above 0 and below 60"),
        ("gap_s", 60.0, "gap_s = 60.0; valid: above 0 and below 60"),
        ("gap_s", math.nan, "gap_s = nan; valid: above 0 and below 60"),
        ("share", 1.5, "share = 1.5; valid: 0 to 1"),
        ("count", 0, "count = 0; valid: at least 1"),
        ("count", 1.0, "count = 1.0; valid: a whole number at least 1"),
        ("late_s", math.inf, "late_s = inf; valid: a finite number"),
        ("stick", (0.0, -2.0), r"stick\[1\] = -2.0; valid: -1 to 1"),
        ("why", "longer", "why = 'longer'; valid: 0 to 5 characters"),
        ("share", "0.5", "share = '0.5'; valid: 0 to 1"),
    ],
)
def test_what_is_out_of_range_is_named_with_its_value_and_its_limit(field: str, value: Any, said: str) -> None:
    with pytest.raises(ValueError, match=f"^{said}$"):
        _Record(**{field: value})


def test_what_has_no_range_and_what_is_absent_pass() -> None:
    assert _Record(free=math.nan, late_s=None).late_s is None


@given(st.floats() | st.integers(-100, 100))
def test_the_same_numbers_are_refused_here_and_by_the_decoder(value: float) -> None:
    for hint in (Annotated[float, Meta(gt=0.0, le=60.0)], Finite, Share):
        try:
            msgspec.convert(value, hint)
            decoded = True
        except msgspec.ValidationError:
            decoded = False
        try:
            check_value("value", value, hint)
            checked = True
        except ValueError:
            checked = False
        assert checked == decoded
