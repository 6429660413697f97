"""The compiled law and the plain formulation agree, and the comparison would notice if they did not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from feelahead.benchmarks.felt.equality import Differences, compare
from feelahead.benchmarks.felt.plain_ways import plain_ways, primitives
from feelahead.benchmarks.felt.recorded_ticks import DEMO, Recorded, record
from feelahead.benchmarks.felt.turning import exchanged
from robot_side.ahead.field import Ahead, Along
from robot_side.ahead.find import OBSTACLE, PASSED_OVER, TARGET, TOUCHABLE
from robot_side.ahead.scene_table import scene_table
from robot_side.objects.perceived import PerceivedObjects
from robot_side.overlap import Mesh
from robot_side.overlap.meshes.mesh_shapes import capsule_mesh
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

LIMIT = 1e-12
REACH_M = 0.25
ENCODER_SIGMA_RAD = np.full(6, 2e-3)


def any_scene(rng: np.random.Generator) -> PerceivedObjects:
    """Up to four objects of up to three primitives, some about the gripper and some ahead of it."""
    scene = Scene()
    for _ in range(rng.integers(1, 5)):
        scene.add()
        for kind in rng.choice(4, rng.integers(1, 4), p=(0.25, 0.35, 0.3, 0.1)):
            center = rng.uniform((-0.08, -0.08, -0.08), (0.08, 0.08, 0.28))
            size = float(rng.uniform(0.002, 0.05))
            if kind == 0:
                scene.sphere(center, size)
            elif kind == 1:
                scene.box(center, size * rng.uniform(0.1, 2.0, 3), random_rotation(rng))
            elif kind == 2:
                scene.tetrahedron(center + size * rng.normal(size=(4, 3)))
            else:
                normal = rng.normal(size=3)
                normal /= np.linalg.norm(normal)
                scene.half_space(normal, float(normal @ center) - 0.1)
    return scene.objects()


@settings(derandomize=True, deadline=None, max_examples=100)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_look_has_the_ways_of_the_plain_formulation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    objects, count = any_scene(rng), int(rng.integers(1, 10))
    pose = free_pose(rng.uniform(-0.03, 0.03, (count, 3)), rng.uniform(0.004, 0.025, count))
    pose = replace(pose, sphere_on_finger=rng.random(count) < 0.5)
    direction = np.array([0.0, 0.0, 1.0]) + 0.4 * rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    things = len(objects.names)
    early_m = rng.uniform(0.0, 0.03, things) if rng.random() < 0.5 else None
    along = Along(direction, float(rng.uniform(-0.004, 0.006)), 0.002**2, 2.326, REACH_M, early_m)
    standing = rng.choice([OBSTACLE, OBSTACLE, TOUCHABLE, TARGET, PASSED_OVER], things).astype(np.int64)
    widest_m = float(rng.choice([0.002, 0.01, np.inf]))
    found = Ahead(ENCODER_SIGMA_RAD).look(pose, scene_table(objects), standing, along, widest_m).ways_m
    expected = plain_ways(pose, objects, standing, along, widest_m, ENCODER_SIGMA_RAD)
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(expected))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=LIMIT)


def test_meshes_are_refused() -> None:
    with pytest.raises(ValueError, match="1 meshes; valid"):
        primitives(Scene().add().mesh(Mesh(*capsule_mesh(0.01, 0.02, 8)[:2]), [0.0, 0.0, 0.1]).objects())


def test_what_only_one_knows_is_infinitely_far_apart() -> None:
    found = Differences()
    found.take("same", [np.inf, 1.0], [np.inf, 1.0])
    found.take("apart", [0.25, 1.0], [0.25, 1.5])
    found.take("one", [np.inf], [1.0])
    found.take("none", [np.nan], [np.nan])
    assert found.largest == {"same": 0.0, "apart": 0.5, "one": np.inf, "none": np.inf}


@pytest.fixture(scope="module")
def grasping() -> Recorded:
    """Those of the demo's ticks in which the target is gripped, among objects of all kinds but meshes."""
    recorded = record(DEMO, 6.2)
    return replace(recorded, ticks=recorded.ticks[5940:])


@pytest.mark.long
def test_recorded_ticks_are_those_of_the_plain_formulation(grasping: Recorded) -> None:
    found = compare(grasping)
    assert {len(tick.situation.pose.sphere_radii_m) for tick in grasping.ticks} == {246, 383}
    assert found.ticks == 261
    assert found.looks > 50
    assert found.ways > 500
    assert max(found.largest.values()) <= LIMIT


@pytest.mark.long
@pytest.mark.parametrize(
    ("module", "name", "value", "noticed"),
    [
        ("plain_ramp", "NODES_PER_MARGIN", 5, "ways of a look, m"),
        ("plain_ways", "MARGIN_M", 0.0121, "ways, m"),
        ("plain_feel", "STEADY_S", 0.01, "ways, m"),
        ("plain_feel", "HORIZON_S", 0.31, "horizon, m"),
    ],
)
def test_another_formulation_is_noticed(grasping: Recorded, module: str, name: str, value: float, noticed: str) -> None:
    some = replace(grasping, ticks=grasping.ticks[:60])
    with exchanged(f"feelahead.benchmarks.felt.{module}", **{name: value}):
        assert compare(some).largest[noticed] > LIMIT
