"""Free gap of a gripper where it grips a thing: between its jaws' surfaces at the tool, along their motion."""

import contextlib
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from common.arrays import FloatArray, IntArray
from robot_side.drivers.mujoco.hand.gripper_cover import link_solids
from robot_side.drivers.mujoco.mesh_arrays import mesh_vertices
from robot_side.drivers.mujoco.model_enums import GeomKind

INSIDE_M: Final = 0.015
"""Distance of the place of a grasp from the ends of the fingertips, as in the built-in arm"""
AWAY_M: Final = 0.02
"""Distance up to which a site counts as the place of a grasp: a person grasps as far past the tool's point"""
_PATCHES_M: Final = (0.005, 0.01, 0.02, 0.04)
"""Half sizes of the patch on which both jaws are looked for, from a fingertip's on: fingers may pass beside the tool"""
_MEETS_M: Final = 1e-3
"""Depth up to which jaws that meet may penetrate each other"""
_SMALLEST_STROKE_M: Final = 1e-3
_STILL: Final = 0.05
"""Largest motion of a jaw that stands still, as a share of the largest one"""


class HandPoses(NamedTuple):
    """Poses of a model's b bodies in the frame of the tool's site, at k samples of the gripper's travel."""

    rotations: FloatArray
    """(k, b, 3, 3) rotations from the body's to the site's frame"""
    positions_m: FloatArray
    """(k, b, 3) origins of the bodies"""

    def moved_m(self, at_m: FloatArray) -> FloatArray:
        """Return how far (k - 1, b, 3) what each body has at the point `at_m` (3,) moves to the next sample."""
        own_m: FloatArray = np.einsum("kbji,kbj->kbi", self.rotations, at_m - self.positions_m)
        moved_m: FloatArray = np.einsum("kbij,kbj->kbi", self.rotations[1:], own_m[:-1]) + self.positions_m[1:] - at_m
        return moved_m


class Jaw(NamedTuple):
    """Surface of one jaw where it grips."""

    body: int
    point_m: FloatArray
    """(3,) point of the surface in the body's frame"""
    moves: bool
    """Whether it moves relative to the tool's site"""

    def places_m(self, poses: HandPoses) -> FloatArray:
        """Return the places (k, 3) of the point."""
        places_m: FloatArray = poses.rotations[:, self.body] @ self.point_m + poses.positions_m[:, self.body]
        return places_m


class Gap(NamedTuple):
    """Gap between two jaws, at k samples."""

    sizes_m: FloatArray
    """(k,) free gap in m"""
    closes: bool
    """Whether the gap closes from the first sample to the last"""
    closing: FloatArray
    """(3,) direction in the site's frame along which the jaws close, from the first jaw to the second"""
    jaws: tuple[Jaw, Jaw]


