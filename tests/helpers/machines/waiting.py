"""Waiting for conditions in real time."""

import time
from collections.abc import Callable
from typing import TypeVar

LIMIT_S = 600.0
"""Time limit in seconds that a machine of a tenth of the speed keeps, whose processor is taken away for seconds"""
AFTER_A_FAILURE_S = 60.0
"""Limit once a wait has failed: a cause that breaks many tests must not take this time of each"""
Value = TypeVar("Value")

_LOOK_S = 0.02
_failures: list[str] = []


def wait_until(
    what: str,
    condition: Callable[[], Value | None],
    limit_s: float = LIMIT_S,
    instead: Callable[[], object] | None = None,
) -> Value:
    """Return the first value of `condition` that is not None or False.

    After `limit_s`, raise AssertionError: it names the event `what`, and the state that `instead` returns.
    """
    limit_s = min(limit_s, AFTER_A_FAILURE_S) if _failures else limit_s
    end_s = time.monotonic() + limit_s
    while time.monotonic() < end_s:
        value = condition()
        if value is not None and value is not False:
            return value
        time.sleep(_LOOK_S)
    _failures.append(what)
    raise AssertionError(f"not within {limit_s:g} s: {what}" + ("" if instead is None else f"; instead: {instead()}"))


def stays(otherwise: str, condition: Callable[[], bool], for_s: float = 1.0) -> None:
    """Assert that `condition` holds for `for_s`; otherwise fail with the text `otherwise`."""
    end_s = time.monotonic() + for_s
    while time.monotonic() < end_s:
        assert condition(), otherwise
        time.sleep(_LOOK_S)
