"""A solid has the same onset distances as a mesh, convex or not, and as primitives."""

import numpy as np
import pytest

from robot_side.field.scratch import Count
from robot_side.overlap import Mesh
from robot_side.overlap.meshes.mesh_shapes import capsule_mesh
from tests.helpers.field.fields import AHEAD, EQUAL_M, along, look, ways_of
from tests.helpers.gripper_poses import free_pose, gripper_pose
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES
from tests.helpers.perceived_scenes import Scene, random_rotation


@pytest.mark.parametrize("seed", range(40))
def test_a_box_told_as_a_mesh_has_its_ways(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes, meshes = Scene(), Scene()
    for _ in range(3):
        center, half, rotation = rng.uniform(-0.12, 0.12, 3), rng.uniform(0.002, 0.06, 3), random_rotation(rng)
        boxes.add().box(center, half, rotation)
        meshes.add().mesh(Mesh(CUBE_CORNERS * half, CUBE_TRIANGLES), center, rotation)
    pose = free_pose(rng.uniform(-0.03, 0.03, (6, 3)), rng.uniform(0.004, 0.02, 6))
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    looked = along(direction, float(rng.uniform(0.0, 0.015)))
    expected = ways_of(pose, boxes.objects(), looked)
    np.testing.assert_allclose(ways_of(pose, meshes.objects(), looked), expected, atol=EQUAL_M)


def test_meshes_that_are_far_cost_no_overlap() -> None:
    capsule, scene = Mesh(*capsule_mesh(0.03, 0.1, 4)[:2]), Scene()
    places = np.random.default_rng(2).uniform(-2.0, 2.0, (997, 3))
    places[:, 2] += 4.0
    for place in places:
        scene.add().mesh(capsule, place)
    pose = gripper_pose()
    assert look(pose, scene.objects(), along(AHEAD, 0.007)).counts.tolist() == [0] * len(Count)
    for place in ([0.0, 0.0, 0.2], [0.1, 0.0, 0.2], [-0.1, 0.0, 0.2]):
        scene.add().mesh(capsule, place)
    found = look(pose, scene.objects(), along(AHEAD, 0.007))
    assert np.isfinite(found.fast_m).all()
    assert found.counts[Count.PAIRS] <= 3 * len(pose.sphere_radii_m)


def test_beside_a_mesh_that_is_overlapped_nothing_is_worked_out() -> None:
    """No triangle within the examined distance faces the motion, so no overlap can rise and none is computed."""
    box = Mesh(CUBE_CORNERS * [0.02, 0.4, 0.4], CUBE_TRIANGLES)
    pose = gripper_pose()
    side_m = float((pose.sphere_centers_m[:, 0] + pose.sphere_radii_m).max())
    beside = Scene().add().mesh(box, [side_m + 0.003 + 0.02, 0.0, 0.1]).objects()
    found = look(pose, beside, along(AHEAD, 0.007, reach_m=0.3))
    assert np.isinf(found.fast_m).all()
    assert found.counts[Count.PAIRS] == found.counts[Count.OVERLAPS] == 0


def test_along_a_convex_mesh_that_is_overlapped_little_is_worked_out() -> None:
    """Only few spheres' overlaps rise, at the box's near end. With a convex mesh the others' never rise again."""
    box = Mesh(CUBE_CORNERS * [0.02, 0.4, 0.1], CUBE_TRIANGLES)
    pose = gripper_pose()
    side_m = float((pose.sphere_centers_m[:, 0] + pose.sphere_radii_m).max())
    beside = Scene().add().mesh(box, [side_m + 0.003 + 0.02, 0.0, 0.1]).objects()
    found = look(pose, beside, along(AHEAD, 0.007, reach_m=0.3))
    assert np.isfinite(found.fast_m).any()
    assert found.counts[Count.PAIRS] > 10
    assert found.counts[Count.OVERLAPS] <= 4 * found.counts[Count.PAIRS]
