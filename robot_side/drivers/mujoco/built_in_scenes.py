"""Scenes of the built-in arm: objects around the target, with some dimensions drawn from the seed."""

from collections.abc import Callable, Mapping
from typing import Any, Final, Literal

import numpy as np

SceneName = Literal["table", "wall", "slot", "shelf"]

_TIPS_BEYOND_TARGET_M: Final = 0.035
"""Distance, in m, from the target's centre forward to the fingertips at a grasp: the centre is 20 mm behind the tool's
point"""
_HALF_WIDTH_M: Final = 0.0565
"""Half width of the open gripper, from its axis to the outside of a finger"""
_HALF_HEIGHT_M: Final = 0.032
"""Half height of the palm"""
_HALF_TARGET_M: Final = 0.06


def furnish(spec: Any, name: SceneName, seed: int) -> None:
    """Draw the scene's variable dimensions from `seed`, and apply them to `spec`, an MjSpec."""
    # Not the seed's first streams: the errors of arm and camera are drawn from those.
    _DRAWN[name](spec, np.random.default_rng(np.random.SeedSequence([seed, 0x5CE7E])))


def _table(spec: Any, generator: np.random.Generator) -> None:
    """Draw nothing: the table's dimensions are fixed."""


def _wall(spec: Any, generator: np.random.Generator) -> None:
    """Put the wall's face 10 to 60 mm beyond the place of the fingertips at a grasp."""
    wall = spec.geom("wall")
    face_m = spec.body("target").pos[0] + _TIPS_BEYOND_TARGET_M + generator.uniform(0.010, 0.060)
    wall.pos = [face_m + wall.size[0], *wall.pos[1:]]


def _slot(spec: Any, generator: np.random.Generator) -> None:
    """Shift the target sideways by up to 80 mm; leave 15 to 40 mm between gripper and posts on the way to it."""
    target = spec.body("target")
    across_m = generator.uniform(-0.08, 0.08)
    target.pos = [target.pos[0], across_m, target.pos[2]]
    for name, side in (("left_post", 1.0), ("right_post", -1.0)):
        post = spec.geom(name)
        out_m = _HALF_WIDTH_M + generator.uniform(0.015, 0.040) + post.size[1]
        post.pos = [post.pos[0], across_m + side * out_m, post.pos[2]]


def _shelf(spec: Any, generator: np.random.Generator) -> None:
    """Make the board 30 to 90 mm high above the table; put the edge's top 8 to 25 mm below the palm at a grasp."""
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
