"""Merge both sides' summaries into the summary of the run."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def merge_summaries(robot: Mapping[str, Any], operator: Mapping[str, Any], errors: Sequence[str]) -> dict[str, Any]:
    """Merge both sides' summaries; for a key that both have, take the robot side's value.

    Three counts (`rejected`, `stale`, `dropped_blocks`) are added instead, and nested tables are merged in the same
    way. errors: further errors of the run, which are appended to those of the sides.
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
        elif key in ("rejected", "stale", "dropped_blocks"):
            joined[key] += value
    return joined


def read_summary(path: Path) -> dict[str, Any]:
    """Read a side's summary; return an empty one if the side has not written a valid file."""
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return {}
    return content
