"""Human units at the edge (`50ms`, `10mbit`), SI inside."""

import math
import re

from common.errors import ConfigurationError

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_SECONDS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "usec": 1e-6, "msec": 1e-3, "sec": 1.0}


def parse_duration(text: str, field: str) -> float:
    """Read a duration such as `50ms`, `0.2s` or `150us`; seconds.

    A bare number has no unit and is refused, because netem reads it as microseconds and people as
    milliseconds. ConfigurationError names `field` and `text`.
    """
    match = re.fullmatch(rf"({_NUMBER})([a-z]+)", text.strip())
    if match is None or match[2] not in _SECONDS:
        raise ConfigurationError(f"{field}: {text!r} is no duration; valid: a number with us, ms or s, such as 50ms")
    seconds = float(match[1]) * _SECONDS[match[2]]
    if not math.isfinite(seconds) or seconds < 0.0:
        raise ConfigurationError(f"{field}: {text!r} is negative or not finite; valid: 0s or longer")
    return seconds
