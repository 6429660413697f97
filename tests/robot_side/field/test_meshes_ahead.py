"""A solid has the same onset distances as a mesh, convex or not, and as primitives."""

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.field.scratch import Count
from robot_side.overlap import Mesh
from robot_side.overlap.meshes.mesh_shapes import capsule_mesh
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, EQUAL_M, RADIUS_M, along, ball_pose, look, ways_of
from tests.helpers.gripper_poses import free_pose, gripper_pose
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES, grid_tetrahedra, surface_of
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


def slot(half_width_m: float, rotation: FloatArray) -> tuple[PerceivedObjects, PerceivedObjects]:
    """Return a U twice, as a non-convex mesh and as three boxes. Its slot is 100 mm deep and opens at the origin."""
    places, tetrahedra = grid_tetrahedra(3)
    cells = np.floor(places[tetrahedra].mean(axis=1))
    in_slot = (cells[:, 0] == 1.0) & (cells[:, 2] <= 1.0)
    triangles = surface_of(tetrahedra[~in_slot])
    used, numbers = np.unique(triangles, return_inverse=True)
    vertices = (places[used] - [1.5, 1.5, 0.0]) * [2.0 * half_width_m, 0.1, 0.05]
    mesh = Scene().add().mesh(Mesh(vertices, numbers.reshape(-1, 3)), [0.0, 0.0, 0.0], rotation)
    boxes = Scene().add()
    for side in (-1.0, 1.0):
        middle = rotation @ [side * 2.0 * half_width_m, 0.0, 0.075]
        boxes.box(middle, [half_width_m, 0.15, 0.075], rotation)
    boxes.box(rotation @ [0.0, 0.0, 0.125], [half_width_m, 0.15, 0.025], rotation)
    return mesh.objects(), boxes.objects()


@pytest.mark.parametrize("gap_m", [0.0005, 0.001, 0.003, 0.01])
@pytest.mark.parametrize("inflated_m", [0.0, 0.0029, 0.007])
@pytest.mark.parametrize("start_m", [-0.03, 0.02])
def test_a_slot_told_as_one_mesh_has_the_ways_of_its_parts(gap_m: float, inflated_m: float, start_m: float) -> None:
    """The sphere starts before the slot or in it. It is just off the slot's sides, grazes them, or overlaps both."""
    rotation = random_rotation(np.random.default_rng(1))
    mesh, boxes = slot(RADIUS_M + gap_m, rotation)
    pose = ball_pose(tool_position_m=start_m * rotation @ AHEAD)
    looked = along(rotation @ AHEAD, inflated_m, reach_m=0.2)
    expected = ways_of(pose, boxes, looked)
    assert np.isfinite(expected).all()
    np.testing.assert_allclose(ways_of(pose, mesh, looked), expected, atol=EQUAL_M)


@pytest.mark.parametrize("inflated_m", [0.0, 0.007])
def test_jammed_between_the_sides_of_a_slot_its_bottom_is_still_ahead(inflated_m: float) -> None:
    """Even the uninflated sphere overlaps the mesh, so the overlap does not rise for a long distance."""
    mesh, boxes = slot(RADIUS_M - 0.001, np.eye(3))
    pose, looked = ball_pose(tool_position_m=0.02 * AHEAD), along(AHEAD, inflated_m, reach_m=0.2)
    expected = ways_of(pose, boxes, looked)
    assert 0.05 < expected[0] < expected[7] < 0.075
    np.testing.assert_allclose(ways_of(pose, mesh, looked), expected, atol=EQUAL_M)


def test_from_within_a_slot_the_way_back_out_is_free() -> None:
    mesh, _ = slot(RADIUS_M + 0.001, np.eye(3))
    pose = ball_pose(tool_position_m=0.05 * AHEAD)
    assert np.isinf(ways_of(pose, mesh, along(-AHEAD, 0.007, reach_m=0.2))).all()


def test_ways_shorten_towards_a_capsule_that_is_ahead_alone() -> None:
    capsule = Mesh(*capsule_mesh(0.03, 0.1, 12)[:2])
    rotation = random_rotation(np.random.default_rng(4))
    pose = gripper_pose([0.3, 0.1, 0.2], rotation)
    approach = rotation[:, 2]
    front_m = float(((pose.sphere_centers_m - pose.tool_position_m) @ approach + pose.sphere_radii_m).max())
    # The capsule's axis lies across the gap between the fingers, so that both fingers meet it.
    turned = np.column_stack([rotation[:, 1], approach, rotation[:, 0]])
    for gap_m in (0.05, 0.01, 0.006, 0.0025):
        there = pose.tool_position_m + (front_m + 0.03 + gap_m) * approach
        objects = Scene().add().mesh(capsule, there, turned).objects()
        onsets = ways_of(pose, objects, along(approach, 0.002))
        free_m = gap_m - 0.002
        assert free_m - 0.012 < onsets[0] < free_m - 0.008
        assert free_m - 0.003 < onsets[7] <= free_m + 2e-4
        assert np.isinf(ways_of(pose, objects, along(-approach, 0.002))).all()


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
