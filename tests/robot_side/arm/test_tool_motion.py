import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.protocol.messages import Header, MotionCommand
from robot_side.arm.tool_motion import ToolMotionSettings, deflected, tool_motion
from tests.helpers.perceived_scenes import random_rotation

SETTINGS = ToolMotionSettings(trigger_speed_m_s=0.25, stick_speed_m_s=0.1, turn_speed_rad_s=0.5)
RIGHT, DOWN, FORWARD = np.eye(3)
STILL = np.zeros(3)


def command(**hands: Any) -> MotionCommand:
    return MotionCommand(Header(epoch=1, sequence=1, sent_s=0.0), **({"l2": 0.0, "r2": 0.0} | hands))


def motion(**hands: Any) -> tuple[FloatArray, FloatArray]:
    linear, angular = tool_motion(command(**hands), SETTINGS)
    return np.array(linear), np.array(angular)


@pytest.mark.parametrize(
    ("hands", "linear"),
    [
        ({"r2": 1.0}, 0.25 * FORWARD),
        ({"l2": 1.0}, -0.25 * FORWARD),
        ({"r2": 0.4}, 0.1 * FORWARD),
        ({"r2": 1.0, "l2": 0.75}, 0.0625 * FORWARD),
        ({"r2": 1.0, "l2": 1.0}, STILL),
        ({"lateral": (1.0, 0.0)}, 0.1 * RIGHT),
        ({"lateral": (-0.5, 0.0)}, -0.05 * RIGHT),
        ({"lateral": (0.0, 1.0)}, -0.1 * DOWN),
        ({"lateral": (0.0, -0.3)}, 0.03 * DOWN),
    ],
)
def test_triggers_and_left_stick_move_the_tool_without_turning_it(hands: dict[str, Any], linear: FloatArray) -> None:
    found, angular = motion(**hands)
    np.testing.assert_allclose(found, linear, atol=1e-15)
    np.testing.assert_array_equal(angular, STILL)


@pytest.mark.parametrize(
    ("turning", "towards"),
    [((1.0, 0.0), RIGHT), ((-1.0, 0.0), -RIGHT), ((0.0, 1.0), -DOWN), ((0.0, -1.0), DOWN), ((0.6, 0.8), None)],
)
def test_the_right_stick_turns_the_view_the_way_it_is_pushed(
    turning: tuple[float, float], towards: FloatArray | None
) -> None:
    linear, angular = motion(turning=turning)
    np.testing.assert_array_equal(linear, STILL)
    # The tip of the approach axis moves with ω × z.
    tip = np.cross(angular, FORWARD)
    expected = 0.5 * (turning[0] * RIGHT - turning[1] * DOWN) if towards is None else 0.5 * towards
    np.testing.assert_allclose(tip, expected, atol=1e-15)
    assert angular @ FORWARD == 0.0
    assert np.linalg.norm(angular) == pytest.approx(0.5 * math.hypot(*turning))


@settings(derandomize=True, deadline=None, max_examples=60)
@given(right=st.floats(-1.0, 1.0), up=st.floats(-1.0, 1.0), seed=st.integers(0, 1000))
def test_the_stick_leads_where_it_moves_the_gripper(right: float, up: float, seed: int) -> None:
    rotation = random_rotation(np.random.default_rng(seed))
    direction, deflection = deflected((right, up), rotation)
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert direction.flags.c_contiguous
    linear = rotation @ motion(lateral=(right, up))[0]
    if math.hypot(right, up) > 1e-6:
        np.testing.assert_allclose(direction, linear / np.linalg.norm(linear), atol=1e-9)
    assert deflection == min(1.0, math.hypot(right, up))
