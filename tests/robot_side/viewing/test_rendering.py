"""Pictures of the real companion show objects where they are, as their colours tell."""

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from common.protocol.view_messages import VIEW_NAMES
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.robot_side.viewing.picture_taking import HEIGHT, WIDTH, Image, around, picture_taker

pytestmark = pytest.mark.processes


def place_target(scene: Scene, position_m: FloatArray) -> None:
    [target] = [thing for thing in scene.objects if thing.name == "target"]
    body = scene.model.geom_bodyid[target.geoms[0]]
    first = scene.model.jnt_qposadr[scene.model.body_jntadr[body]]
    scene.data.qpos[first : first + 3] = position_m
    mujoco.mj_forward(scene.model, scene.data)


def is_green(color: FloatArray) -> bool:
    return bool(color[1] > 1.4 * color[0] and color[1] > 1.4 * color[2] and color[1] > 30.0)


def green_share(image: Image) -> float:
    red, green, blue = (image[:, :, channel].astype(float) for channel in range(3))
    return float(((green > 1.4 * red) & (green > 1.4 * blue) & (green > 30.0)).mean())


def test_the_target_is_seen_where_projection_says_wherever_it_stands() -> None:
    scene = load_scene()
    generator = np.random.default_rng(3)
    with picture_taker(scene) as taker:
        for _ in range(5):
            # In front of the open gripper, above everything else.
            center_m = np.array([0.80, 0.0, 0.22]) + generator.uniform(-0.04, 0.04, 3)
            place_target(scene, center_m)
            for view in VIEW_NAMES:
                image = taker.take(view)
                assert image.shape == (HEIGHT, WIDTH, 3)
                assert is_green(around(image, taker.pixel(view, center_m))), view
                assert 0.001 < green_share(image) < 0.1


def test_a_picture_of_half_the_size_shows_the_same() -> None:
    scene = load_scene()
    with picture_taker(scene) as taker:
        whole, half = (taker.take("overview", halved=halved).astype(float) for halved in (False, True))
        assert taker.newest is not None
        assert (taker.newest.width, taker.newest.height) == (WIDTH // 2, HEIGHT // 2)
        means = whole.reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3).mean(axis=(1, 3))
        assert np.abs(half - means).mean() < 3.0
        assert whole.shape == (HEIGHT, WIDTH, 3)
