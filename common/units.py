"""Parsers of values with units (`50ms`, `10mbit`, `1%`), which return seconds, bits per second and shares."""

import math
import re

from common.errors import ConfigurationError

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_PER_SECOND = {"us": 1e6, "ms": 1e3, "s": 1.0, "usec": 1e6, "msec": 1e3, "sec": 1.0}
"""Divisors that convert a unit to seconds. 800 / 1e6 is rounded once, like 0.0008; 800 × 1e-6 would be rounded
twice."""
_BITS_PER_SECOND = {
    f"{prefix}{unit}": factor * bits
    for prefix, factor in {
        "": 1.0,
        "k": 1e3,
        "m": 1e6,
        "g": 1e9,
        "t": 1e12,
        "ki": 2.0**10,
        "mi": 2.0**20,
        "gi": 2.0**30,
        "ti": 2.0**40,
    }.items()
    for unit, bits in {"bit": 1.0, "bps": 8.0}.items()
}
"""Factors that convert tc's units to bits per second: `bit` counts bits, `bps` bytes; k is 1000, ki 1024."""


def parse_duration(text: str, field: str) -> float:
    """Parse a duration such as `50ms`, `0.2s` or `150us`; return seconds.

    A number without a unit is refused, because netem takes it for microseconds and people for milliseconds. Raises
    ConfigurationError, which names `field` and `text`.
    """
    match = re.fullmatch(rf"({_NUMBER})([a-z]+)", text.strip())
    if match is None or match[2] not in _PER_SECOND:
        raise ConfigurationError(f"{field}: {text!r} is no duration; valid: a number with us, ms or s, such as 50ms")
    seconds = float(match[1]) / _PER_SECOND[match[2]]
    if not math.isfinite(seconds) or seconds < 0.0:
        raise ConfigurationError(f"{field}: {text!r} is negative or not finite; valid: 0s or longer")
    return seconds


def parse_rate(text: str, field: str) -> float:
    """Parse a rate such as `10mbit`, `500kbit` or `2mbps` (bytes, as in tc); return bits per second.

    Raises ConfigurationError, which names `field` and `text`, also for a number without a unit.
    """
    match = re.fullmatch(rf"({_NUMBER})([a-zA-Z]+)", text.strip())
    if match is None or match[2].lower() not in _BITS_PER_SECOND:
        raise ConfigurationError(
            f"{field}: {text!r} is no rate; valid: a number with bit, kbit, mbit, gbit or, in bytes, bps, kbps, mbps, "
            "gbps, such as 10mbit"
        )
    bits_per_second = float(match[1]) * _BITS_PER_SECOND[match[2].lower()]
    if not math.isfinite(bits_per_second) or bits_per_second <= 0.0:
        raise ConfigurationError(f"{field}: {text!r} is not above 0 or not finite; valid: more than 0bit")
    return bits_per_second


def parse_share(text: str, field: str) -> float:
    """Parse a percentage from `0%` to `100%`; return a share. ConfigurationError names `field` and `text`."""
    match = re.fullmatch(rf"({_NUMBER})%", text.strip())
    share = float(match[1]) / 100.0 if match is not None else math.nan
    if not 0.0 <= share <= 1.0:
        raise ConfigurationError(f"{field}: {text!r} is no percentage; valid: 0% to 100%")
    return share