class Convex(NamedTuple):
    """Convex solid: all points x with normals x <= offsets_m."""

    normals: FloatArray
    """(f, 3) unit normals of the faces"""
    offsets_m: FloatArray
    """(f,)"""

    def spans_m(self, from_m: FloatArray, way: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where lines enter and leave the solid: two arrays (...) of distances along `way`; inf for a miss.

        The lines pass through the points `from_m` (..., 3) along the unit vectors `way` (..., 3).
        """
        along, ahead_m = way @ self.normals.T, self.offsets_m - from_m @ self.normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            crossings_m = ahead_m / along
        enters_m = np.where(along < 0.0, crossings_m, -np.inf).max(axis=-1)
        leaves_m = np.where(along > 0.0, crossings_m, np.inf).min(axis=-1)
        misses = (enters_m >= leaves_m) | ((along == 0.0) & (ahead_m < 0.0)).any(axis=-1)
        return np.where(misses, np.inf, enters_m), np.where(misses, np.inf, leaves_m)


def convex_geoms(model: Any, geoms: IntArray) -> dict[int, Convex]:
    """Return the colliding shape of each geom that has a volume, in its body's frame.

    A mesh counts as its convex hull, which is what touches; MuJoCo's own rays meet the mesh, and no invisible geoms.
    """
    found = {}
    for geom in geoms.tolist():
        if model.geom_type[geom] == GeomKind.MESH:
            points_m = mesh_vertices(model, geom) @ _turn(model, geom).T + model.geom_pos[geom]
        else:
            corners_m = [solid.corners_m.reshape(-1, 3) for solid in link_solids(model, [geom])]
            points_m = np.concatenate([np.empty((0, 3)), *corners_m])
        with contextlib.suppress(QhullError, ValueError):
            planes = np.unique(ConvexHull(points_m).equations.round(9), axis=0)
            found[geom] = Convex(planes[:, :3], -planes[:, 3])
    return found


def find_gap(model: Any, solids: Mapping[int, Convex], poses: HandPoses, ahead_m: float) -> Gap | None:
    """Return the gap between the jaws beside the tool, from k poses of the hand; None if nothing closes there.

    It is the distance of two points of the jaws' surfaces: those that face each other along the jaws' motion, in the
    most closed sample in which they are apart. Elsewhere jaws may overlap. Where they turn, they are far from the tool
    when open. solids: from `convex_geoms`. ahead_m: how far the fingers reach ahead of the site; if that is much, the
    place is near their ends.
    """
    depth_m = ahead_m - INSIDE_M
    at_m = np.array([0.0, 0.0, depth_m if abs(depth_m) > AWAY_M else 0.0])
    moved_m, bodies = poses.moved_m(at_m), model.geom_bodyid[list(solids)]
    moves_m = moved_m[:, bodies].reshape(-1, 3)
    # Across the tool, unless its axis is chosen wrongly: links that flap move along it, too.
    for share in (np.diag([1.0, 1.0, 0.0]), np.eye(3)):
        way: FloatArray = np.linalg.eigh(share @ moves_m.T @ moves_m @ share)[1][:, -1]
        along_m = moved_m.sum(axis=0) @ way
        least_m = _STILL * np.abs(along_m[bodies]).max(initial=0.0)
        moves = np.abs(moved_m @ way).sum(axis=0) > least_m
        onward, against, still = (
            {geom: solid for geom, solid in solids.items() if chosen[model.geom_bodyid[geom]]}
            for chosen in (along_m > least_m, along_m < -least_m, ~moves)
        )
        for one, other in ((onward, against), (onward, still), (still, against)):
            for half_m in _PATCHES_M if one and other else ():
                gap = _between(model, poses, (one, other), at_m + patch_m(way, half_m), way)
                if gap is not None and np.ptp(gap.sizes_m) > _SMALLEST_STROKE_M:
                    first, second = (jaw._replace(moves=bool(moves[jaw.body])) for jaw in gap.jaws)
                    return gap._replace(jaws=(first, second))
    return None


def patch_m(way: FloatArray, half_m: float = _PATCHES_M[0]) -> FloatArray:
    """Return points (9, 3) of a square of the side 2 half_m across the direction `way`."""
    across, steps_m = np.linalg.svd(way[None])[2][1:], half_m * np.array([-1.0, 0.0, 1.0])
    points_m: FloatArray = np.array([[x, y] for x in steps_m for y in steps_m]) @ across
    return points_m


def _between(
    model: Any,
    poses: HandPoses,
    jaws: tuple[Mapping[int, Convex], Mapping[int, Convex]],
    lines_m: FloatArray,
    way: FloatArray,
) -> Gap | None:
    """Return the gap on the lines through `lines_m` (r, 3) along `way` (3,); None if the jaws are never apart there.

    jaws: solids that move along `way` from the first sample to the last, and others that move against it.
    """
    # They approach each other if they end nearer to each other than they begin.
    from_m = [np.mean([_middles_m(model, poses, geom) @ way for geom in solids], axis=0) for solids in jaws]
    closes = bool(abs(from_m[1][0] - from_m[0][0]) > abs(from_m[1][-1] - from_m[0][-1]))
    first_m, second_m = (
        _facing(model, poses, solids, lines_m, along)
        for solids, along in zip(jaws if closes else jaws[::-1], (-way, way), strict=True)
    )
    apart_m = first_m[0] + second_m[0]
    apart = np.flatnonzero(np.isfinite(apart_m) & (apart_m > -_MEETS_M))
    if apart.size == 0:
        return None
    sample = int(apart[apart_m[apart].argmin()])
    # On the middle line, for jaws may be met on different lines.
    first, second = (
        _jaw(poses, sample, int(bodies[sample]), lines_m.mean(axis=0) + distances_m[sample] * along)
        for (distances_m, bodies), along in ((first_m, -way), (second_m, way))
    )
    between_m = second.places_m(poses) - first.places_m(poses)
    passed = np.arange(len(apart_m)) > sample if closes else np.arange(len(apart_m)) < sample
    sizes_m = np.where(passed, between_m @ way, np.linalg.norm(between_m, axis=1))
    return Gap(np.maximum(sizes_m, 0.0), closes, way, (first, second))


def _jaw(poses: HandPoses, sample: int, body: int, place_m: FloatArray) -> Jaw:
    """Return the jaw whose surface is at `place_m` (3,) at a sample."""
    return Jaw(body, poses.rotations[sample, body].T @ (place_m - poses.positions_m[sample, body]), moves=True)


def _turn(model: Any, geom: int) -> FloatArray:
    """Return the rotation (3, 3) from the geom's to its body's frame."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    return turn.reshape(3, 3)


def _middles_m(model: Any, poses: HandPoses, geom: int) -> FloatArray:
    """Return the middles (k, 3) of a geom at the samples."""
    body, middle_m = int(model.geom_bodyid[geom]), model.geom_pos[geom] + _turn(model, geom) @ model.geom_aabb[geom, :3]
    middles_m: FloatArray = poses.rotations[:, body] @ middle_m + poses.positions_m[:, body]
    return middles_m


def _facing(
    model: Any, poses: HandPoses, solids: Mapping[int, Convex], lines_m: FloatArray, way: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Return what the lines through `lines_m` (r, 3) meet first along `way` (3,), at each of k samples.

    Distances (k,), inf for nothing, and the bodies (k,) that are met.
    """
    nearest_m, nearest = np.full(len(poses.positions_m), np.inf), np.zeros(len(poses.positions_m), dtype=np.int64)
    reach_m = np.linalg.norm(lines_m - lines_m.mean(axis=0), axis=1).max()
    for geom, solid in solids.items():
        body = int(model.geom_bodyid[geom])
        beside_m = np.linalg.norm(np.cross(_middles_m(model, poses, geom) - lines_m.mean(axis=0), way), axis=1)
        near = np.flatnonzero(beside_m < reach_m + model.geom_rbound[geom])
        rotations, positions_m = poses.rotations[near, body], poses.positions_m[near, body]
        from_m = (lines_m - positions_m[:, None]) @ rotations
        enters_m = solid.spans_m(from_m, (way @ rotations)[:, None])[0].min(axis=1)
        nearer = near[enters_m < nearest_m[near]]
        nearest[nearer], nearest_m[near] = body, np.minimum(nearest_m[near], enters_m)
    return nearest_m, nearest
