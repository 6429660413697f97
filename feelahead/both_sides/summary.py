"""One summary of a run from what each side saw of it."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from common.command.live_view import Value

_OPERATORS_OWN = ("link", "state", "owner", "delay_ms", "L2", "R2", "L2_pulled", "R2_pulled")
"""What both sides tell, and the operator side knows better."""


def both_statuses(robot: Mapping[str, Value], operator: Mapping[str, Value]) -> dict[str, Value]:
    """What both sides know: of the controller and the link what the operator side says, of the rest the robot side."""
    return {**operator, **robot, **{name: operator[name] for name in _OPERATORS_OWN if name in operator}}


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
