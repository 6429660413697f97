import numpy as np
import pytest

from common.roles import ROLES, Role
from robot_side.depth.depth_map import DepthMap
from robot_side.depth.picture import SPHERE, CameraPose, DepthErrors, DepthPicture, OwnBody
from robot_side.depth.settings import MapSettings
from tests.robot_side.depth.mapping import NOBODY, Watching, fronts, near
from tests.robot_side.depth.ray_cast import Ball, Box, Camera, Rod, Thing, looking

AHEAD = Camera(looking((0.0, 0.0, 0.4), (0.6, 0.0, 0.4)))
WALL = Box((0.7, 0.0, 0.4), (0.1, 0.6, 0.6))
"""Its front is at x = 0.6 m."""
FAR_WALL = Box((1.0, 0.0, 0.4), (0.1, 2.0, 2.0))
BALL = Ball((0.5, 0.05, 0.4), 0.04)
SETTINGS = MapSettings(lower_m=(0.0, -0.5, -0.1), upper_m=(0.95, 0.5, 0.9))


def _watching(seed: int | None = 0) -> Watching:
    return Watching(DepthMap(SETTINGS), None if seed is None else np.random.default_rng(seed))


@pytest.mark.parametrize("seed", [None, 0, 1])
def test_a_wall_is_flat_and_where_it_is(seed: int | None) -> None:
    watching = _watching(seed)
    watching.look(AHEAD, [WALL], 8)
    boxes = watching.map.boxes()
    large = boxes.half_sizes_m[:, :2].min(axis=1) > 0.02
    assert np.abs(fronts(boxes)[large][..., 0] - 0.6).max() < 0.001
    area = 4.0 * boxes.half_sizes_m[:, 0] * boxes.half_sizes_m[:, 1]
    assert area[large].sum() > 0.9 * area.sum()
    # Towards the camera, no box reaches further than the noise of a few pixels.
    assert fronts(boxes)[..., 0].min() > 0.6 - 4.0 * AHEAD.errors.sd_m(0.6)


def test_a_still_scene_keeps_its_boxes() -> None:
    watching = _watching()
    watching.look(AHEAD, [WALL, BALL], 20)
    changed = [watching.look(AHEAD, [WALL, BALL]).changed for _ in range(10)]
    assert np.mean(changed) < 0.02 * len(watching.map.boxes().ids)


def test_a_thing_appears_in_its_second_picture() -> None:
    watching = _watching()
    watching.look(AHEAD, [FAR_WALL], 5)
    watching.look(AHEAD, [FAR_WALL, BALL])
    assert near(watching.map.boxes(), BALL.center_m, 0.06) == 0
    watching.look(AHEAD, [FAR_WALL, BALL])
    assert near(watching.map.boxes(), BALL.center_m, 0.06) > 10


def test_a_thing_is_gone_three_pictures_after_something_is_measured_behind_it() -> None:
    watching = _watching()
    watching.look(AHEAD, [FAR_WALL, BALL], 10)
    found = [watching.look(AHEAD, [FAR_WALL]) for _ in range(3)]
    assert near(watching.map.boxes(), BALL.center_m, 0.06) == 0
    assert sum(one.contradicted for one in found) > 10


def test_a_thing_is_gone_within_two_seconds_if_nothing_is_measured_where_it_was() -> None:
    watching = _watching()
    watching.look(AHEAD, [BALL], 10)
    watching.look(AHEAD, [WALL_BESIDE], 45)
    assert near(watching.map.boxes(), BALL.center_m, 0.06) > 10
    found = [watching.look(AHEAD, [WALL_BESIDE]) for _ in range(15)]
    assert near(watching.map.boxes(), BALL.center_m, 0.06) == 0
    assert sum(one.unanswered for one in found) > 10


WALL_BESIDE = Box((0.7, 0.5, 0.4), (0.1, 0.2, 0.6))


def test_time_without_pictures_takes_nothing_away() -> None:
    watching = _watching()
    watching.look(AHEAD, [BALL], 10)
    watching.look(AHEAD, [WALL_BESIDE])
    watching.time_s += 3600.0
    watching.look(AHEAD, [WALL_BESIDE])
    assert near(watching.map.boxes(), BALL.center_m, 0.06) > 10


