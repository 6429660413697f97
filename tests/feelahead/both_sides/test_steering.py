"""Both sides in virtual time: what a driver chooses for steering moves the arm as chosen."""

import numpy as np
import pytest

from common.arrays import FloatArray
from common.protocol.messages import Vector2
from feelahead.both_sides.loopback import Loopback, LoopbackSettings
from operator_side.hands.choices import StickFrame
from operator_side.hands.travel_calibration import StickRest
from operator_side.people.pulling_hands import Hands, PullingHands
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

pytestmark = pytest.mark.long
RIGHT, UP = (1.0, 0.0), (0.0, 1.0)


def moved_mm(stick: Vector2, frame: StickFrame) -> tuple[FloatArray, Loopback]:
    """Return how far a stick moves the tool in the table scene, with a delay of 50 ms each way."""
    operator = OperatorSettings(link="delay 50ms", stick_frame=frame)
    hands = Hands(left_stick=StickRest().raw(stick))
    run = Loopback(
        LoopbackSettings(RobotSettings(link="delay 50ms"), operator),
        person=lambda device: PullingHands(device, lambda since_s: hands if since_s < 0.4 else Hands()),
    )
    run.run_until(1.0)
    assert run.robot.newest is not None
    start_m = run.robot.newest[1].pose.tool_position_m
    run.run_until(3.0)
    return 1e3 * (run.robot.newest[1].pose.tool_position_m - start_m), run


@pytest.mark.parametrize(("stick", "frame"), [(RIGHT, "base"), (UP, "base"), (RIGHT, "camera"), (UP, "camera")])
def test_a_stick_moves_the_tool_as_its_frame_says(stick: Vector2, frame: StickFrame) -> None:
    moved, run = moved_mm(stick, frame)
    frames = run.robot.parts.frames
    assert frames is not None
    assert run.robot.newest is not None
    chosen, tool = frames.base if frame == "base" else frames.camera, run.robot.newest[1].pose.tool_rotation
    axis = chosen.right if stick == RIGHT else chosen.up
    across = axis - (axis @ tool[:, 2]) * tool[:, 2]
    length_mm = float(np.linalg.norm(moved))
    assert 20.0 < length_mm < 50.0
    # The tool points as the base does; the camera looks down steeply, so up in the picture is tilted onto the tool.
    if np.linalg.norm(across) > 0.2:
        assert moved @ across > 0.8 * length_mm * np.linalg.norm(across)
    assert abs(moved @ tool[:, 2]) < 0.05 * length_mm
