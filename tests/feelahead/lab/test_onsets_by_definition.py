"""The definition of onset distances, by which the field is judged, compared with closed forms and a fine grid."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray, IntArray
from feelahead.lab.approaches.ticks import DEMO, record
from feelahead.lab.reference import onsets_by_definition
from feelahead.lab.reference.looks import compare, looks_of
from feelahead.lab.reference.onsets_by_definition import GRAZE_M, Defined, defined_onsets, statistical_m
from feelahead.lab.reference.solids import Solids
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.field.object_class import OBSTACLE, SKIPPED, TARGET, TOUCHABLE
from robot_side.overlap import Mesh
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, RADIUS_M, along, ball_pose
from tests.helpers.gripper_poses import free_pose
from tests.helpers.meshes import cup
from tests.helpers.perceived_scenes import Scene, random_rotation

MARGIN_M, REACH_M, STEP_M = 0.012, 0.06, 3e-5
ENCODER_SIGMA_RAD = np.full(6, 2e-3)
DUE = (np.arange(8) + 0.5) / 8


def any_scene(rng: np.random.Generator) -> PerceivedObjects:
    """Draw up to three objects, each of up to three primitives, around the gripper and ahead of it."""
    scene = Scene()
    for _ in range(rng.integers(1, 4)):
        scene.add()
        for kind in rng.choice(5, rng.integers(1, 4)):
            center, size = rng.uniform((-0.05, -0.05, -0.05), (0.05, 0.05, 0.1)), float(rng.uniform(0.002, 0.03))
            if kind == 0:
                scene.sphere(center, size)
            elif kind == 1:
                scene.box(center, size * rng.uniform(0.1, 2.0, 3), random_rotation(rng))
            elif kind == 2:
                scene.tetrahedron(center + size * rng.normal(size=(4, 3)))
            elif kind == 3:
                scene.mesh(Mesh(*cup()), center, random_rotation(rng))
            else:
                normal = rng.normal(size=3)
                scene.half_space(normal / np.linalg.norm(normal), float(-rng.uniform(0.0, 0.05)))
    return scene.objects()


def on_a_grid(
    pose: GripperPose, objects: PerceivedObjects, classes: IntArray, ahead: Along, widest_m: float
) -> FloatArray:
    """Return the onset distances (2, 8) from all pairs of sphere and object, none of which is skipped."""
    alone_m, sigma_m = statistical_m(pose, ahead, ENCODER_SIGMA_RAD)
    along_m, expected_m = max(0.0, (sigma_m - alone_m).max()), max(0.0, ahead.mean_m + ahead.mean_along_m)
    solids, onsets_m = Solids(objects), np.full((2, 8), np.inf)
    for thing, object_class in enumerate(classes):
        approach_m = along_m + (0.0 if ahead.approach_m is None else ahead.approach_m[thing])
        for i, center in enumerate(pose.sphere_centers_m if object_class != SKIPPED else ()):
            inflated_m = min(alone_m[i], widest_m if object_class == TARGET and pose.sphere_on_finger[i] else np.inf)
            for radius, sooner_m in (
                (pose.sphere_radii_m[i] + inflated_m, approach_m),
                (pose.sphere_radii_m[i], approach_m + inflated_m),
            ):
                grid_m = np.arange(0.0, REACH_M + 2 * MARGIN_M + sooner_m, STEP_M)
                many = np.full(len(grid_m), radius), np.full(len(grid_m), thing)
                volumes, gradients = solids.overlap(center + grid_m[:, None] * ahead.direction, *many)
                risen = np.maximum.accumulate(np.maximum(volumes - volumes[0], 0.0))
                free = int(np.argmax(risen > 4e-9 * radius**3))
                if free:
                    full = min(free + round(MARGIN_M / STEP_M), len(grid_m) - 1)
                    least = min(np.pi * radius * 0.0005**2, 0.5 * solids.volumes_m3[thing])
                    strengths = risen / max(risen[full], MARGIN_M * np.linalg.norm(gradients[0]), least)
                    places = np.searchsorted(strengths, DUE)
                    own_m = np.append(grid_m, np.inf)[places] - MARGIN_M - sooner_m
                    onsets_m[0] = np.minimum(onsets_m[0], own_m)
                    if object_class in (TARGET, TOUCHABLE):
                        own_m = own_m + max(inflated_m + along_m - expected_m, 0.0)
                        own_m[4:] = np.inf
                    onsets_m[1] = np.minimum(onsets_m[1], own_m)
                if volumes[0] == 0.0:
                    break
    return onsets_m


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_look_is_defined_as_on_a_grid(seed: int) -> None:
    """The scenes have objects of all kinds and roles, moving and swallowed ones, and fingers near a target."""
    rng = np.random.default_rng(seed)
    objects, count = any_scene(rng), int(rng.integers(1, 6))
    pose = free_pose(rng.uniform(-0.03, 0.03, (count, 3)), rng.uniform(0.004, 0.02, count), rng.random(count) < 0.5)
    direction, things = AHEAD + 0.4 * rng.normal(size=3), len(objects.names)
    approach_m = rng.uniform(0.0, 0.02, things) if rng.random() < 0.5 else None
    mean_m, direction = float(rng.uniform(-0.004, 0.006)), direction / np.linalg.norm(direction)
    missed = float(rng.uniform(-0.002, 0.002)), float(rng.uniform(0.0, 0.002)) ** 2
    ahead = Along(direction, mean_m, 0.002**2, 2.326, REACH_M, *missed, approach_m)
    classes = rng.choice([OBSTACLE, OBSTACLE, TOUCHABLE, TARGET, SKIPPED], things).astype(np.int64)
    widest_m = float(rng.choice([0.002, 0.01, np.inf]))
    expected_m = on_a_grid(pose, objects, classes, ahead, widest_m)
    defined = defined_onsets(pose, objects, classes, ahead, widest_m, ENCODER_SIGMA_RAD)
    judged = defined.judge(expected_m, REACH_M)
    assert np.abs(judged.off_m).max(initial=0.0) < 2.0 * STEP_M
    assert ((defined.things >= 0) == (defined.onsets_m[0] < np.inf)).all()


@pytest.mark.parametrize("inflated_m", [0.0, 0.007])
def test_before_a_wall_the_ways_are_those_of_a_cap(inflated_m: float) -> None:
    radius, gap_m = RADIUS_M + inflated_m, 0.03
    wall = Scene().add().half_space(-AHEAD, -RADIUS_M - gap_m).objects()
    none = np.zeros(1, dtype=np.int64)
    defined = defined_onsets(ball_pose(), wall, none, along(AHEAD, inflated_m), np.inf, np.zeros(6))
    depths = defined.onsets_m[0, 0] + MARGIN_M - (gap_m - inflated_m)

    def cap(depth: FloatArray | float) -> FloatArray | float:
        return np.pi * depth**2 * (radius - depth / 3.0)

    np.testing.assert_allclose(cap(depths) / cap(MARGIN_M), DUE, atol=1e-3)
    np.testing.assert_array_equal(defined.onsets_m[:, 0], defined.onsets_m[:, 1])
    assert (defined.onsets_m[1] < defined.onsets_m[0]).all()
    assert (defined.onsets_m[0] < defined.onsets_m[2]).all()
    assert defined.sigma_m == inflated_m


def test_a_way_is_off_by_its_distance_and_in_a_graze_from_its_band() -> None:
    onsets_m = np.full((3, 2, 8), np.inf)
    onsets_m[:, 0, 0], onsets_m[:, 0, 1], onsets_m[:, 0, 2] = (0.1, 0.0998, 0.1002), (0.1, 0.09, 0.2), (0.3, 0.29, 0.31)
    defined = Defined(onsets_m, 0.0, np.zeros((2, 8), dtype=np.int64))
    assert onsets_m[2, 0, 1] - onsets_m[1, 0, 1] > GRAZE_M
    found_m = np.full((2, 8), np.inf)
    for first, second, off_m in ((0.101, 0.19, (0.001, 0.0)), (0.05, 0.08, (-0.05, -0.01)), (0.1, np.inf, (0.0, 0.05))):
        found_m[0, :2] = first, second
        judged = defined.judge(found_m, 0.25)
        np.testing.assert_allclose(judged.off_m, off_m, atol=1e-12)
        assert judged.grazes.tolist() == [False, True]
    found_m[0, 0] = np.nan
    assert defined.judge(found_m, 0.25).off_m[0] == np.inf


@pytest.mark.long
def test_looks_of_the_demo_are_noted_and_another_law_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    recorded = record(DEMO, 6.2)
    spheres = [len(tick.situation.pose.sphere_radii_m) for tick in recorded.ticks]
    gripped = spheres.index(max(spheres))
    near = replace(recorded, ticks=recorded.ticks[gripped - 200 : gripped + 61])
    asked, encoder_sigma_rad = looks_of(near, 40)
    assert {len(one.pose.sphere_radii_m) for one, _ in asked} == {246, 383}
    assert 20 < len(asked) <= 40
    found = compare(asked, encoder_sigma_rad).row()
    assert found["looks"] == len(asked)
    assert found["distances"] > 200
    assert (found["late"], found["out_of_band"]) == (0, 0)
    assert found["sigma_off_mm"] < 1e-9
    monkeypatch.setattr(onsets_by_definition, "MARGIN_M", 0.0125)
    assert compare(asked, encoder_sigma_rad).row()["late"] > 100
