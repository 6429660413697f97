import numpy as np
import pytest

from robot_side.depth.own_body import own_pixels
from robot_side.depth.picture import OwnBody
from robot_side.depth.support import normals, supported
from robot_side.depth.view import view_of
from tests.robot_side.depth.ray_cast import Ball, Box, Camera, looking

CAMERA = Camera(looking((0.0, 0.0, 0.4), (0.6, 0.0, 0.4)), 160, 120)
VIEW = view_of(CAMERA.pinhole, CAMERA.pose, CAMERA.errors)
WALL = Box((0.7, 0.0, 0.4), (0.1, 2.0, 2.0))


def test_a_lonely_pixel_has_no_support() -> None:
    depth_m = CAMERA.picture([WALL]).depth_m
    depth_m[50, 60], depth_m[20, 20], depth_m[30, 30] = 0.4, np.nan, 5.0
    kept = supported(depth_m, VIEW)
    wrong = [(50, 60), (20, 20), (30, 30)]
    assert all(kept[place] == 0.0 for place in wrong)
    assert np.count_nonzero(kept == 0.0) == len(wrong)


def test_normals_are_those_of_a_slanted_wall() -> None:
    camera = Camera(looking((0.0, 0.3, 0.7), (0.6, 0.0, 0.4)), 160, 120)
    view = view_of(camera.pinhole, camera.pose, camera.errors)
    found = normals(camera.picture([WALL]).depth_m, view) @ camera.pose.rotation.T
    inner = found[2:-2, 2:-2].reshape(-1, 3)
    np.testing.assert_allclose(inner, np.tile([-1.0, 0.0, 0.0], (len(inner), 1)), atol=1e-3)


@pytest.mark.parametrize(
    ("kind", "size_m", "half_m"),
    [
        (2, (0.05, 0.0, 0.0), 0.05),
        (3, (0.05, 0.1, 0.0), 0.05),
        (4, (0.05, 0.08, 0.06), 0.05),
        (5, (0.05, 0.1, 0.0), 0.05),
        (6, (0.05, 0.07, 0.09), 0.05),
    ],
)
@pytest.mark.parametrize(("gap_m", "own"), [(0.0095, True), (0.0105, False)])
def test_pixels_within_the_padding_of_a_solid_are_the_robots_own(
    kind: int, size_m: tuple[float, float, float], half_m: float, gap_m: float, own: bool
) -> None:
    # The solid ends before the wall, where the camera looks.
    body = OwnBody(np.array([kind]), np.array([[0.6 - gap_m - half_m, 0.0, 0.4]]), np.eye(3)[None], np.array([size_m]))
    mask = own_pixels(CAMERA.picture([WALL]).depth_m, VIEW, body, 0.01)
    assert mask[59:61, 79:81].all() == own
    assert mask.any() == own
    assert not mask[0].any()


def test_a_body_behind_the_camera_or_around_it_is_no_trouble() -> None:
    body = OwnBody(
        np.array([2, 6]),
        np.array([[-0.5, 0.0, 0.4], [0.0, 0.0, 0.4]]),
        np.tile(np.eye(3), (2, 1, 1)),
        np.array([[0.1, 0.0, 0.0], [0.1, 0.1, 0.1]]),
    )
    assert not own_pixels(CAMERA.picture([WALL]).depth_m, VIEW, body, 0.01).any()


@pytest.mark.parametrize(("held", "gap_m"), [(0, 0.1), (1, 0.1), (1, 0.0)])
def test_what_continues_the_surface_of_the_held_object_is_own_and_what_is_behind_its_edge_is_not(
    held: int, gap_m: float
) -> None:
    # Of a ball before a wall, its front alone was known.
    middle = (0.53 - gap_m, 0.0, 0.4)
    known = OwnBody(
        np.array([2]), np.array([[middle[0] - 0.05, 0.0, 0.4]]), np.eye(3)[None], np.full((1, 3), 0.01), held=held
    )
    depth_m = CAMERA.picture([WALL, Ball(middle, 0.05)]).depth_m
    shows_ball = depth_m < CAMERA.picture([WALL]).depth_m - 1e-6
    own = own_pixels(depth_m, VIEW, known, 0.01) > 0
    if not held:
        assert own.sum() < 0.5 * shows_ball.sum()
    else:
        assert own[shows_ball].mean() > 0.99
        # Two pixels around it, as always.
        assert own.sum() < 1.5 * shows_ball.sum()
