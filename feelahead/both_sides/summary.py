"""One summary of a run from what each side saw of it."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def merge_summaries(robot: Mapping[str, Any], operator: Mapping[str, Any], errors: Sequence[str]) -> dict[str, Any]:
    """The robot side's summary with the operator side's part of the figures that both sides know.

    Counts that both sides have (`rejected`, `stale`, `dropped_blocks`) are added; nested tables are joined.
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
    """A side's summary; empty when it did not live to write one, which `errors` then says."""
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return {}
    return content