def test_a_wall_out_of_view_stays() -> None:
    watching = _watching()
    watching.look(AHEAD, [WALL, BALL], 5)
    before = len(watching.map.boxes().ids)
    aside = Camera(looking((0.0, 0.0, 0.4), (-0.6, 0.0, 0.4)))
    watching.look(aside, [WALL], 90)
    watching.time_s += 600.0
    watching.look(aside, [WALL], 10)
    assert len(watching.map.boxes().ids) == before


def test_a_wall_that_is_too_near_stays() -> None:
    watching = _watching()
    for distance in np.linspace(0.5, 0.05, 40):
        watching.look(Camera(looking((0.6 - distance, 0.0, 0.4), (0.7, 0.0, 0.4))), [WALL])
    near_camera = Camera(looking((0.55, 0.0, 0.4), (0.7, 0.0, 0.4)))
    watching.look(near_camera, [WALL], 120)
    boxes = watching.map.boxes()
    ahead = np.abs(fronts(boxes)[..., 1:] - [0.0, 0.4]).min(axis=1).max(axis=1) < 0.08
    assert ahead.any()
    assert np.abs(fronts(boxes)[ahead][..., 0] - 0.6).max() < 0.002


def test_what_another_camera_sees_shares_the_map() -> None:
    watching = _watching()
    watching.look(AHEAD, [FAR_WALL, BALL], 3)
    alone = near(watching.map.boxes(), BALL.center_m, 0.06)
    beside = Camera(looking((0.5, -0.5, 0.4), (0.5, 0.05, 0.4)))
    for _ in range(3):
        picture = beside.picture([FAR_WALL, BALL], watching.time_s)
        watching.map.integrate(picture, beside.pose, NOBODY, beside.errors, camera=1)
    assert near(watching.map.boxes(), BALL.center_m, 0.06) > alone


def test_labels_give_roles() -> None:
    depth_map, camera = DepthMap(SETTINGS), AHEAD
    things: list[Thing] = [WALL, BALL]
    depth_m = camera.depth_m(things).astype(np.float32)
    labels = (depth_m < 0.55).astype(np.uint8) * 7
    for k in range(3):
        picture = DepthPicture(k / 30.0, depth_m, camera.pinhole, labels, {7: Role.TARGET})
        depth_map.integrate(picture, camera.pose, NOBODY, camera.errors)
    boxes = depth_map.boxes()
    on_ball = np.linalg.norm(boxes.centers_m - BALL.center_m, axis=1) < 0.05
    assert (boxes.roles[on_ball] == ROLES.index(Role.TARGET)).all()
    assert (boxes.roles[~on_ball] == -1).all()


def _arm(shift_m: float = 0.0) -> tuple[list[Thing], OwnBody]:
    things: list[Thing] = [Box((0.35, 0.0, 0.4), (0.02, 0.05, 0.02)), Ball((0.4, -0.1, 0.4), 0.04)]
    body = OwnBody(
        np.array([6, 2]),
        np.array([[0.35, 0.0, 0.4], [0.4, -0.1, 0.4]]) + shift_m / np.sqrt(3.0),
        np.tile(np.eye(3), (2, 1, 1)),
        np.array([[0.02, 0.05, 0.02], [0.04, 0.0, 0.0]]),
    )
    return things, body


def test_the_robots_own_body_leaves_nothing() -> None:
    watching, (things, body) = _watching(), _arm()
    found = watching.look(AHEAD, [*things, WALL], 5, body)
    assert found.own_pixels > 1000
    assert fronts(watching.map.boxes())[..., 0].min() > 0.58


def test_an_error_of_the_body_beyond_the_padding_shows() -> None:
    watching, (things, body) = _watching(), _arm(0.006)
    watching.look(AHEAD, [*things, WALL], 5, body)
    # 6 mm are within the padding of 10 mm.
    assert (fronts(watching.map.boxes())[..., 0].min(axis=1) < 0.5).sum() == 0
    watching, (things, body) = _watching(), _arm(0.03)
    watching.look(AHEAD, [*things, WALL], 5, body)
    assert (fronts(watching.map.boxes())[..., 0].min(axis=1) < 0.5).sum() > 0


def test_the_own_body_contradicts_nothing_that_it_hides() -> None:
    watching, (things, body) = _watching(), _arm()
    watching.look(AHEAD, [WALL, BALL], 5)
    before = near(watching.map.boxes(), BALL.center_m, 0.06)
    watching.look(AHEAD, [*things, WALL, BALL], 30, body)
    assert near(watching.map.boxes(), BALL.center_m, 0.06) >= 0.9 * before


