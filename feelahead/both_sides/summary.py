"""One summary of a run from what each side saw of it."""

from collections.abc import Mapping, Sequence
from typing import Any


def merge_summaries(robot: Mapping[str, Any], operator: Mapping[str, Any], errors: Sequence[str]) -> dict[str, Any]:
    """The robot side's summary with the operator side's part of the figures that both sides know.

    Counts that both sides have (`rejected`, `stale`) are added; nested tables are joined.
    """
    merged = _joined(robot, operator)
    merged["errors"] = [*robot.get("errors", []), *operator.get("errors", []), *errors]
    return merged


def _joined(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    joined = dict(one)
    for key, value in other.items():
        if key not in joined:
            joined[key] = value
        elif isinstance(value, Mapping):
            joined[key] = _joined(joined[key], value)
        elif key in ("rejected", "stale"):
            joined[key] += value
    return joined
