"""The built-in arm's scenes: what stands around the target, and what of it is drawn from the seed."""

from collections.abc import Callable, Mapping
from typing import Any, Final, Literal

import numpy as np

SceneName = Literal["table", "wall", "slot", "shelf"]

_TIPS_BEYOND_TARGET_M: Final = 0.035
"""The fingertips end so far beyond the target's centre when that lies 20 mm towards the palm, where a person grasps."""
_HALF_WIDTH_M: Final = 0.0565
"""Of the open gripper, from its axis to the outside of a finger."""
_HALF_HEIGHT_M: Final = 0.032
"""Of the palm."""
_HALF_TARGET_M: Final = 0.06


def furnish(spec: Any, name: SceneName, seed: int) -> None:
    """Draw from `seed` what differs from run to run, and change the scene `spec`, an MjSpec, to it."""
    # Not the first of the seed's streams, which the arm's and the camera's errors are drawn from.
    _DRAWN[name](spec, np.random.default_rng(np.random.SeedSequence([seed, 0x5CE7E])))


def _table(spec: Any, generator: np.random.Generator) -> None:
    """Always the same."""


def _wall(spec: Any, generator: np.random.Generator) -> None:
    """The wall's face is 10 to 60 mm beyond the fingertips at the grasp."""
    wall = spec.geom("wall")
    face_m = spec.body("target").pos[0] + _TIPS_BEYOND_TARGET_M + generator.uniform(0.010, 0.060)
    wall.pos = [face_m + wall.size[0], *wall.pos[1:]]


def _slot(spec: Any, generator: np.random.Generator) -> None:
    """15 to 40 mm to spare on each side of a gripper on the target's line, which is up to 80 mm to either side."""
    target = spec.body("target")
    across_m = generator.uniform(-0.08, 0.08)
    target.pos = [target.pos[0], across_m, target.pos[2]]
    for name, side in (("left_post", 1.0), ("right_post", -1.0)):
        post = spec.geom(name)
        out_m = _HALF_WIDTH_M + generator.uniform(0.015, 0.040) + post.size[1]
        post.pos = [post.pos[0], across_m + side * out_m, post.pos[2]]


def _shelf(spec: Any, generator: np.random.Generator) -> None:
    """The board is 30 to 90 mm above the table, its edge 8 to 25 mm below the palm at the grasp."""
    target, board, edge = spec.body("target"), spec.geom("shelf"), spec.geom("edge")
    board_m = generator.uniform(0.030, 0.090)
    edge_m = board_m + _HALF_TARGET_M - _HALF_HEIGHT_M - generator.uniform(0.008, 0.025)
    target.pos = [*target.pos[:2], board_m + _HALF_TARGET_M]
    for geom, height_m in ((board, board_m), (edge, edge_m)):
        geom.size = [*geom.size[:2], 0.5 * height_m]
        geom.pos = [*geom.pos[:2], 0.5 * height_m]


_DRAWN: Final[Mapping[SceneName, Callable[[Any, np.random.Generator], None]]] = {
    "table": _table,
    "wall": _wall,
    "slot": _slot,
    "shelf": _shelf,
}
