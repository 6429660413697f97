import numpy as np
import pytest

from robot_side.depth.free_space import SeenSpace
from robot_side.depth.picture import OwnBody
from robot_side.depth.settings import MapSettings
from robot_side.depth.view import view_of
from tests.robot_side.depth.ray_cast import Box, Camera, looking

AHEAD = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Rotation of a gripper that advances along the world's x"""
CAMERA = Camera(looking((-0.5, 0.0, 0.4), (0.6, 0.0, 0.4)), 160, 120)
NOTHING = np.empty((0, 3))
NO_BODY = OwnBody(np.empty(0, dtype=np.int64), NOTHING, np.empty((0, 3, 3)), NOTHING)
REACH_M = 0.2
WALL = Box((0.9, 0.0, 0.4), (0.1, 2.0, 2.0))


def _seen(*things: Box) -> SeenSpace:
    space = SeenSpace(MapSettings())
    space.see(CAMERA.picture([*things, WALL]).depth_m, view_of(CAMERA.pinhole, CAMERA.pose, CAMERA.errors))
    return space


def test_what_nobody_looked_at_is_unknown() -> None:
    found = SeenSpace(MapSettings()).unknown(np.array([0.2, 0.0, 0.4]), AHEAD, 0.05, 0.2)
    assert found.shares == (1.0,) * 5


def test_what_a_camera_sees_up_to_a_wall_is_known() -> None:
    found = _seen().unknown(np.array([0.3, 0.0, 0.4]), AHEAD, 0.05, 0.2)
    assert found.shares == (0.0,) * 5


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
    assert _seen().unknown(np.array([0.3, 0.0, 0.4]), down, 0.05, 0.15).shares == (0.0,) * 5


def _volume_m3(boxes_m: np.ndarray) -> float:
    return float((boxes_m[:, 1] - boxes_m[:, 0]).prod(axis=1).sum())


def test_the_boxes_of_unseen_space_are_its_cells_each_once() -> None:
    space, at_m = SeenSpace(MapSettings()), np.array([0.2, 0.0, 0.4])
    (whole,) = space.boxes_m(at_m, REACH_M, NOTHING, NO_BODY)
    assert (whole[0] <= at_m - REACH_M + 1e-9).all()
    assert (whole[1] >= at_m + REACH_M - 1e-9).all()
    # The shadow of a thing is a slanted shape: its boxes have the volume of its cells, and share none of it.
    space = _seen(Box((0.2, 0.16, 0.4), (0.02, 0.1, 0.14)))
    boxes_m = space.boxes_m(np.array([0.4, 0.0, 0.4]), REACH_M, NOTHING, NO_BODY)
    assert len(boxes_m) > 1
    lower, upper = boxes_m[:, 0], boxes_m[:, 1]
    shared_m = np.minimum(upper[:, None], upper[None]) - np.maximum(lower[:, None], lower[None])
    shared_m[np.arange(len(boxes_m)), np.arange(len(boxes_m))] = 0.0
    assert (shared_m.min(axis=2) <= 1e-9).all()
    # All of it is to the left.
    assert boxes_m[:, 0, 1].min() >= 0.0
    assert _volume_m3(boxes_m) > 0.1 * _volume_m3(whole[None])
    assert not len(_seen().boxes_m(np.array([0.4, 0.0, 0.4]), REACH_M, NOTHING, NO_BODY))


def test_where_a_surface_or_the_robot_is_no_space_is_unseen() -> None:
    space, at_m = SeenSpace(MapSettings()), np.array([0.2, 0.0, 0.4])
    whole_m3 = _volume_m3(space.boxes_m(at_m, REACH_M, NOTHING, NO_BODY))
    with_surface = space.boxes_m(at_m, REACH_M, np.array([[0.21, 0.01, 0.41], [5.0, 0.0, 0.0]]), NO_BODY)
    assert whole_m3 - _volume_m3(with_surface) == pytest.approx(0.04**3)
    ball = OwnBody(np.array([2]), at_m[None], np.eye(3)[None], np.full((1, 3), 0.05))
    without_body = space.boxes_m(at_m, REACH_M, NOTHING, ball)
    assert _volume_m3(without_body) < whole_m3
    inside = ((without_body[:, 0] < at_m) & (at_m < without_body[:, 1])).all(axis=1)
    assert not inside.any()
