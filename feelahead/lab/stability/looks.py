"""Looks under stress: onset distances 1 000 km off, of things of 1e-9 to 1e9 m, at grazes, slivers and contacts.

The reference is the definition, computed with the same doubles (`reference/onsets_by_definition`).
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.roles import Role
from feelahead.lab.reference.features import rotations, unit_vectors
from feelahead.lab.reference.looks import LATE_M
from feelahead.lab.reference.onsets_by_definition import defined_onsets
from feelahead.lab.stability.tally import Part, Tally
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.field.field import Ahead
from robot_side.field.object_class import OBSTACLE
from robot_side.field.scratch import MOST_WORK, Count
from robot_side.surroundings.perceived import PerceivedObjects, displaced
from robot_side.surroundings.scene_table import scene_table

Rng = np.random.Generator
_REACH_M: Final = 0.15
_DUST: Final = "dust"
"""Classes of things that are felt late, or below a billionth of a sphere's volume not at all: no limit"""
_OFF_M: Final = np.array((8e5, -5e5, 3.3e5))
_AHEAD: Final = np.array((0.0, 0.0, 1.0))
_RADIUS_M: Final = 0.012
_CENTERS_M: Final = np.array([(x, y, z) for x in (-0.05, 0.05) for y in (-0.01, 0.01) for z in (-0.02, 0.0)])
"""Spheres (8, 3) of two fingers"""
_ENCODER_RAD: Final = np.full(6, 1e-4)
_LOOKING: Final = Along(_AHEAD, 0.001, 9e-6, 2.33, _REACH_M, 0.0, 1e-6)
_EMPTY: Final[dict[str, Any]] = {
    "sphere_centers_m": np.empty((0, 3)),
    "sphere_radii_m": np.empty(0),
    "box_centers_m": np.empty((0, 3)),
    "box_rotations": np.empty((0, 3, 3)),
    "box_half_sizes_m": np.empty((0, 3)),
    "tetrahedron_vertices_m": np.empty((0, 4, 3)),
    "half_space_normals": np.empty((0, 3)),
    "half_space_offsets_m": np.empty(0),
}


def one(kind: str, **columns: Any) -> PerceivedObjects:
    """Return a frame with one object of one primitive. kind: prefix of its columns, such as `box`."""
    owners = {f"{name}_object": np.empty(0, np.int64) for name in ("sphere", "box", "tetrahedron", "half_space")}
    owners[f"{kind}_object"] = np.zeros(1, np.int64)
    rows = {f"{kind}_{name}": np.array(value, float)[None] for name, value in columns.items()}
    return PerceivedObjects(time_s=0.0, names=("thing",), roles=(Role.OBSTACLE,), **_EMPTY | owners | rows)


def pose() -> GripperPose:
    """Return a gripper of eight spheres on a tool at the origin that moves freely."""
    radii_m, on_finger = np.full(len(_CENTERS_M), _RADIUS_M), np.ones(len(_CENTERS_M), dtype=np.bool_)
    return GripperPose(np.zeros(3), np.eye(3), np.eye(6), _CENTERS_M.copy(), radii_m, on_finger)


def _random(rng: Rng, size_m: float = 0.04, gap_m: float | None = None) -> PerceivedObjects:
    """Draw a thing of `size_m` whose nearest point is about `gap_m` before a sphere: unless given, up to 0.1 m."""
    start = _CENTERS_M[rng.integers(len(_CENTERS_M))]
    ahead = rng.uniform(0.0, 0.1) if gap_m is None else gap_m
    front = start + (_RADIUS_M + ahead) * _AHEAD
    turn, half_m = rotations(rng, 1, grid=False)[0], size_m * rng.uniform(0.3, 1.0, 3)
    match int(rng.integers(4)):
        case 0:
            return one("sphere", centers_m=front + half_m[0] * _AHEAD, radii_m=half_m[0])
        case 1:
            below = float((np.abs(turn) @ half_m)[2])
            return one("box", centers_m=front + below * _AHEAD, rotations=turn, half_sizes_m=half_m)
        case 2:
            corners = size_m * rng.normal(size=(4, 3))
            corners += front - corners[np.argmin(corners[:, 2])]
            return one("tetrahedron", vertices_m=corners)
    normal = unit_vectors(rng, 1)[0]
    normal *= -np.sign(normal[2])
    return one("half_space", normals=normal, offsets_m=float(normal @ front))


