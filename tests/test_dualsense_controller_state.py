"""A controller's state holds nothing that no controller can report."""

from typing import Any

import pytest

from operator_side.dualsense.attachments import Battery, TouchPoint
from operator_side.dualsense.controller_state import Button, ControllerState, TriggerFeedback


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
