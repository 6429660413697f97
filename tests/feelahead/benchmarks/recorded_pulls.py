"""One steady pull, recorded once, among the objects of any frozen scene: for the tests of the coverage benchmark."""

from functools import cache

import numpy as np

from feelahead.benchmarks.coverage.cells import LINKS
from feelahead.benchmarks.coverage.collisions import first_touch_s, last_release_s
from feelahead.benchmarks.coverage.laws import Draw
from feelahead.benchmarks.coverage.replay import Replay
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.pulls import PullKind
from feelahead.lab.approaches.recording import RecordedApproach, record_approach
from robot_side.settings import EncoderSettings
from robot_side.simulation.posed_scene import PosedScene
from robot_side.simulation.scene import load_scene

SEED = 1
"""A steady pull at 0.24 m/s."""


@cache
def recorded(link: str = "", pull: PullKind = "steady") -> RecordedApproach:
    return record_approach(pull, link, SEED, duration_s=2.0)


def staged(
    scene_name: str, link: str = "", ahead_m: float = 0.0, pull: PullKind = "steady"
) -> tuple[Replay, PosedScene, Draw]:
    scene = load_scene(frozen_scene(scene_name), SITE)
    posed, replay = PosedScene(scene), Replay(recorded(link, pull), scene, EncoderSettings(), SEED)
    posed.put(replay.record.joint_positions_rad[0], replay.record.finger_positions[0], ahead_m * replay.axis)
    errors_m = np.zeros((len(scene.objects), 3))
    return replay, posed, Draw(replay, posed.perceived(errors_m), 0.003)


@cache
def approaching(link: str = "0 ms", ahead_m: float = 0.0) -> tuple[Draw, float, float]:
    """A wall ahead, when it is touched, and when the last moment is to let go."""
    replay, posed, draw = staged("wall", LINKS[link], ahead_m)
    touch_s = first_touch_s(replay, posed, ahead_m * replay.axis)
    assert touch_s is not None
    last_s = last_release_s(replay, posed, ahead_m * replay.axis, touch_s)
    assert last_s is not None
    return draw, touch_s, last_s
