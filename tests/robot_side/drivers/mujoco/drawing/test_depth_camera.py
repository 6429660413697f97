"""The simulated depth camera measures what stands where, in pictures of the real renderer."""

from typing import Any

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.drivers.mujoco.depth_cameras.rendered import DepthCamera
from robot_side.drivers.mujoco.drawing.off_screen import BACKENDS
from tests.helpers.python_process import ended
from tests.robot_side.drivers.mujoco.drawing.depth_pictures import (
    BALL_LABEL,
    BALL_M,
    FACE_M,
    FOVY_DEG,
    HEIGHT,
    RADIUS_M,
    SCENE,
    SLANT_RAD,
    TURNED,
    WALL_LABEL,
    WIDTH,
)

MODULE = "tests.robot_side.drivers.mujoco.drawing.depth_pictures"
Found = dict[str, FloatArray]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    path = tmp_path_factory.mktemp("depth") / "pictures.npz"
    for backend in BACKENDS:
        code, _, complaint = ended("-m", MODULE, backend, str(path))
        if code == 0:
            with np.load(path) as pictures:
                return dict(pictures)
        if "AssertionError" in complaint:
            pytest.fail(complaint)
    return pytest.skip(f"nothing can be rendered here: {complaint.splitlines()[-1]}")


def rays(found: Found) -> tuple[FloatArray, FloatArray]:
    """Return how far right and how far down, in m for each m ahead, each pixel's centre looks: (h, w) each."""
    fx, fy, cx, cy = found["pinhole"]
    return (np.arange(WIDTH)[None, :] + 0.5 - cx) / fx, (np.arange(HEIGHT)[:, None] + 0.5 - cy) / fy


@pytest.mark.processes
def test_a_wall_is_measured_along_the_optical_axis_and_marks_are_not_seen(found: Found) -> None:
    assert found["wall_m"].shape == (HEIGHT, WIDTH)
    assert found["wall_m"].dtype == np.float32
    assert np.abs(found["wall_m"] - FACE_M).max() < 0.0002
    assert (found["wall_labels"] == WALL_LABEL).all()


@pytest.mark.processes
def test_a_tilted_plane_is_measured_where_it_is_and_the_sky_nowhere(found: Found) -> None:
    _, down = rays(found)
    # On the ray (1, ., -down) the plane through (FACE_M, 0, 0) has normal (-cos, 0, sin).
    true_m = FACE_M * np.cos(SLANT_RAD) / (np.cos(SLANT_RAD) + np.sin(SLANT_RAD) * down)
    seen = found["slant_m"]
    reached = (true_m > 0.0) & (true_m < 9.0) & (seen > 0.0)
    assert np.abs(seen - true_m)[reached].max() < 0.002
    assert reached.mean() > 0.9
    near = reached & (true_m < 1.0)
    assert np.abs(seen - true_m)[near].max() < 0.0002


@pytest.mark.processes
def test_a_ball_is_seen_where_projection_says_from_a_turned_camera(found: Found) -> None:
    right_m, down_m, ahead_m = TURNED.rotation.T @ (np.array(BALL_M) - TURNED.position_m)
    right, down = rays(found)
    ball = found["ball_labels"] == BALL_LABEL
    # Pixels whose rays pass the centre within the radius.
    along = np.stack(np.broadcast_arrays(right, down, np.ones((HEIGHT, WIDTH))), axis=-1)
    center_m = np.array([right_m, down_m, ahead_m])
    squared = np.einsum("hwi,hwi->hw", along, along)
    nearest = (along @ center_m) / squared
    passing_m = np.linalg.norm(nearest[..., None] * along - center_m, axis=-1)
    assert ball[passing_m < 0.9 * RADIUS_M].all()
    assert not ball[passing_m > 1.1 * RADIUS_M].any()
    true_m = nearest - np.sqrt(np.maximum(RADIUS_M**2 - passing_m**2, 0.0) / squared)
    inside = passing_m < 0.8 * RADIUS_M
    assert inside.sum() > 50
    # A drawn sphere is a polyhedron.
    assert np.abs(found["ball_m"] - true_m)[inside].max() < 0.001


@pytest.mark.processes
def test_the_field_of_view_is_the_pictures_height(found: Found) -> None:
    fx, fy, cx, cy = found["pinhole"]
    assert np.degrees(2.0 * np.arctan(0.5 * HEIGHT / fy)) == pytest.approx(FOVY_DEG)
    assert (fx, cx, cy) == (fy, 0.5 * WIDTH, 0.5 * HEIGHT)


@pytest.mark.processes
def test_nothing_is_measured_beyond_the_range(found: Found) -> None:
    assert not found["near_m"].any()


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"near_m": 0.0}, "near_m = 0.0, far_m = 10.0; valid: 0 < near_m < far_m"),
        ({"far_m": 0.005}, "far_m = 0.005"),
        ({"labels": {0: 256}}, "labels has 256; valid: 1 to 255"),
        ({"labels": {0: 0}}, "labels has 0; valid: 1 to 255"),
    ],
)
def test_impossible_ranges_and_labels_are_refused(wrong: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says.replace("(", r"\(")):
        DepthCamera(mujoco.MjModel.from_xml_string(SCENE), WIDTH, HEIGHT, FOVY_DEG, **wrong)