def _beside(rng: Rng, past: float) -> PerceivedObjects:
    """Draw a thing that a sphere passes with its flank `past` radii outside (above 0) or inside."""
    start = _CENTERS_M[rng.integers(len(_CENTERS_M))]
    outward = np.array((np.sign(start[0]), 0.0, 0.0))
    flank = start + (_RADIUS_M * (1.0 + past)) * outward + (0.0, 0.0, rng.uniform(0.02, 0.06))
    match int(rng.integers(3)):
        case 0:
            half_m = np.array((0.03, 0.03, 0.04))
            place = flank + half_m * (outward + _AHEAD)
            return one("box", centers_m=place, rotations=np.eye(3), half_sizes_m=half_m)
        case 1:
            return one("sphere", centers_m=flank + 0.05 * outward, radii_m=0.05)
    return one("half_space", normals=-outward, offsets_m=float(-outward @ flank))


def _thin(rng: Rng, thickness_m: float) -> PerceivedObjects:
    """Draw a plate, rod or sliver ahead that is so thin."""
    front = _CENTERS_M[rng.integers(len(_CENTERS_M))] + (0.0, 0.0, _RADIUS_M + rng.uniform(0.01, 0.08))
    if rng.random() < 0.5:
        half_m = np.array((0.03, rng.choice((0.03, thickness_m)), thickness_m))
        turn = rotations(rng, 1, grid=False)[0]
        return one("box", centers_m=front, rotations=turn, half_sizes_m=half_m)
    corners = 0.04 * rng.normal(size=(4, 3))
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    corners[3] = corners[:3].mean(axis=0) + thickness_m * normal / np.linalg.norm(normal)
    return one("tetrahedron", vertices_m=front + corners)


CLASSES: Final[dict[str, tuple[tuple[float, ...], Callable[[Rng, float], PerceivedObjects]]]] = {
    "as drawn": ((0.04,), _random),
    "1 000 km off": ((0.04,), _random),
    "things of 1e-3 to 1e9 m": ((1e-3, 0.1, 1.0, 1e3, 1e6, 1e9), _random),
    "flanks that graze, to 1e-15 R": ((0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-3, -1e-3, 0.3, -0.3), _beside),
    "slivers of 1e-5 to 1e-3 m": ((1e-3, 1e-4, 1e-5), _thin),
    "contact at the start, to 1e-18 m": (
        (0.0, 1e-18, -1e-18, 1e-12, -1e-12, -1e-6, -0.01),
        lambda rng, gap_m: _random(rng, gap_m=gap_m),
    ),
    f"{_DUST}: things of 1e-9 to 1e-4 m": ((1e-9, 1e-7, 1e-5, 1e-4), _random),
    f"{_DUST}: slivers of 1e-15 to 1e-6 m": ((1e-6, 1e-9, 1e-12, 1e-15), _thin),
}


def check(group: str, count: int, rng: Rng) -> Iterator[Tally]:
    """Compare the onset distances of `count` looks of each variant with their definition."""
    off_m = _OFF_M if group == "1 000 km off" else np.zeros(3)
    variants, draw = CLASSES[group]
    limit_m = np.inf if group.startswith(_DUST) else LATE_M
    tally = Tally(group, "m, beyond what 0.02 of the strength explains", limit_m, MOST_WORK)
    for variant in variants:
        for number in range(count):
            where = f"{variant:g}, number {number}"
            with tally.tried(where):
                _note(displaced(draw(rng, variant), off_m), off_m, tally, where)
    yield tally


def _note(objects: PerceivedObjects, off_m: FloatArray, tally: Tally, where: str) -> None:
    still, looking, classes = pose(), Ahead(_ENCODER_RAD), np.array([OBSTACLE])
    moved = replace(still, tool_position_m=off_m, sphere_centers_m=still.sphere_centers_m + off_m)
    found = looking.look(moved, scene_table(objects), classes, _LOOKING)
    defined = defined_onsets(moved, objects, classes, _LOOKING, np.inf, _ENCODER_RAD)
    onsets_m, (early_m, late_m) = np.minimum(found.onsets_m, _REACH_M), np.minimum(defined.onsets_m[1:], _REACH_M)
    out_m = np.maximum(np.maximum(onsets_m - late_m, early_m - onsets_m), 0.0)
    steps = int(found.counts[Count.PAIRS] + found.counts[Count.OVERLAPS])
    tally.note(out_m, where, steps if not found.counts[Count.CUT] else MOST_WORK + 1)


PART: Final = Part(tuple(CLASSES), (40, 6), check)
