"""A controller's state holds nothing that no controller can report."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.dualsense.reports.attachments import Battery, Connections, TouchPoint
from operator_side.dualsense.reports.controller_state import Button, ControllerState, TriggerFeedback


@pytest.mark.parametrize(
    ("fields", "name"),
    [
        ({"left_stick": (1.1, 0.0)}, "left_stick"),
        ({"right_stick": (0.0, float("nan"))}, "right_stick"),
        ({"l2": -0.1}, "l2"),
        ({"r2": float("nan")}, "r2"),
        ({"sequence": 256}, "sequence"),
        ({"sensor_time_s": 2000.0}, "sensor_time_s"),
        ({"pressed": frozenset({Button.UP, Button.DOWN})}, "pressed"),
        ({"pressed": frozenset({Button.LEFT, Button.RIGHT})}, "pressed"),
        ({"gyro_rad_s": (0.0, float("nan"), 0.0)}, "gyro_rad_s"),
        ({"acceleration_m_s2": (0.0, 0.0)}, "acceleration_m_s2"),
        ({"touches": (TouchPoint(0, 0, 0),) * 3}, "touches"),
        ({"device_timestamp": 2**32}, "device_timestamp"),
        ({"left_stick": (0.0, 0.0, 0.0)}, "left_stick = "),
        ({"right_stick": ("x", 0.0)}, "right_stick = "),
        ({"l2": "x"}, "l2 = 'x'"),
        ({"sequence": 0.5}, "sequence = 0.5"),
        ({"sensor_time_s": "x"}, "sensor_time_s = "),
        ({"l2_feedback": 3}, "l2_feedback = 3; valid: a TriggerFeedback"),
        ({"r2_feedback": 3}, "r2_feedback = 3"),
        ({"gyro_rad_s": (0.0, "x", 0.0)}, "gyro_rad_s = .*finite"),
        ({"touches": (5,)}, "touches = 5; valid: a TouchPoint"),
        ({"battery": 0.5}, "battery = 0.5; valid: a Battery"),
        ({"connections": 1}, "connections = 1; valid: a Connections"),
        ({"device_timestamp": 0.5}, "device_timestamp = 0.5"),
    ],
)
def test_impossible_states_are_refused(fields: dict[str, Any], name: str) -> None:
    with pytest.raises(ValueError, match=name):
        ControllerState(**fields)


def test_impossible_parts_are_refused() -> None:
    with pytest.raises(ValueError, match="identity = 128"):
        TouchPoint(128, 0, 0)
    with pytest.raises(ValueError, match="x = -1"):
        TouchPoint(0, -1, 0)
    with pytest.raises(ValueError, match="y = 4096"):
        TouchPoint(0, 0, 4096)
    with pytest.raises(ValueError, match=r"fraction = 1\.1"):
        Battery(1.1)
    with pytest.raises(ValueError, match="status = 16"):
        TriggerFeedback(status=16)


@pytest.mark.parametrize(
    ("kind", "fields", "message"),
    [
        (TouchPoint, {"identity": 0.5, "x": 0, "y": 0}, "identity = 0.5; valid: an integer from 0 to 127"),
        (TouchPoint, {"identity": 0, "x": 0.5, "y": 0}, "x = 0.5"),
        (TouchPoint, {"identity": 0, "x": 0, "y": "x"}, "y = 'x'"),
        (Battery, {"fraction": "x"}, "fraction = 'x'; valid: 0 to 1"),
        (Battery, {"fraction": 0.5, "state": "x"}, "state = 'x'; valid: a BatteryState"),
        (Connections, {"muted": 0.5}, "muted = 0.5; valid: a bool"),
        (TriggerFeedback, {"stop_location": 0.5}, "stop_location = 0.5; valid: an integer from 0 to 15"),
    ],
)
def test_what_no_report_could_hold_is_refused(kind: type, fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        kind(**fields)


@given(st.integers(-300, 300), st.integers(-9000, 9000), st.integers(-9000, 9000))
@settings(derandomize=True, deadline=None)
def test_a_touch_point_holds_exactly_what_its_bits_hold(identity: int, x: int, y: int) -> None:
    if 0 <= identity < 128 and 0 <= x < 4096 and 0 <= y < 4096:
        TouchPoint(identity, x, y)
    else:
        with pytest.raises(ValueError, match=r"(identity|x|y) = "):
            TouchPoint(identity, x, y)
