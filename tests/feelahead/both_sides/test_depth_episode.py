"""Both sides with depth cameras alone: nothing of the scene is modelled for the robot side."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.reading import open_recording
from feelahead import Episode
from feelahead.recordings.replay_robot import replay_robot
from feelahead.recordings.tables import read_tables
from robot_side.depth.camera_settings import DepthCameraSettings
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import PIECES
from tests.helpers.repository import ROOT

WALL = ROOT / "tests" / "data" / "wall.xml"


def _seen(eyes: str, model: Path = WALL, **settings: Any) -> Episode:
    camera = DepthCameraSettings(eyes=eyes, mount_error_m=0.002, rate_hz=15.0)  # type: ignore[arg-type]
    given = {"model": model, "site": "tool", "seed": 3, "link": "delay 50ms", "depth_camera": camera, **settings}
    return Episode(perception="depth", **given)


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


def test_unseen_space_ahead_is_free_or_has_half_strength_and_a_replay_is_equal(tmp_path: Path) -> None:
    # The camera on the wrist sees nothing nearer than 0.17 m; the wall is 0.32 m away.
    strongest = {}
    for unseen in ("free", "half"):
        mapped = MapSettings(unseen=unseen)
        with _seen("wrist", depth_map=mapped).record(tmp_path / f"{unseen}.mcap") as episode:
            episode.arm().step(1.5, r2_n=1.0)
        strongest[unseen] = int(episode.history.strengths.max())
        recording = open_recording(tmp_path / f"{unseen}.mcap")
        assert recording.headers["robot"]["settings"]["depth_map"]["unseen"] == unseen
        assert read_tables(recording).table("unseen").numbers("left").max() > 0.5
        compared = replay_robot(recording)
        assert compared.made == compared.equal > 50
    assert strongest == {"free": 0, "half": 4}
