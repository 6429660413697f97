"""Pictures of the real companion show objects where they are, as their colours tell."""

from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from common.protocol.view_messages import VIEW_NAMES
from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import planar_arm
from tests.robot_side.viewing.picture_taking import HEIGHT, WIDTH, Image, around, picture_taker

pytestmark = pytest.mark.processes


def place_target(scene: Scene, position_m: FloatArray) -> None:
    """Put the target at a position (3,) in the world."""
    [target] = [thing for thing in scene.objects if thing.name == "target"]
    body = scene.model.geom_bodyid[target.geoms[0]]
    first = scene.model.jnt_qposadr[scene.model.body_jntadr[body]]
    scene.data.qpos[first : first + 3] = position_m
    mujoco.mj_forward(scene.model, scene.data)


def is_green(color: FloatArray) -> bool:
    """Return whether a colour (3,) is the target's green, in any light."""
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


@pytest.mark.parametrize("model", ["built-in", "without a camera"])
def test_the_first_person_sees_the_fingers(model: str, tmp_path: Path) -> None:
    scene = load_scene() if model == "built-in" else load_scene(planar_arm(tmp_path), "tcp")
    fingers = scene.robot.gripper_geoms[scene.robot.geom_on_finger]
    scene.model.geom_rgba[fingers] = (0.0, 1.0, 0.0, 1.0)
    place_target(scene, np.array([0.8, 0.0, -5.0]))
    with picture_taker(scene) as taker:
        closed, opened = scene.model.jnt_range[scene.model.dof_jntid[scene.robot.finger_velocities]].T
        apart = []
        for share in (0.2, 1.0):
            scene.data.qpos[scene.robot.finger_positions] = closed + share * (opened - closed)
            image = taker.take("first_person")
            assert 0.003 < green_share(image) < 0.3
            apart.append(np.ptp(np.flatnonzero(_green_columns(image))))
        # Fingers that open go to the sides.
        assert apart[1] > apart[0] + 10


def _green_columns(image: Image) -> np.ndarray:
    red, green, blue = (image[:, :, channel].astype(float) for channel in range(3))
    return np.asarray(((green > 1.4 * red) & (green > 1.4 * blue) & (green > 30.0)).any(axis=0))


def test_a_machine_that_cannot_render_is_told_what_helps(monkeypatch: pytest.MonkeyPatch) -> None:
    # PyOpenGL accepts only this platform, which no machine has.
    monkeypatch.setenv("EGL_PLATFORM", "none")
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    with pytest.raises(pytest.skip.Exception) as skipped, picture_taker(load_scene()) as taker:
        pytest.skip(f"OpenGL is there all the same: {taker.ready}")
    reason = str(skipped.value)
    if "all the same" in reason:
        pytest.skip(reason)
    for said in ("egl: ", "osmesa: ", "apt-get install libegl1"):
        assert said in reason
