"""Properties of every field: where first and full strength begin, and effects of position and uncertainty."""

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.field.look import MARGIN_M
from robot_side.overlap import Mesh
from robot_side.overlap.meshes.mesh_shapes import capsule_mesh
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, RADIUS_M, along, ball_pose, ways_of
from tests.helpers.gripper_poses import FRONT_M, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

INFLATED_M = 0.007
FREE_M = 0.07
"""Contact distance d of the objects ahead, in metres"""
FINGERTIP_X_M = 0.0485


def thing(kind: str, face_m: float, x_m: float = 0.0, rotation: FloatArray | None = None) -> PerceivedObjects:
    """Return an object whose nearest point is `face_m` ahead of the origin; thin ones lie across, at x_m."""
    turned = np.eye(3) if rotation is None else rotation
    half_m = {"wall": (0.6, 0.6, 0.05), "plate": (0.1, 0.1, 0.001)}
    half_m |= {f"{mm} mm rod": (5e-4 * mm, 0.3, 5e-4 * mm) for mm in (10, 5, 2, 1, 0.4)}
    radii_m = {"ball": 0.04, "marble": 0.0075}
    scene = Scene().add()
    if kind == "half-space":
        return scene.half_space(-turned @ AHEAD, -face_m).objects()
    if kind == "cable":
        # The mesh's z axis is laid across the path.
        across = turned @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
        mesh = Mesh(*capsule_mesh(0.001, 0.1, 24)[:2])
        return scene.mesh(mesh, turned @ [x_m, 0.0, face_m + 0.001], across).objects()
    if kind in radii_m:
        return scene.sphere(turned @ [x_m, 0.0, face_m + radii_m[kind]], radii_m[kind]).objects()
    half = half_m[kind]
    return scene.box(turned @ [0.0 if half[0] > 0.05 else x_m, 0.0, face_m + half[2]], half, turned).objects()


# First and full strength


@pytest.mark.parametrize("gripper", [False, True], ids=["one sphere", "gripper"])
@pytest.mark.parametrize(
    "kind",
    ["wall", "half-space", "plate", "ball", "marble", "10 mm rod", "5 mm rod", "2 mm rod", "1 mm rod", "cable"],
)
def test_strength_is_0_until_the_margin_before_the_free_way_and_full_from_there_on(kind: str, gripper: bool) -> None:
    rotation = random_rotation(np.random.default_rng(7))
    pose = gripper_pose((0.0, 0.0, 0.0), rotation) if gripper else ball_pose(tool_rotation=rotation)
    front_m = FRONT_M if gripper else RADIUS_M
    objects = thing(kind, front_m + INFLATED_M + FREE_M, FINGERTIP_X_M if gripper else 0.0, rotation)
    onsets = ways_of(pose, objects, along(rotation[:, 2], INFLATED_M))
    assert (np.diff(onsets) > 0.0).all()
    # Similar for all: a strength's distances differ by less than 4 mm, though the overlaps differ by a factor of 300.
    assert FREE_M - MARGIN_M < onsets[0] < FREE_M - 0.009
    # A thin rod's overlap hardly grows before it is full.
    assert FREE_M - 0.003 < onsets[7] <= FREE_M
    assert FREE_M - 0.0102 < onsets[3] < FREE_M - 0.004


def test_a_wall_that_is_touched_exactly_without_any_doubt_is_felt() -> None:
    for kind in ("wall", "half-space", "ball"):
        for gap_m in (0.0, 1e-12, 5e-8):
            onsets = ways_of(ball_pose(), thing(kind, RADIUS_M + gap_m), along())
            assert -MARGIN_M < onsets[0] < -0.009
            assert -0.0027 < onsets[7] <= gap_m


def test_a_graze_is_felt_by_its_share_of_the_least_volume() -> None:
    """A hair through a fingertip's sphere has less volume than V_min, a cap of 0.5 mm: only weak strengths are felt."""
    hair = thing("0.4 mm rod", RADIUS_M + INFLATED_M + FREE_M)
    assert np.isfinite(ways_of(ball_pose(), hair, along(AHEAD, INFLATED_M))).sum() == 3
