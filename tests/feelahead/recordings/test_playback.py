"""A recording is shown at any speed from any moment, and each moment looks the same however one came to it."""

from typing import Any

import pytest

from common.recording.reading import Recording
from feelahead.recordings.playback import Playback
from feelahead.recordings.showing import Seen, seen

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("recorded run")]


@pytest.fixture
def recording(with_pictures: tuple[Recording, list[bytes]]) -> Recording:
    return with_pictures[0]


def newest(shown: list[Seen]) -> dict[str, Seen]:
    return {one.name: one for one in shown}


@pytest.mark.parametrize("speed", [0.25, 1.0, 40.0])
def test_it_takes_as_long_as_the_speed_says_and_leaves_nothing_out(recording: Recording, speed: float) -> None:
    playback = Playback(recording, speed)
    assert playback.advance(1.0) == []
    playback.paused = False
    shown, passed_s = [], 0.0
    while not playback.over:
        shown += playback.advance(0.01)
        passed_s += 0.01
    assert shown == list(seen(recording))
    assert passed_s == pytest.approx(playback.length_s / speed, abs=0.011)
    assert playback.length_s == pytest.approx(shown[-1].time_s, abs=0.01)
    assert playback.paused
    playback.wish({"paused": False, "speed": 1.0})  # from its end it begins anew
    assert playback.state() == {"at_s": 0.0, "length_s": playback.length_s, "speed": 1.0, "paused": False}


@pytest.mark.parametrize("moments_s", [(3.0,), (5.0, 3.0), (1.0, 2.0, 3.0), (0.0, 3.0, 3.0)])
def test_a_moment_looks_the_same_however_one_came_to_it(recording: Recording, moments_s: tuple[float, ...]) -> None:
    playback = Playback(recording)
    shown: list[Seen] = []
    for moment_s in moments_s:
        playback.wish({"at_s": moment_s})
        shown += playback.advance(0.02)
    assert newest(shown) == newest([one for one in seen(recording) if one.time_s <= 3.0])
    playback.wish({"paused": False})
    following = playback.advance(0.5)
    assert following == [one for one in seen(recording) if 3.0 < one.time_s <= 3.5]


@pytest.mark.parametrize("words", [None, {"at_s": -1}, {"at_s": float("nan")}, {"speed": 0}, {"paused": 1}, {"x": 1}])
def test_what_is_no_wish_changes_nothing(recording: Recording, words: Any) -> None:
    playback = Playback(recording)
    before = playback.state()
    playback.wish(words)
    assert playback.state() == before


def test_who_comes_to_look_later_sees_the_moment_at_which_it_rests(recording: Recording) -> None:
    playback = Playback(recording)
    playback.wish({"at_s": 3.0})
    shown = newest(playback.advance(0.02))
    assert playback.advance(0.02) == []
    playback.show_again()
    assert newest(playback.advance(0.02)) == shown
    assert playback.advance(0.02) == []
    playback.wish({"at_s": 1.0})
    playback.show_again()
    assert newest(playback.advance(0.02)) == newest([one for one in seen(recording) if one.time_s <= 1.0])
