"""The topics of a recording and what stands in each message, as JSON schemas that Foxglove plots by."""

from typing import Any, Final

ENCODING: Final = "x-feelahead"
"""Of what is ours and binary: blocks of entries (common/recording/entries.py), and view payloads."""
PROFILE: Final = "feelahead"
FORMAT: Final = 1
"""Grows with a change that an older reader would misread."""
BINARY: Final = {"/robot/inputs": "feelahead.Block", "/operator/inputs": "feelahead.Block", "/view": "feelahead.View"}
"""Topics of bytes, with the names of their schemas."""

_NUMBER: Final = {"type": "number"}
_MAYBE: Final = {"type": ["number", "null"]}
_TEXT: Final = {"type": "string"}
_STAMPS: Final = {"time_s": _NUMBER, "sequence": {"type": "integer"}, "sent_s": _NUMBER}
_MESSAGE: Final = {**_STAMPS, "side": _TEXT, "age_ms": _MAYBE, "loop_age_ms": _MAYBE}
_NUMBERS: Final = {"type": "array", "items": _NUMBER}


def _object(title: str, properties: dict[str, Any]) -> dict[str, Any]:
    return {"title": f"feelahead.{title}", "type": "object", "properties": properties}


_FIELD: Final = {
    "type": "object",
    "properties": {
        "fast_m": _NUMBERS,
        "slow_m": _NUMBERS,
        "full_speed_m_s": _NUMBER,
        "acceleration_m_s2": _NUMBER,
        "displacement_m": _NUMBER,
        "stiffness": _NUMBER,
    },
}
_TERM_NAMES: Final = (
    "sigma_m",
    "mean_m",
    "kinematic_sd_m",
    "camera_sd_m",
    "prediction_sd_m",
    "quantile",
    "loop_age_s",
    "displacement_m",
)
_TERMS: Final = {"type": "object", "properties": dict.fromkeys(_TERM_NAMES, _NUMBER)}
SCHEMAS: Final[dict[str, dict[str, Any]]] = {
    "/stiffness": _object(
        "Stiffness",
        _MESSAGE
        | {
            "l2": _FIELD,
            "r2": _FIELD,
            "speed_m_s": _NUMBER,
            "horizon_m": _NUMBER,
            "rumble": _NUMBER,
            "state": _TEXT,
            "told_m_s": _MAYBE,
        },
    ),
    "/command": _object(
        "Command",
        _MESSAGE
        | {
            "l2": _NUMBER,
            "r2": _NUMBER,
            "lateral": _NUMBERS,
            "turning": _NUMBERS,
            "gripper": _NUMBER,
            **{name: {"type": "boolean"} for name in ("run", "arm", "emergency_stop", "next_target", "hand_over")},
            "token": {"type": "integer"},
            "compensation": _TEXT,
        },
    ),
    "/ages": _object(
        "Ages", {"time_s": _NUMBER, "side": _TEXT, "command_ms": _MAYBE, "field_ms": _MAYBE, "frame_ms": _MAYBE}
    ),
    "/enlargement": _object("Enlargement", _STAMPS | {"l2": _TERMS, "r2": _TERMS}),
    "/overlap": _object(
        "Overlap",
        _STAMPS
        | {
            "objects": {
                "type": "array",
                "items": {
                    "type": "object",
                    "properties": {"object": _TEXT, "l2_mm3": _NUMBER, "r2_mm3": _NUMBER},
                },
            }
        },
    ),
    "/telemetry": _object(
        "Telemetry",
        _STAMPS
        | {
            "state": _TEXT,
            "tool_position_m": _NUMBERS,
            "tool_speed_m_s": _NUMBER,
            "target": {"type": ["string", "null"]},
            "gripper_opening_m": _NUMBER,
            "holding": {"type": "boolean"},
            "enlargement_m": _NUMBER,
            "l2": _NUMBER,
            "r2": _NUMBER,
        },
    ),
    "/robot/status": _object("RobotStatus", {"time_s": _NUMBER}),
    "/operator/status": _object("OperatorStatus", {"time_s": _NUMBER}),
    "/operator/facts": _object("OperatorFacts", {"now_s": _NUMBER}),
}
"""What tools plot by; a message may hold more."""
