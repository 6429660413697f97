"""Both sides with depth cameras alone: nothing of the scene is modelled for the robot side."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.recording.reading import open_recording
from feelahead import Episode
from feelahead.recordings.replay_robot import replay_robot
from feelahead.recordings.tables import read_tables
from robot_side.depth.camera_settings import DepthCameraSettings
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import PIECES
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.repository import ROOT

WALL = ROOT / "tests" / "data" / "wall.xml"


def _seen(eyes: str, model: Path = WALL, known: tuple[str, ...] = (), **settings: Any) -> Episode:
    camera = DepthCameraSettings(eyes=eyes, mount_error_m=0.002, rate_hz=15.0, known=known)  # type: ignore[arg-type]
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


def _with_crate(folder: Path, place_m: tuple[float, float, float]) -> Path:
    """Return a model of the wall with a crate of 60 x 60 x 100 mm before it."""
    crate = '<geom name="crate" type="box" size="0.03 0.03 0.05" pos="{} {} {}"/>'.format(*place_m)
    text = WALL.read_text().replace('"arm.xml"', f'"{WALL.with_name("arm.xml")}"')
    model = folder / "crate.xml"
    model.write_text(text.replace("</worldbody>", f"{crate}</worldbody>"))
    return model


def _surfaces_m(frame: PerceivedObjects) -> FloatArray:
    centers_m = frame.box_centers_m[PIECES : PIECES + frame.names.index("surface 2048")]
    used: FloatArray = centers_m[centers_m[:, 2] > -100.0]
    return used


@pytest.mark.parametrize("known", [(), ("crate",)])
def test_a_known_model_is_felt_once_and_so_is_the_wall_behind_it(known: tuple[str, ...], tmp_path: Path) -> None:
    at_m = (0.76, 0.0, 0.2)
    with _seen("fixed", _with_crate(tmp_path, at_m), known).record(tmp_path / "run.mcap") as episode:
        frame = episode.step(1.0).parts.camera.perceive(1.0)
        assert (frame.names[-1] == "crate") is bool(known)
        places_m = _surfaces_m(frame)
        on_crate = (np.abs(places_m - at_m) < (0.045, 0.045, 0.065)).all(axis=1)
        # The wall is there in both cases; the crate as surfaces only without its model.
        assert np.count_nonzero(places_m[:, 0] > 0.87) > 50
        assert bool(on_crate.any()) is not bool(known)
        if known:
            assert frame.box_centers_m[-1] == pytest.approx(at_m, abs=0.015)
        episode.arm().step(4.0, r2_n=2.0)
    assert episode.contacts == ()
    assert 0.005 < episode.summary()["min_distance_mm"] * 1e-3 < 0.04
    # It stopped before the crate, not before the wall 0.1 m behind it.
    assert episode.tool_position_m[0] < at_m[0]
    compared = replay_robot(open_recording(tmp_path / "run.mcap"))
    assert compared.made == compared.equal > 50


def test_the_wall_behind_a_known_model_beside_the_way_is_felt(tmp_path: Path) -> None:
    model = _with_crate(tmp_path, (0.76, 0.0, 0.35))
    episode = _seen("fixed", model, ("crate",)).arm().step(6.0, r2_n=2.0)
    assert episode.contacts == ()
    assert 0.8 < episode.tool_position_m[0] < 0.87


def test_a_known_model_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"depth_camera\.known = 'mug'; valid: wall"):
        _seen("fixed", known=("mug",)).step(0.1)
