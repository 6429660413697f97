"""Volume shared by a union of spheres and objects, against a count of voxels, and against what must hold for any."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import BoolArray, FloatArray
from feelahead.lab.reference.voxels import voxel_volume_m3
from robot_side.field.object_class import SKIPPED
from robot_side.field.shared_volume import shared_volume_m3
from robot_side.field.total_overlap import total_overlap_m3
from robot_side.overlap import Mesh
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.gripper_poses import gripper_pose
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene

Inside = Callable[[FloatArray], BoolArray]
NOT_FINER = {"step_m": 0.004}
TABLE_M = np.array([0.03, -0.02, 0.06]), np.array([0.15, 0.2, 0.05])


def shared(spheres: FloatArray, objects: PerceivedObjects, **given: float) -> tuple[float, FloatArray]:
    """Return the volume shared with all objects, and its parts in each."""
    of_objects = np.zeros(len(objects.names))
    classes = np.zeros(len(objects.names), dtype=np.int64)
    return shared_volume_m3(spheres, scene_table(objects), classes, of_objects, **given), of_objects


def gripper(inflated_m: float, rotation: FloatArray | None = None) -> FloatArray:
    pose = gripper_pose(tool_rotation=rotation)
    return np.column_stack([pose.sphere_centers_m, pose.sphere_radii_m + inflated_m])


def near_enough(volume_m3: float) -> float:
    """Return the error that the module allows: 1 % or 100 mm³."""
    return max(0.01 * volume_m3, 1e-7)


def box(center: FloatArray, half: FloatArray, rotation: FloatArray) -> Inside:
    return lambda points: np.abs((points - center) @ rotation / half).max(axis=1, initial=0.0) <= 1.0


def egg(center: FloatArray, half: FloatArray, rotation: FloatArray) -> Inside:
    return lambda points: ((((points - center) @ rotation) / half) ** 2).sum(axis=1) <= 1.0


def in_either(first: Inside, second: Inside) -> Inside:
    return lambda points: np.logical_or(first(points), second(points))


TURNED = random_rotation(np.random.default_rng(8))
AT, SIZE = np.array([0.02, 0.01, 0.03]), np.array([0.06, 0.02, 0.04])
SECOND = AT + 0.03, np.array([0.01, 0.1, 0.02])
HALVES = Scene().add().box_of_tetrahedra(AT, SIZE, TURNED).add().box(*SECOND, TURNED)
CUBE = Mesh(CUBE_CORNERS * SIZE, CUBE_TRIANGLES)


@pytest.mark.parametrize(
    ("scene", "inside"),
    [
        (Scene().add().box(AT, SIZE, TURNED), box(AT, SIZE, TURNED)),
        (Scene().add().mesh(CUBE, AT, TURNED), box(AT, SIZE, TURNED)),
        (HALVES, in_either(box(AT, SIZE, TURNED), box(*SECOND, TURNED))),
        (Scene().add().ellipsoid(AT, SIZE, TURNED), egg(AT, SIZE, TURNED)),
        (Scene().add().sphere(AT, 0.05), egg(AT, np.full(3, 0.05), TURNED)),
        (Scene().add().half_space(TURNED[0], 0.01), lambda points: points @ TURNED[0] <= 0.01),
    ],
    ids=["box", "mesh", "tetrahedra and box", "ellipsoid", "sphere", "half-space"],
)
@pytest.mark.parametrize("inflated_m", [0.0, 0.01])
def test_it_is_what_voxels_count(scene: Scene, inside: Inside, inflated_m: float) -> None:
    spheres = gripper(inflated_m)
    found, parts = shared(spheres, scene.objects())
    counted = voxel_volume_m3(spheres, inside, 0.001)
    assert counted > 3e-6
    assert found == pytest.approx(counted, abs=near_enough(counted))
    # The spheres cover one another.
    assert total_overlap_m3(spheres, scene_table(scene.objects()), np.zeros(2, dtype=np.int64)) > 1.5 * found
    assert parts.sum() == pytest.approx(found, rel=1e-9)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 12))
def test_it_is_below_every_bound_and_grows_with_the_spheres(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 2, 0.25, meshes=1)
    spheres = np.column_stack([rng.uniform(-0.2, 0.2, (count, 3)), rng.uniform(0.005, 0.1, count)])
    everything = Scene().add().half_space([0.0, 0.0, 1.0], 9.0).objects()
    whole, _ = shared(spheres, everything, **NOT_FINER)
    found, parts = shared(spheres, objects, **NOT_FINER)
    assert found <= whole * (1.0 + 1e-9)
    assert parts.min() >= 0.0
    assert parts.sum() == pytest.approx(found, rel=1e-9)
    larger = np.column_stack([spheres[:, :3], spheres[:, 3] + rng.uniform(0.0, 0.02)])
    assert found <= shared(larger, objects, **NOT_FINER)[0] * (1.0 + 1e-9)
    # Also with its own grid.
    total_m3 = total_overlap_m3(spheres, scene_table(objects), np.zeros(len(objects.names), dtype=np.int64))
    coarse, _ = shared(spheres, objects)
    assert coarse <= total_m3 + near_enough(total_m3)
    assert coarse == pytest.approx(shared(spheres, objects, step_m=0.001)[0], abs=near_enough(found))


def test_of_spheres_apart_it_is_the_sum_of_their_overlaps() -> None:
    rng = np.random.default_rng(3)
    centers_m = 0.1 * np.stack(np.meshgrid(*(np.arange(3.0),) * 3), axis=-1).reshape(-1, 3)
    spheres = np.column_stack([centers_m, rng.uniform(0.01, 0.049, 27)])
    objects = Scene().add().box([0.05, 0.0, 0.0], [0.11, 0.2, 0.2], TURNED).objects()
    found, parts = shared(spheres, objects)
    total_m3 = total_overlap_m3(spheres, scene_table(objects), np.zeros(1, dtype=np.int64))
    assert found == parts.sum() == pytest.approx(total_m3, rel=0.01)


def of_center(scene: Scene, center: FloatArray, corners: FloatArray) -> Scene:
    for triangle in CUBE_TRIANGLES:
        scene.tetrahedron([center, *corners[triangle]])
    return scene


def test_a_table_is_the_same_of_whatever_it_is_made() -> None:
    center, half = TABLE_M
    corners = center + CUBE_CORNERS * half
    left, right = ((center + np.array([at, 0.0, 0.0]), [wide, *half[1:]]) for at, wide in ((-0.05, 0.1), (0.1, 0.05)))
    scenes = (
        Scene().add().box(center, half),
        Scene().add().box(*left).box(*right),
        # Boxes that overlap, of one object and of two, and a whole one twice.
        Scene().add().box(*left).box(center, half),
        Scene().add().box(center, half).add().box(center, half),
        of_center(Scene().add(), center, corners),
        Scene().add().mesh(Mesh(corners, CUBE_TRIANGLES), [0.0, 0.0, 0.0]),
    )
    spheres = gripper(0.007, TURNED)
    expected, *others = (shared(spheres, scene.objects(), **NOT_FINER)[0] for scene in scenes)
    assert expected > 1e-5
    assert others == pytest.approx([expected] * len(others), rel=1e-9)


def test_what_is_far_or_passed_over_shares_nothing_and_a_graze_little() -> None:
    ball, classes = np.array([[0.0, 0.0, 0.0, 0.05]]), np.array([SKIPPED, 0])
    objects = Scene().add().box(np.zeros(3), np.full(3, 0.2)).add().sphere([0.2, 0.0, 0.0], 0.149).objects()
    of_objects = np.full(2, -1.0)
    assert shared_volume_m3(ball, scene_table(objects), classes, of_objects) == 0.0
    assert of_objects.tolist() == [-1.0, -1.0]
    graze_m3 = shared_volume_m3(ball + np.array([0.00101, 0.0, 0.0, 0.0]), scene_table(objects), classes)
    assert graze_m3 == pytest.approx(np.pi * 0.0375 * 0.00001**2, abs=1e-10)
    with pytest.raises(ValueError, match="spheres holds NaN or infinity"):
        shared_volume_m3(np.full((1, 4), np.nan), scene_table(objects), classes)
