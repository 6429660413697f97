"""Properties of every field: where first and full strength begin, and effects of position and uncertainty."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.arm.port import GripperPose
from robot_side.field.look import LEAST_DEPTH_M, MARGIN_M
from robot_side.overlap import Mesh
from robot_side.overlap.meshes.mesh_shapes import capsule_mesh
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, EQUAL_M, RADIUS_M, along, ball_pose, look, ways_of
from tests.helpers.gripper_poses import FRONT_M, free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene

INFLATED_M = 0.007
FREE_M = 0.07
"""Contact distance d of the objects ahead, in metres"""
FINGERTIP_X_M = 0.0485
GRIPPER = gripper_pose()
seeds = st.integers(0, 2**32 - 1)
repeatable = settings(derandomize=True, deadline=None, max_examples=40)


def thing(kind: str, face_m: float, x_m: float = 0.0, rotation: FloatArray | None = None) -> PerceivedObjects:
    """Return an object whose nearest point is `face_m` ahead of the origin; thin ones lie across, at x_m."""
    turned = np.eye(3) if rotation is None else rotation
    half_m = {"wall": (0.6, 0.6, 0.05), "plate": (0.1, 0.1, 0.001)}
    half_m |= {f"{mm} mm rod": (5e-4 * mm, 0.3, 5e-4 * mm) for mm in (10, 5, 2, 1, 0.4)}
    radii_m = {"ball": 0.04, "marble": 0.0075, "pea": 0.003}
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


@pytest.mark.parametrize("degrees", [2, 5, 10, 15, 20, 30, 45, 60, 89])
@pytest.mark.parametrize("gap_m", [0.0005, 0.003, 0.0065])
def test_a_wall_that_leans_into_the_way_is_full_before_it_is_touched(degrees: int, gap_m: float) -> None:
    """The inflated sphere overlaps the wall from the start. The overlap's growth and the uninflated sphere count."""
    angle = np.radians(degrees)
    wall = Scene().add().half_space([np.cos(angle), 0.0, -np.sin(angle)], -RADIUS_M - gap_m).objects()
    onsets = ways_of(ball_pose(), wall, along(AHEAD, INFLATED_M))
    assert onsets[7] < gap_m / np.sin(angle)


def test_a_graze_is_felt_by_its_share_of_the_least_volume() -> None:
    """A hair through a fingertip's sphere has less volume than V_min, a cap of 0.5 mm: only weak strengths are felt.

    An edge that a sphere overlaps by 0.05 mm is not felt at all, one of 2 mm in full.
    """
    radius_m = RADIUS_M + INFLATED_M
    least_m3 = np.pi * radius_m * LEAST_DEPTH_M**2
    onsets = ways_of(ball_pose(), thing("0.4 mm rod", radius_m + FREE_M), along(AHEAD, INFLATED_M))
    most_m3 = 0.16e-6 * 2.0 * radius_m
    assert np.isfinite(onsets).sum() == int(8.0 * most_m3 / least_m3 + 0.5) == 3
    assert FREE_M - MARGIN_M < onsets[0] < FREE_M - 0.009
    edge = Scene().add().box([radius_m - 0.00005 + 0.05, 0.0, 0.1], [0.05, 0.1, 0.05]).objects()
    assert np.isinf(ways_of(ball_pose(), edge, along(AHEAD, INFLATED_M))).all()
    deeper = Scene().add().box([radius_m - 0.002 + 0.05, 0.0, 0.1], [0.05, 0.1, 0.05]).objects()
    assert np.isfinite(ways_of(ball_pose(), deeper, along(AHEAD, INFLATED_M))).all()


def test_a_small_ball_is_full_though_it_is_less_than_the_least_volume() -> None:
    objects = Scene().add().sphere([0.0, 0.0, RADIUS_M + INFLATED_M + FREE_M + 0.001], 0.001).objects()
    onsets = ways_of(ball_pose(), objects, along(AHEAD, INFLATED_M))
    assert 4.0 / 3.0 * np.pi * 0.001**3 < np.pi * (RADIUS_M + INFLATED_M) * LEAST_DEPTH_M**2
    assert FREE_M - MARGIN_M < onsets[0] < onsets[7] < FREE_M


@pytest.mark.parametrize("gap_m", [0.0, 0.002, 0.005])
def test_a_ball_that_the_inflated_sphere_has_swallowed_is_felt(gap_m: float) -> None:
    inflated_m = gap_m + 2.0 * 0.003 + 0.001
    onsets = ways_of(ball_pose(), thing("pea", RADIUS_M + gap_m), along(AHEAD, inflated_m))
    free_m = gap_m - inflated_m
    assert free_m - MARGIN_M < onsets[0] < onsets[7] < free_m
    # From behind it is not.
    behind = Scene().add().sphere([0.0, 0.0, -RADIUS_M - gap_m - 0.003], 0.003).objects()
    assert np.isinf(ways_of(ball_pose(), behind, along(AHEAD, inflated_m))).all()


# Distances by position


