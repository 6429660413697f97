"""Measure looks at concave objects in turns with "mixed"; calls begin at least 4 ms apart, as ticks do."""

import functools
import itertools
import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.periods import TURN_S
from common.realtime.pacing import SPIN_S
from feelahead.lab.approaches.frozen import SITE
from feelahead.lab.posed_gripper import PosedGripper
from feelahead.lab.tick.mixed import Mixed
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.posed_scene import PosedScene
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.enlargement.distance import standard_quantile
from robot_side.field.along import Along
from robot_side.field.field import Ahead, Field
from robot_side.field.object_class import OBSTACLE
from robot_side.settings import CameraSettings, EncoderSettings
from robot_side.surroundings.scene_table import scene_table

_FREE_MM: Final = tuple(np.linspace(5.0, 150.0, 30).tolist())
_CHUNK: Final = 20
_PROBABILITY: Final = 0.99
_REACH_M, _FARTHEST_M = 0.4, 2.0


def looks_before(model: Path, free_mm: Iterable[float]) -> Iterator[Callable[[], Field]]:
    """Yield, for each distance to the object in `free_mm`, a function that evaluates the law along R2 (a look).

    The gripper stays in its home pose; the objects are moved along the approach.
    """
    scene = load_scene(model, SITE)
    posed, gripper, things = PosedScene(scene), PosedGripper(scene), len(scene.objects)
    pose = gripper.at(gripper.home_rad)
    posed.set_pose(gripper.home_rad, gripper.fingers, np.zeros(3))
    contact_distance_m = posed.contact_distance_m(_FARTHEST_M)
    encoder = EncoderSettings()
    sigma_rad = Encoder(encoder.sigma_rad, encoder.resolution_rad).standard_deviation_rad()
    ahead, classes = Ahead(np.full(len(gripper.home_rad), sigma_rad)), np.full(things, OBSTACLE, dtype=np.int64)
    axis = np.ascontiguousarray(pose.tool_rotation[:, 2])
    r2 = Along(axis, 0.0, CameraSettings().sd_m ** 2, float(standard_quantile(_PROBABILITY)), _REACH_M)
    for free in free_mm:
        posed.set_pose(gripper.home_rad, gripper.fingers, (1e-3 * free - contact_distance_m) * axis)
        seen = scene_table(posed.perceived(np.zeros((things, 3))))
        yield functools.partial(ahead.look, pose, seen, classes, r2)


def time_looks(model: Path, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Measure looks at the object of `model`, with "mixed" in between; return processor times of both (s)."""
    return time_calls(list(looks_before(model, _FREE_MM)), seconds)


def time_calls(calls: Sequence[Callable[[], object]], seconds: float) -> tuple[FloatArray, FloatArray]:
    """Measure calls in chunks, each in turn, with "mixed" in between; return processor times of both (s)."""
    looks, mixed = itertools.cycle(calls), Mixed()
    looks_s, mixed_s = list[float](), list[float]()
    for _ in calls:
        next(looks)()
    end_s = time.perf_counter() + seconds
    while time.perf_counter() < end_s:
        mixed_s += _chunk(itertools.repeat(mixed.work))
        looks_s += _chunk(looks)
    return np.array(looks_s), np.array(mixed_s)


def _chunk(works: Iterator[Callable[[], object]]) -> list[float]:
    """Return the processor times of a chunk of calls; the first call, which comes after other work, does not count."""
    spent_s = []
    for work in itertools.islice(works, _CHUNK):
        # Sleep, then spin to the next turn.
        due_s = TURN_S * (1 + math.floor(time.perf_counter() / TURN_S))
        time.sleep(max(due_s - time.perf_counter() - SPIN_S, 0.0))
        while time.perf_counter() < due_s:
            pass
        began_s = time.thread_time()
        work()
        spent_s.append(time.thread_time() - began_s)
    return spent_s[1:]
