"""Room for more: what does not fit into the tables at first is found all the same."""

from functools import cache

import numpy as np
import pytest

from feelahead.lab.reference.meshes import CUBE_CORNERS, CUBE_TRIANGLES
from robot_side.ahead.field import Ahead, Field
from robot_side.ahead.scene_table import scene_table
from robot_side.ahead.tables import BLOCK, MEETING, PAIR, RAMP, Jobs, Tables
from robot_side.ahead.total_overlap import total_overlap_m3
from robot_side.arm.port import GripperPose
from robot_side.objects.perceived import PerceivedObjects
from robot_side.overlap import Mesh
from tests.helpers.ahead.fields import AHEAD, along, look
from tests.helpers.gripper_poses import free_pose, gripper_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

LOOKED = along(AHEAD, 0.007, reach_m=0.2)


def smallest() -> Tables:
    return Tables(
        meetings=np.zeros(1, dtype=MEETING),
        ramps=np.zeros(2 * BLOCK, dtype=RAMP),
        pairs=np.zeros(8, dtype=PAIR),
        jobs=Jobs(1),
        near=np.zeros(1, dtype=np.int64),
        most_spheres=1,
    )


def largest() -> Tables:
    return Tables(
        meetings=np.zeros(20_000, dtype=MEETING),
        ramps=np.zeros(20_000, dtype=RAMP),
        pairs=np.zeros(500_000, dtype=PAIR),
        jobs=Jobs(100_000),
        near=np.zeros(10_000, dtype=np.int64),
        most_spheres=2000,
    )


@cache
def crowd(kind: str, of_one_object: bool) -> PerceivedObjects:
    """2000 small things ahead, near and far, of one kind or all."""
    rng, scene = np.random.default_rng(5), Scene().add()
    cube = Mesh(0.004 * CUBE_CORNERS, CUBE_TRIANGLES)
    for number in range(400 if kind == "mesh" else 2000):
        if not of_one_object:
            scene.add()
        center = rng.uniform([-0.08, -0.05, -0.05], [0.08, 0.05, 0.25])
        which = kind if kind != "all" else ("box", "tetrahedron", "sphere", "half_space")[number % 4]
        if which == "box":
            scene.box(center, rng.uniform(0.001, 0.006, 3), random_rotation(rng))
        elif which == "tetrahedron":
            scene.tetrahedron(center + rng.normal(size=(4, 3)) * 0.004)
        elif which == "sphere":
            scene.sphere(center, float(rng.uniform(0.001, 0.006)))
        elif which == "mesh":
            scene.mesh(cube, center, random_rotation(rng))
        else:
            normal = rng.normal(size=3)
            normal *= -np.sign(normal[2]) / np.linalg.norm(normal)
            scene.half_space(normal, -float(rng.uniform(0.1, 0.3)))
    return scene.objects()


def fields(pose: GripperPose, objects: PerceivedObjects) -> list[Field]:
    grippers = [Ahead(np.zeros(6), tables=tables) for tables in (largest(), Tables(), smallest())]
    # Twice, as what has grown is used again, too.
    return [look(pose, objects, LOOKED, by=by) for by in grippers for _ in range(2)]


@pytest.mark.parametrize("kind", ["box", "tetrahedron", "sphere", "half_space", "mesh", "all"])
@pytest.mark.parametrize("of_one_object", [True, False], ids=["one object", "many"])
def test_tables_that_are_too_small_grow_and_change_nothing(kind: str, of_one_object: bool) -> None:
    pose = gripper_pose(stand_out_m=0.01)
    reference, *others = fields(pose, crowd(kind, of_one_object))
    assert np.isfinite(reference.fast_m).any()
    for found in others:
        np.testing.assert_allclose(found.fast_m, reference.fast_m, atol=1e-9)
        np.testing.assert_allclose(found.slow_m, reference.slow_m, atol=1e-9)


def test_more_spheres_than_there_is_room_for_are_all_looked_at() -> None:
    rng = np.random.default_rng(6)
    centers = np.append(rng.uniform(-0.1, 0.1, (3000, 3)), [[0.0, 0.0, 0.15]], axis=0)
    pose = free_pose(centers, np.full(3001, 0.004))
    reference, *others = fields(pose, Scene().add().box([0.0, 0.0, 0.25], [0.2, 0.2, 0.05]).objects())
    # The last one is the foremost.
    assert 0.2 - 0.154 - 0.007 - 0.012 < reference.fast_m[0] < 0.2 - 0.154 - 0.007
    for found in others:
        np.testing.assert_allclose(found.fast_m, reference.fast_m, atol=1e-9)


@pytest.mark.parametrize("kind", ["box", "tetrahedron", "sphere", "mesh", "all"])
def test_the_sum_of_overlaps_needs_no_room_either(kind: str) -> None:
    objects, pose = crowd(kind, False), gripper_pose(stand_out_m=0.01)
    spheres = np.concatenate([pose.sphere_centers_m, pose.sphere_radii_m[:, None] + 0.01], axis=1)
    scene, standing = scene_table(objects), np.zeros(len(objects.names), dtype=np.int64)
    large, usual, small = (total_overlap_m3(spheres, scene, standing, t) for t in (largest(), Tables(), smallest()))
    assert large > 0.0
    assert usual == pytest.approx(large, rel=1e-12)
    assert small == pytest.approx(large, rel=1e-12)