@repeatable
@given(seed=seeds, ahead_m=st.floats(0.0, 0.05))
def test_ways_fall_by_just_as_much_as_the_gripper_goes_ahead(seed: int, ahead_m: float) -> None:
    """Between two looks the law subtracts the gripper's motion from the distances: this holds up to the contact."""
    rng = np.random.default_rng(seed)
    direction, scene = rng.normal(size=3), Scene()
    direction /= np.linalg.norm(direction)
    for distance_m in rng.uniform(0.12, 0.2, 6):
        center = distance_m * direction + rng.uniform(-0.03, 0.03, 3)
        scene.add().sphere(center, float(rng.uniform(0.003, 0.03)))
        scene.add().box(center, rng.uniform(0.002, 0.02, 3), random_rotation(rng))
        scene.add().tetrahedron(center + rng.normal(size=(4, 3)) * 0.01)
    objects, looked = scene.objects(), along(direction, 0.005, reach_m=0.25)
    centers, radii = rng.uniform(-0.02, 0.02, (3, 3)), rng.uniform(0.004, 0.02, 3)
    here, there = (
        look(free_pose(centers, radii, tool_position_m=way_m * direction), objects, looked) for way_m in (0.0, ahead_m)
    )
    if ahead_m < here.fast_m[0] - 1e-6:
        np.testing.assert_allclose(there.fast_m, here.fast_m - ahead_m, atol=EQUAL_M)
        np.testing.assert_allclose(there.slow_m, here.slow_m - ahead_m, atol=EQUAL_M)


def any_gripper(rng: np.random.Generator) -> GripperPose:
    return free_pose(rng.uniform(-0.03, 0.03, (8, 3)), rng.uniform(0.004, 0.02, 8))


@repeatable
@given(seed=seeds)
def test_moving_and_turning_everything_changes_no_way(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rotation, offset = random_rotation(rng), rng.uniform(-2.0, 2.0, 3)
    pose = any_gripper(rng)
    here, there = Scene(), Scene()
    for _ in range(4):
        center, half, turned = rng.uniform(-0.1, 0.1, 3), rng.uniform(0.002, 0.04, 3), random_rotation(rng)
        corners, normal = center + rng.normal(size=(4, 3)) * 0.03, turned[:, 0]
        here.add().sphere(center, half[0]).add().box(center, half, turned).add().tetrahedron(corners)
        here.add().half_space(normal, -0.1)
        moved = rotation @ center + offset
        there.add().sphere(moved, half[0]).add().box(moved, half, rotation @ turned)
        there.add().tetrahedron(corners @ rotation.T + offset)
        there.add().half_space(rotation @ normal, -0.1 + float(rotation @ normal @ offset))
    direction = any_gripper(rng).sphere_centers_m[0]
    direction /= np.linalg.norm(direction)
    centers_m = pose.sphere_centers_m @ rotation.T
    placed = free_pose(centers_m, pose.sphere_radii_m, tool_position_m=offset)
    expected = ways_of(pose, here.objects(), along(direction, 0.004))
    np.testing.assert_allclose(
        ways_of(placed, there.objects(), along(rotation @ direction, 0.004)), expected, atol=EQUAL_M
    )


@repeatable
@given(seed=seeds)
def test_the_field_is_the_least_over_objects_and_spheres(seed: int) -> None:
    """The field of all equals the shortest distances of each object alone and of each sphere alone.

    So no object or sphere lengthens a distance, and nothing is left out wrongly for speed.
    """
    rng = np.random.default_rng(seed)
    objects, pose = random_scene(rng, 3, 0.15), any_gripper(rng)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    looked = along(direction, float(rng.uniform(0.0, 0.02)), reach_m=float(rng.uniform(0.1, 0.6)))
    whole = ways_of(pose, objects, looked)
    passed_over, obstacle = 3, 0
    count = len(objects.names)
    alone = [
        look(pose, objects, looked, classes=[obstacle if k == thing else passed_over for k in range(count)]).fast_m
        for thing in range(count)
    ]
    np.testing.assert_allclose(whole, np.min(alone, axis=0), atol=EQUAL_M)
    of_spheres = [
        ways_of(free_pose([center], [radius]), objects, looked)
        for center, radius in zip(pose.sphere_centers_m, pose.sphere_radii_m, strict=True)
    ]
    np.testing.assert_allclose(whole, np.min(of_spheres, axis=0), atol=EQUAL_M)


# Distances by uncertainty


def test_more_probability_and_more_doubt_shorten_all_ways() -> None:
    wall = thing("wall", FRONT_M + 0.1)
    fields = [
        ways_of(GRIPPER, wall, along(AHEAD, 0.001, quantile=quantile, variance_m2=sd_m**2))
        for quantile, sd_m in ((-3.0, 0.003), (0.0, 0.003), (1.0, 0.003), (2.33, 0.003), (2.33, 0.004), (3.09, 0.004))
    ]
    for before, after in pairwise(fields):
        assert (after < before).all()
    # Each distance is shorter by the growth of the spheres, apart from the other curvature of a larger sphere.
    np.testing.assert_allclose(fields[2] - fields[3], 1.33 * 0.003, atol=3e-4)


def test_nothing_shrinks_a_gripper() -> None:
    wall = thing("wall", FRONT_M + 0.1)
    np.testing.assert_array_equal(
        ways_of(GRIPPER, wall, along(AHEAD, -0.05)), ways_of(GRIPPER, wall, along(AHEAD, 0.0))
    )
