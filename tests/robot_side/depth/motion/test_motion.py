from collections.abc import Sequence

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.depth.boxes import Boxes
from robot_side.depth.depth_map import DepthMap
from robot_side.depth.picture import CameraPose, DepthErrors
from robot_side.depth.settings import MapSettings
from tests.robot_side.depth.mapping import NOBODY
from tests.robot_side.depth.ray_cast import Ball, Box, Camera, Thing, looking

ERRORS = DepthErrors(growth_per_m=0.0036, least_m=0.17, correlation=0.0168)
ABOVE = Camera(looking((0.1, 0.35, 0.7), (0.5, 0.0, 0.2)), errors=ERRORS)
TABLE = Box((0.5, 0.0, -0.02), (0.8, 0.8, 0.02))
RADIUS_M = 0.04
PERIOD_S = 1.0 / 15.0
BEGINS_S = 0.4


class Scene:
    """A table above which a thing stands, and then moves."""

    def __init__(self, velocity_m_s: Sequence[float], seed: int = 0, level: float = 1.0) -> None:
        self.map, self.random, self.level = DepthMap(MapSettings()), np.random.default_rng(seed), level
        self.velocity_m_s, self.number = np.array(velocity_m_s), 0

    def ball_m(self) -> FloatArray:
        """Return where the ball is in the newest picture."""
        moving_s = max((self.number - 1) * PERIOD_S - BEGINS_S, 0.0)
        there_m: FloatArray = np.array((0.6, 0.0, 0.2)) + moving_s * self.velocity_m_s
        return there_m

    def look(self, pictures: int, things: Sequence[Thing] | None = None, camera: Camera = ABOVE) -> Boxes:
        """Take pictures, of the ball unless things are given; return the map's boxes."""
        for _ in range(pictures):
            self.number += 1
            x, y, z = self.ball_m().tolist()
            seen: Sequence[Thing] = things or (TABLE, Ball((x, y, z), RADIUS_M))
            picture = camera.picture(seen, (self.number - 1) * PERIOD_S, self.random, self.level)
            self.map.integrate(picture, camera.pose, NOBODY, camera.errors)
        return self.map.boxes()


@pytest.mark.parametrize("velocity_m_s", [(-0.06, 0.0, 0.0), (0.0, 0.1, 0.0), (-0.15, -0.1, 0.1)])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_moving_ball_has_its_velocity_and_nothing_else_has_one(velocity_m_s: tuple[float, ...], seed: int) -> None:
    scene = Scene(velocity_m_s, seed)
    boxes = scene.look(18)
    found = scene.map.velocities_m_s(boxes)
    moves, on_ball = found.any(axis=1), np.linalg.norm(boxes.centers_m - scene.ball_m(), axis=1) < RADIUS_M + 0.02
    assert np.count_nonzero(moves & on_ball) >= 10
    assert np.count_nonzero(moves & (boxes.centers_m[:, 2] < 0.02)) == 0
    speed = np.linalg.norm(velocity_m_s)
    assert np.linalg.norm(found[moves].mean(axis=0) - velocity_m_s) < 0.005 + 0.15 * speed


def test_a_moving_balls_front_is_not_late_and_leaves_no_trail() -> None:
    scene = Scene((0.0, 0.1, 0.0))
    boxes = scene.look(24)
    away_m = boxes.centers_m[boxes.centers_m[:, 2] > 0.05] - scene.ball_m()
    # It went 0.1 m; a trail would be beside it. Its front is the mean of no earlier pictures.
    assert np.linalg.norm(away_m, axis=1).max() < RADIUS_M + 0.02
    assert away_m[:, 1].max() > RADIUS_M - 0.012


def test_what_stops_has_no_velocity_half_a_second_later() -> None:
    scene = Scene((-0.1, 0.0, 0.0))
    scene.look(15)
    assert scene.map.velocities_m_s(scene.map.boxes()).any()
    x, y, z = scene.ball_m().tolist()
    boxes = scene.look(12, [TABLE, Ball((x, y, z), RADIUS_M)])
    assert not scene.map.velocities_m_s(boxes).any()


def test_what_is_not_seen_any_more_has_no_velocity() -> None:
    scene = Scene((-0.1, 0.0, 0.0))
    scene.look(15)
    away = Camera(looking((0.1, 0.35, 0.7), (-0.5, 0.9, 0.6)), errors=ERRORS)
    boxes = scene.look(5, camera=away)
    assert not scene.map.velocities_m_s(boxes).any()


