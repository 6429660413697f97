from dataclasses import astuple

import numpy as np
import pytest

from robot_side.depth.free_space import SeenSpace
from robot_side.depth.settings import MapSettings
from robot_side.depth.view import view_of
from tests.robot_side.depth.ray_cast import Box, Camera, looking

AHEAD = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Rotation of a gripper that advances along the world's x"""
CAMERA = Camera(looking((-0.5, 0.0, 0.4), (0.6, 0.0, 0.4)), 160, 120)
WALL = Box((0.9, 0.0, 0.4), (0.1, 2.0, 2.0))


def _seen(*things: Box) -> SeenSpace:
    space = SeenSpace(MapSettings())
    space.see(CAMERA.picture([*things, WALL]).depth_m, view_of(CAMERA.pinhole, CAMERA.pose, CAMERA.errors))
    return space


def test_what_nobody_looked_at_is_unknown() -> None:
    found = SeenSpace(MapSettings()).unknown(np.array([0.2, 0.0, 0.4]), AHEAD, 0.05, 0.2)
    assert astuple(found) == (1.0,) * 5


def test_what_a_camera_sees_up_to_a_wall_is_known() -> None:
    found = _seen().unknown(np.array([0.3, 0.0, 0.4]), AHEAD, 0.05, 0.2)
    assert astuple(found) == (0.0,) * 5


def test_the_shadow_of_a_thing_is_unknown() -> None:
    # It hides what is to the left of the gripper: the world's y.
    found = _seen(Box((0.2, 0.16, 0.4), (0.02, 0.1, 0.14))).unknown(np.array([0.4, 0.0, 0.4]), AHEAD, 0.04, 0.2)
    # Of four layers, the shadow leaves out the nearest.
    assert found.left == 0.75
    assert found.right == 0.0


def test_behind_the_wall_and_beyond_the_region_is_unknown() -> None:
    space = _seen()
    assert space.unknown(np.array([0.7, 0.0, 0.4]), AHEAD, 0.05, 0.3).ahead == pytest.approx(0.8, abs=0.2)
    assert space.unknown(np.array([0.3, 0.0, 0.95]), AHEAD, 0.04, 0.3).up == 1.0


def test_a_gripper_that_points_down_has_directions_too() -> None:
    down = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
    assert astuple(_seen().unknown(np.array([0.3, 0.0, 0.4]), down, 0.05, 0.15)) == (0.0,) * 5
