import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import ConfigurationError
from common.units import parse_duration


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        *(("50ms", 0.05), ("0.2s", 0.2), ("150us", 150e-6), ("2sec", 2.0), ("3msec", 0.003), ("4usec", 4e-6)),
        *(("0s", 0.0), ("0ms", 0.0), (" 50ms ", 0.05), ("+1s", 1.0), ("1.s", 1.0), (".5s", 0.5), ("1e3ms", 1.0)),
    ],
)
def test_a_number_with_its_unit(text: str, seconds: float) -> None:
    assert parse_duration(text, "delay") == pytest.approx(seconds, rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        *("50", "0", "", " ", "ms", "fast", "ms50", "50 ms", "50MS", "50m", "50min", "50ns", "5e", "5ems", "1,5ms"),
        *("1_000ms", "--5ms", "5.5.5ms", "nans", "infs", "0x10ms", "50ms 10ms", "50ms\n10ms", "50ms;"),
    ],
)
def test_what_is_no_duration_is_named_with_its_field(text: str) -> None:
    with pytest.raises(ConfigurationError, match="jitter") as caught:
        parse_duration(text, "jitter")
    assert repr(text) in str(caught.value)
    assert "50ms" in str(caught.value).replace(repr(text), "")


@given(value=st.floats(0.0, 1e12, allow_subnormal=False), unit=st.sampled_from(["us", "ms", "s"]))
def test_every_number_that_python_writes_is_read(value: float, unit: str) -> None:
    scale = {"us": 1e6, "ms": 1e3, "s": 1.0}[unit]
    assert parse_duration(f"{value!r}{unit}", "delay") == pytest.approx(value / scale, rel=1e-14)


@given(text=st.text(max_size=12))
def test_any_text_is_a_duration_or_a_complaint(text: str) -> None:
    try:
        seconds = parse_duration(text, "delay")
    except ConfigurationError:
        return
    assert math.isfinite(seconds)
    assert seconds >= 0.0
