"""Does the map stand where a toy falls? A row for each telling test: python -m tests.robot_side.depth.telling [WORD].

WORD: only rows whose function's name contains it. Cameras err as a D435 does, half of it the same in all pictures.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.depth.boxes import Boxes
from robot_side.depth.depth_map import DepthMap, Integrated
from robot_side.depth.picture import DepthErrors, DepthPicture
from robot_side.depth.sensor_errors import ErrorMaker
from robot_side.depth.sensors import SENSORS
from robot_side.depth.settings import MapSettings
from tests.robot_side.depth import telling_scenes as scenes
from tests.robot_side.depth.mapping import NOBODY, fronts, near
from tests.robot_side.depth.ray_cast import Ball, Box, Camera, Thing, looking

Rows = Iterator[tuple[str, str]]
_RATE_HZ: Final = 30.0
_SEEDS: Final = range(5)
_SETTINGS: Final = MapSettings(lower_m=(0.0, -0.5, -0.1), upper_m=(0.95, 0.5, 0.9))
_POSE: Final = looking((0.0, 0.0, 0.4), (0.6, 0.0, 0.4))
_FRONT_M: Final = 0.6
_WALL: Final = Box((0.7, 0.0, 0.4), (0.1, 0.6, 0.6))
_BEHIND: Final = Box((1.0, 0.0, 0.4), (0.1, 2.0, 2.0))
_BESIDE: Final = Box((0.7, 0.5, 0.4), (0.1, 0.2, 0.6))
_BALL: Final = Ball((0.5, 0.05, 0.4), 0.04)


class _Watching:
    """A camera with a D435's errors, and the map of what it sees."""

    def __init__(self, seed: int, constant_share: float = 0.5, least_m: float = 0.17) -> None:
        sensor = replace(SENSORS["d435"], constant_share=constant_share, least_m=least_m)
        self.errors: DepthErrors = sensor.depth_errors()
        self.map = DepthMap(_SETTINGS)
        self._maker = ErrorMaker(sensor, Camera(_POSE).pinhole, (240, 320), seed)
        self._taken = 0

    def look(self, things: list[Thing], frames: int = 1, x_m: float = 0.0, rate_hz: float = _RATE_HZ) -> Integrated:
        """Take pictures from x_m on; return what the last one did."""
        camera = Camera(replace(_POSE, position_m=np.array([x_m, 0.0, 0.4])))
        true_m = camera.depth_m(things).astype(np.float32)
        for _ in range(frames):
            picture = DepthPicture(self._taken / rate_hz, self._maker.apply(true_m), camera.pinhole)
            found = self.map.integrate(picture, camera.pose, NOBODY, self.errors)
            self._taken += 1
        return found

    def until(self, things: list[Thing], there: bool, most: int = 150) -> int:
        """Return in which picture the ball is there, or gone."""
        for frame in range(1, most):
            self.look(things)
            boxes = near(self.map.boxes(), _BALL.center_m, 0.06)
            if boxes > 10 if there else boxes == 0:
                return frame
        return most


def _spread(values: list[float] | list[int], form: str = "g") -> str:
    return f"{np.median(values):{form}} ({min(values):{form}} to {max(values):{form}})"


def changes() -> Rows:
    """Yield in which picture a ball appears and vanishes, before what is measured and what is not."""
    for name, rest in (("a wall", _BEHIND), ("nothing measured", _BESIDE)):
        appears, vanishes = [], []
        for seed in _SEEDS:
            watching = _Watching(seed)
            watching.look([rest], 5)
            appears.append(watching.until([rest, _BALL], there=True))
            watching.look([rest, _BALL], 10)
            vanishes.append(watching.until([rest], there=False))
        yield f"a ball before {name}, 30 Hz", f"appears in picture {_spread(appears)}, gone in {_spread(vanishes)}"


def constant_noise() -> Rows:
    """Yield how early the front of a wall is after 30 pictures, with errors that stay or change."""
    sd_mm = 1e3 * _Watching(0).errors.sd_m(_FRONT_M)
    for name, share in (("new in each picture", 0.0), ("the same in all", 1.0)):
        most, middle, changed = [], [], []
        for seed in _SEEDS:
            watching = _Watching(seed, share)
            watching.look([_WALL], 30)
            off_mm = 1e3 * (_FRONT_M - fronts(watching.map.boxes())[..., 0])
            most.append(float(off_mm.max()))
            middle.append(float(np.median(np.abs(off_mm))))
            found = watching.look([_WALL])
            changed.append(100.0 * found.changed / found.boxes)
        yield (
            f"a wall at 0.6 m, errors of {sd_mm:.1f} mm, {name}",
            f"front off by {_spread(middle, '.1f')}, foremost early by {_spread(most, '.1f')} mm;"
            f" {_spread(changed, '.1f')} % of the boxes change in a picture",
        )


def too_near() -> Rows:
    """Yield what is left of a wall at which a wrist camera of 0.28 m least range arrives at 30 mm/s."""
    kept, off_mm = [], list[float]()
    for seed in _SEEDS:
        watching = _Watching(seed, least_m=0.28)
        for x_m in np.arange(0.0, _FRONT_M - 0.12, 0.03 / 15.0):
            watching.look([_WALL], x_m=float(x_m), rate_hz=15.0)
        watching.look([_WALL], 150, _FRONT_M - 0.12, rate_hz=15.0)
        share, off_m = ahead(watching.map.boxes())
        kept.append(100.0 * share)
        off_mm.append(1e3 * off_m)
    yield (
        "a wall 0.28 to 0.12 m ahead of a camera that sees from 0.28 m, 30 mm/s, then 10 s at rest",
        f"{_spread(kept, '.0f')} % of 100 x 100 mm ahead are kept, early by {_spread(off_mm, '.1f')} mm",
    )


def ahead(boxes: Boxes) -> tuple[float, float]:
    """Return which share of 100 x 100 mm ahead has a front, and how early its foremost is, in m."""
    corners = fronts(boxes)
    low, high = corners[..., 1:].min(axis=1), corners[..., 1:].max(axis=1)
    grid = np.stack(np.meshgrid(np.linspace(-0.05, 0.05, 21), 0.4 + np.linspace(-0.05, 0.05, 21)), axis=-1)
    points: FloatArray = grid.reshape(-1, 1, 2)
    on = ((points >= low) & (points <= high)).all(axis=2)
    return float(on.any(axis=1).mean()), float(_FRONT_M - corners[on.any(axis=0)][..., 0].min())


_ROWS: Final[tuple[Callable[[], Rows], ...]] = (
    *(changes, constant_noise, too_near),
    *(scenes.look_cost, scenes.clearances, scenes.drive, scenes.held),
)


def show(word: str = "") -> None:
    """Print the table."""
    print("| test | found, median (least to most) |\n|---|---|")
    for rows in _ROWS:
        if word in rows.__name__:
            for what, found in rows():
                print(f"| {what} | {found} |", flush=True)


if __name__ == "__main__":
    show(*sys.argv[1:])
