"""Processor time of the law in turns with two depth cameras: python -m tests.robot_side.depth.turns [SCENE ...]."""

import sys
import time
from typing import Final

import numpy as np

from common.periods import TURN_S
from feelahead import Episode
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

_SECONDS: Final = 20.0
_BEGINS_S: Final = 3.0
"""Time after which turns count: before, the map begins"""


def turns_ms(scene: str) -> list[float]:
    """Return the processor time of the law in each turn while a simulated person grasps, in ms."""
    episode = Episode(scene=scene, seed=3, person="grasping", perception="depth", sampled=False)
    taken_ms: list[float] = []
    law = episode.parts.law

    def timed(situation: Situation, now_s: float) -> Sensed:
        began_s = time.thread_time()
        sensed = sense(situation, now_s)
        if now_s > _BEGINS_S:
            taken_ms.append(1e3 * (time.thread_time() - began_s))
        return sensed

    sense, law.sense = law.sense, timed  # type: ignore[method-assign]
    episode.run(seconds=_SECONDS)
    return taken_ms


if __name__ == "__main__":
    for scene in sys.argv[1:] or ("wall", "table"):
        p50_ms, p90_ms, p99_ms = np.percentile(turns_ms(scene), (50, 90, 99))
        of_period = 1e-3 * p99_ms / TURN_S
        print(f"{scene}: p50 {p50_ms:.2f}, p90 {p90_ms:.1f}, p99 {p99_ms:.1f} ms, {of_period:.1f} of a turn's period")