@pytest.mark.parametrize("aim", [(0.0, 0.0, 0.4), (0.1, 0.2, 0.55)])
def test_a_thin_rod_is_not_late(aim: tuple[float, float, float]) -> None:
    rod = Rod(0.4, 0.0, 0.0025)
    watching = _watching()
    watching.look(Camera(looking(aim, (0.4, 0.0, 0.4))), [rod], 10)
    boxes = watching.map.boxes()
    towards = np.array([aim[0] - 0.4, aim[1]])
    towards /= np.hypot(*towards)
    here = (np.abs(fronts(boxes)[..., 2] - 0.4) < 0.05).any(axis=1)
    reach = ((fronts(boxes)[here][..., :2] - [rod.x_m, rod.y_m]) @ towards).max(axis=1)
    late = rod.radius_m - reach
    assert late.max() < 2.0 * AHEAD.errors.sd_m(0.5)
    assert late.min() > -0.006
    side = np.abs((fronts(boxes)[here][..., :2] - [rod.x_m, rod.y_m]) @ [-towards[1], towards[0]]).max()
    assert side < rod.radius_m + 0.005


def test_boxes_do_not_stick_out_beside_a_plate() -> None:
    plate = Box((0.55, 0.013, 0.417), (0.05, 0.083, 0.071))
    watching = _watching()
    watching.look(AHEAD, [plate], 10)
    corners = fronts(watching.map.boxes())
    assert len(corners) < 40
    assert np.abs(corners[..., 1] - 0.013).max() < 0.083 + 0.005
    assert np.abs(corners[..., 2] - 0.417).max() < 0.071 + 0.005


def test_a_picture_without_range_has_only_holes() -> None:
    depth_map = DepthMap(SETTINGS)
    picture = AHEAD.picture([WALL])
    found = depth_map.integrate(picture, AHEAD.pose, NOBODY, DepthErrors(0.004, least_m=1.0, most_m=2.0))
    assert (found.holes, found.made, found.boxes) == (picture.depth_m.size, 0, 0)


def test_each_box_has_the_least_error_of_its_pixels() -> None:
    watching = _watching(None)
    watching.look(AHEAD, [WALL], 3)
    far = watching.map.boxes().sds_m
    watching.look(Camera(CameraPose(np.array([0.3, 0.0, 0.4]), AHEAD.pose.rotation)), [WALL], 8)
    near_m = watching.map.boxes().sds_m
    assert far.min() == pytest.approx(AHEAD.errors.sd_m(0.6), rel=0.02)
    assert near_m.min() == pytest.approx(AHEAD.errors.sd_m(0.3), rel=0.02)


def test_what_one_camera_sees_behind_a_post_stays_although_the_other_sees_only_the_post() -> None:
    watching = _watching()
    post = Box((0.4, 0.0, 0.4), (0.02, 0.08, 0.5))
    aside = Camera(looking((0.4, 0.45, 0.4), (0.6, 0.0, 0.4)))
    for _ in range(6):
        for number, camera in enumerate((AHEAD, aside)):
            picture = camera.picture([WALL, post], watching.time_s, np.random.default_rng(number))
            watching.map.integrate(picture, camera.pose, NOBODY, camera.errors, number)
        watching.time_s += 0.033
    # Straight behind the post, where the camera ahead sees the post alone.
    assert near(watching.map.boxes(), (0.61, 0.0, 0.4), 0.09) > 0


def test_what_a_model_explains_is_taken_out_of_the_map_also_what_was_there_before() -> None:
    watching = _watching()
    watching.look(AHEAD, [FAR_WALL, BALL], 5)
    assert near(watching.map.boxes(), BALL.center_m, 0.06) > 10
    ball = np.array([BALL.center_m]), np.eye(3)[None], np.full((1, 3), BALL.radius_m)
    watching.look(AHEAD, [FAR_WALL, BALL], 2, OwnBody(np.array([SPHERE]), *ball, models=1))
    assert near(watching.map.boxes(), BALL.center_m, 0.06) == 0
    # What is behind it stays, and without the model the ball comes back.
    assert near(watching.map.boxes(), (0.9, 0.3, 0.4), 0.2) > 0
    watching.look(AHEAD, [FAR_WALL, BALL], 2)
    assert near(watching.map.boxes(), BALL.center_m, 0.06) > 10
