"""Frames of the sticks: the angle fits right and up best, and it is what a person expects in examples."""

import math

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.stick_frames import Frame
from tests.helpers.perceived_scenes import random_rotation

X, Y, Z = np.eye(3)
FRAME = Frame(right=-Y, up=Z, ahead=X)


def tool(right: FloatArray, ahead: FloatArray) -> FloatArray:
    return np.column_stack([right, np.cross(ahead, right), ahead])


def moves(rotation: FloatArray, turn_rad: float, stick: tuple[float, float], *, mirrored: bool = False) -> FloatArray:
    """Return the direction in which a stick moves the tool, as the operator side turns it."""
    right, up = stick[0], -stick[1] if mirrored else stick[1]
    x, y = right * math.cos(turn_rad) - up * math.sin(turn_rad), right * math.sin(turn_rad) + up * math.cos(turn_rad)
    moved: FloatArray = x * rotation[:, 0] - y * rotation[:, 1]
    return moved


def test_a_tool_that_faces_its_viewer_moves_as_it_is_seen() -> None:
    rotation = tool(Y, -X)
    assert (FRAME.faces(rotation), FRAME.faces(tool(-Y, X))) == (True, False)
    turn_rad = FRAME.turn_rad(rotation, mirrored=True)
    assert moves(rotation, turn_rad, (1.0, 0.0), mirrored=True) == pytest.approx(-Y, abs=1e-12)
    assert moves(rotation, turn_rad, (0.0, 1.0), mirrored=True) == pytest.approx(Z, abs=1e-12)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_no_other_angle_fits_better(seed: int, mirrored: bool) -> None:
    rotation = random_rotation(np.random.default_rng(seed))

    def fit(turn_rad: float) -> float:
        right, up = (moves(rotation, turn_rad, stick, mirrored=mirrored) for stick in ((1.0, 0.0), (0.0, 1.0)))
        return float(right @ FRAME.right + up @ FRAME.up)

    best = max(map(fit, np.linspace(-math.pi, math.pi, 721)))
    assert fit(FRAME.turn_rad(rotation, mirrored=mirrored)) >= best
