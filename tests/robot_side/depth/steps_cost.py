"""Processor time of each step of the map, of a table with things on it: python -m tests.robot_side.depth.steps_cost."""

import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np

from robot_side.depth import depth_map as steps
from robot_side.depth.depth_map import DepthMap
from robot_side.depth.picture import DepthPicture, OwnBody
from robot_side.depth.settings import MapSettings
from tests.robot_side.depth.ray_cast import Ball, Box, Camera, Rod, Thing, alike, looking

TABLE: tuple[Thing, ...] = (
    Box((0.5, 0.0, -0.02), (0.6, 0.8, 0.02)),
    *(Box((0.5, 0.1, 0.06), (0.03, 0.04, 0.06)), Box((0.6, -0.2, 0.04), (0.05, 0.02, 0.04))),
    *(Box((0.75, 0.25, 0.1), (0.02, 0.1, 0.1)), Box((0.45, -0.35, 0.075), (0.04, 0.04, 0.075))),
    *(Ball((0.55, 0.3, 0.04), 0.04), Ball((0.4, 0.25, 0.03), 0.03), Rod(0.7, 0.0, 0.005)),
)
_FRAMES = 40


def measure(width: int, height: int) -> None:
    """Print the median processor time of each step, in ms, over the last ten pictures, and the boxes."""
    took_s: dict[str, list[float]] = defaultdict(list)

    def timed(owner: Any, name: str) -> None:
        function: Callable[..., Any] = getattr(owner, name)

        def run(*arguments: Any) -> Any:
            begin_s = time.thread_time()
            found = function(*arguments)
            took_s[name].append(time.thread_time() - begin_s)
            return found

        setattr(owner, name, run)

    random, camera = np.random.default_rng(1), Camera(looking((0.05, -0.35, 0.75), (0.6, 0.0, 0.05)), width, height)
    depth_m, count = camera.depth_m(TABLE), 14
    arm = random.uniform((0.2, -0.2, 0.2), (0.4, 0.2, 0.5), (count, 3))
    body = OwnBody(np.array([3] * 8 + [6] * 6), arm, np.tile(np.eye(3), (count, 1, 1)), np.full((count, 3), 0.05))
    depth_map = DepthMap(MapSettings())
    functions = {name: getattr(steps, name) for name in ("supported", "own_pixels", "normals")}
    for name in functions:
        timed(steps, name)
    for owner, name in ((depth_map.surfels, "integrate"), (depth_map.planes, "follow"), (depth_map.seen, "see")):
        timed(owner, name)
    timed(depth_map, "_find_motion")
    changed = []
    for k in range(_FRAMES):
        noisy = depth_m + camera.errors.growth_per_m * depth_m**2 * alike(random, depth_m.shape)
        picture = DepthPicture(k / 30.0, noisy.astype(np.float32), camera.pinhole)
        found = depth_map.integrate(picture, camera.pose, body, camera.errors)
        changed.append(found.changed)
    for name, function in functions.items():
        setattr(steps, name, function)
    costs = ", ".join(f"{name} {1e3 * np.median(times[-10:]):.2f}" for name, times in took_s.items())
    share = np.mean(changed[-10:]) / found.boxes
    print(f"{width}x{height}: {costs} ms; {found.boxes} boxes, {share:.1%} of them change in a picture")


if __name__ == "__main__":
    measure(320, 240)
    measure(640, 480)
