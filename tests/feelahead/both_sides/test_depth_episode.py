"""Both sides with depth cameras alone: nothing of the scene is modelled for the robot side."""

from pathlib import Path

import numpy as np
import pytest

from feelahead import Episode
from robot_side.depth.camera_settings import DepthCameraSettings
from robot_side.depth.slots import PIECES
from tests.helpers.repository import ROOT

WALL = ROOT / "tests" / "data" / "wall.xml"


def _seen(eyes: str, model: Path = WALL) -> Episode:
    camera = DepthCameraSettings(eyes=eyes, mount_error_m=0.002, rate_hz=15.0)  # type: ignore[arg-type]
    return Episode(model=model, site="tool", seed=3, link="delay 50ms", perception="depth", depth_camera=camera)


@pytest.mark.parametrize("eyes", ["fixed", "wrist"])
def test_a_finger_of_2_newtons_stops_before_a_wall_that_only_a_camera_sees(eyes: str) -> None:
    episode = _seen(eyes).arm().step(6.0, r2_n=2.0)
    assert episode.contacts == ()
    assert 5.0 < episode.summary()["min_distance_mm"] < 40.0


def test_the_same_seed_sees_the_same() -> None:
    first, second = (_seen("fixed").step(1.0).parts.camera.perceive(1.0).box_centers_m for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert np.count_nonzero(first[PIECES:, 2] > -100.0) > 20


def test_a_reset_forgets_what_was_seen() -> None:
    episode = _seen("fixed").step(1.0)
    before = episode.parts.camera.perceive(1.0)
    episode.reset(4)
    fresh = episode.parts.camera.perceive(0.0)
    assert np.count_nonzero(before.box_centers_m[:, 2] > -100.0) > 20
    assert np.count_nonzero(fresh.box_centers_m[:, 2] > -100.0) == 0