@pytest.mark.parametrize("seed", range(3))
def test_nothing_moves_in_a_standing_scene_with_twice_the_noise(seed: int) -> None:
    scene = Scene((0.0, 0.0, 0.0), seed, 2.0)
    camera = Camera(ABOVE.pose, errors=DepthErrors(growth_per_m=0.0072, least_m=0.17, correlation=0.0168))
    for _ in range(20):
        assert not scene.map.velocities_m_s(scene.look(1, camera=camera)).any()


@pytest.mark.parametrize("seed", range(3))
def test_nothing_moves_for_a_moving_camera_with_a_wrong_mount(seed: int) -> None:
    scene, random = Scene((0.0, 0.0, 0.0), seed), np.random.default_rng(seed)
    axis, aside_m = random.standard_normal((2, 3))
    axis, aside_m = axis / np.linalg.norm(axis), 0.006 * aside_m / np.linalg.norm(aside_m)
    x, y, z = np.radians(0.6) * axis
    wrong = np.eye(3) + np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    things: list[Thing] = [TABLE, Ball((0.6, 0.0, 0.2), RADIUS_M), Box((0.7, -0.2, 0.1), (0.05, 0.05, 0.1))]
    for number in range(20):
        # 0.25 m/s ahead, and 0.3 rad/s.
        at_s = number * PERIOD_S
        true = looking((0.05 + 0.25 * at_s, 0.0, 0.35), (1.0 + 0.25 * at_s, 0.3 * at_s, 0.1))
        picture = Camera(true, errors=ERRORS).picture(things, at_s, scene.random)
        believed = CameraPose(true.position_m + true.rotation @ aside_m, true.rotation @ wrong)
        scene.map.integrate(picture, believed, NOBODY, ERRORS)
        assert not scene.map.velocities_m_s(scene.map.boxes()).any()


def test_a_long_thing_that_slides_along_itself_moves_as_its_end_does() -> None:
    scene = Scene((0.0, 0.0, 0.0))
    for number in range(18):
        # A beam whose far end is out of the picture, and whose near end comes at 0.15 m/s.
        end_m = 0.65 - 0.15 * max(number * PERIOD_S - BEGINS_S, 0.0)
        boxes = scene.look(1, [Box((end_m + 0.5, 0.0, 0.2), (0.5, 0.03, 0.03))])
    found = scene.map.velocities_m_s(boxes)
    moving = found[found.any(axis=1)]
    assert len(moving) > 3
    assert -0.19 < moving[:, 0].mean() < -0.09
    assert np.abs(moving[:, 1:].mean(axis=0)).max() < 0.02


def test_a_fast_thing_hides_no_slow_one() -> None:
    scene, speeds_m_s = Scene((-0.06, 0.0, 0.0)), []
    for _ in range(20):
        x, y, z = scene.ball_m().tolist()
        swings_m = (0.4 * PERIOD_S * scene.number) % 0.5
        fast = Ball((0.75, -0.45 + min(swings_m, 0.5 - swings_m), 0.15), 0.05)
        boxes = scene.look(1, [TABLE, Ball((x, y, z), RADIUS_M), fast])
        found = scene.map.velocities_m_s(boxes)
        on_slow = found.any(axis=1) & (np.linalg.norm(boxes.centers_m - scene.ball_m(), axis=1) < RADIUS_M + 0.02)
        speeds_m_s.append(float(np.linalg.norm(found[on_slow].mean(axis=0))) if on_slow.any() else 0.0)
    assert min(speeds_m_s[-8:]) > 0.045


def test_a_motion_ends_though_its_camera_sends_no_more() -> None:
    scene = Scene((-0.1, 0.0, 0.0))
    before = scene.look(15)
    moving = scene.map.velocities_m_s(before).any(axis=1)
    away = Camera(looking((0.1, 0.35, 0.7), (-0.5, 0.9, 0.6)), errors=ERRORS)
    for number in range(15):
        picture = away.picture([TABLE], (scene.number + number) * PERIOD_S, scene.random)
        scene.map.integrate(picture, away.pose, NOBODY, ERRORS, 1)
    after = scene.map.boxes()
    assert moving.any()
    assert not scene.map.velocities_m_s(after).any()
    # What nobody sees any more stays where it was seen, and a quarter of a second on.
    high = after.centers_m[:, 2] > 0.1
    assert after.centers_m[high, 0].min() > before.centers_m[moving, 0].min() - 0.1 * 0.3 - 0.02
    assert scene.map.moved_s == pytest.approx((scene.number + 14) * PERIOD_S)
