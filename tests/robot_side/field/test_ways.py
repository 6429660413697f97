"""Onset distances to primitives, against their definition."""

from dataclasses import replace

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.field.field import Ahead
from robot_side.field.look import MARGIN_M
from robot_side.field.object_class import OBSTACLE, TARGET, TOUCHABLE
from robot_side.field.scratch import Count
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, EQUAL_M, RADIUS_M, along, ball_pose, judged, look
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

KINDS = ("sphere", "box", "tetrahedron", "half_space", "ellipsoid")
REACH_M = 0.12


def add_any(scene: Scene, rng: np.random.Generator, kind: str) -> None:
    """Add a primitive near the path, from 2 to 100 mm thick."""
    center = rng.uniform(-0.06, 0.06, 3) + 0.06 * AHEAD
    size = float(np.exp(rng.uniform(np.log(0.002), np.log(0.05))))
    if kind == "sphere":
        scene.sphere(center, size)
    elif kind == "box":
        scene.box(center, size * rng.uniform(0.2, 2.0, 3), random_rotation(rng))
    elif kind == "tetrahedron":
        scene.tetrahedron(center + rng.normal(size=(4, 3)) * size)
    elif kind == "ellipsoid":
        scene.ellipsoid(center, size * rng.uniform(0.2, 2.0, 3), random_rotation(rng))
    else:
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        scene.half_space(normal, float(normal @ center) - float(rng.uniform(0.0, 0.1)))


def any_direction(rng: np.random.Generator) -> FloatArray:
    direction: FloatArray = 0.3 * rng.normal(size=3) + AHEAD
    return direction / np.linalg.norm(direction)


def any_scene(rng: np.random.Generator, kinds: tuple[str, ...]) -> PerceivedObjects:
    """Draw up to three objects of one or two primitives, which may overlap each other."""
    scene = Scene()
    for _ in range(rng.integers(1, 4)):
        scene.add()
        for _ in range(rng.integers(1, 3)):
            add_any(scene, rng, str(rng.choice(kinds)))
    return scene.objects()


def compared(kinds: tuple[str, ...], scenes: range, spheres: int) -> FloatArray:
    """Return the errors of both lists' onset distances in random scenes, of those that are known in full."""
    by, errors = Ahead(np.full(6, 2e-3)), []
    for seed in scenes:
        rng = np.random.default_rng(seed)
        objects, count = any_scene(rng, kinds), int(rng.integers(1, spheres + 1))
        centers_m, radii_m = rng.uniform(-0.02, 0.02, (count, 3)), rng.uniform(0.004, 0.03, count)
        inflated, direction, things = float(rng.uniform(-0.004, 0.012)), any_direction(rng), len(objects.names)
        looked = replace(
            along(direction, inflated, variance_m2=0.002**2, quantile=rng.uniform(0.0, 2.5), reach_m=REACH_M),
            mean_along_m=rng.uniform(-0.002, 0.002),
            variance_along_m2=rng.uniform(0.0, 0.002) ** 2,
            approach_m=rng.uniform(0.0, 0.02, things) if seed % 2 else None,
        )
        if seed % 3 == 0:
            own = np.stack([rng.uniform(0.0, 0.01, things), rng.uniform(0.0, 0.006, things) ** 2], axis=1)
            looked = replace(looked, of_objects=own, unseen_m=own[:, 0].max(), variance_m2=own[:, 1].max())
        pose = free_pose(centers_m, radii_m, rng.random(count) < 0.5)
        classes = rng.choice([OBSTACLE, OBSTACLE, TOUCHABLE, TARGET], things).tolist()
        widest_m = float(rng.choice([0.002, 0.01, np.inf]))
        errors.append(judged(pose, objects, looked, by=by, classes=classes, widest_m=widest_m).off_m)
    return np.abs(np.concatenate(errors))


def test_the_ways_to_objects_of_all_kinds_are_those_of_the_definition() -> None:
    errors = compared(KINDS, range(200), 3)
    assert len(errors) > 1000
    assert errors.max() < EQUAL_M


@pytest.mark.parametrize("inflated_m", [0.0, 0.007])
@pytest.mark.parametrize("degrees", [0.3, 0.5, 1.0, 2.0, 5.0])
@pytest.mark.parametrize("gap_m", [0.0005, 0.003, 0.0065, 0.008, 0.012])
def test_a_graze_is_followed_however_long_it_is(inflated_m: float, degrees: float, gap_m: float) -> None:
    """The sphere goes half a metre along a wall that hardly leans in. The uninflated sphere's contacts count, too."""
    angle = np.radians(degrees)
    wall = Scene().add().half_space([np.cos(angle), 0.0, -np.sin(angle)], -RADIUS_M - gap_m).objects()
    found = judged(ball_pose(), wall, along(AHEAD, inflated_m, reach_m=0.5))
    assert np.abs(found.off_m).max(initial=0.0) < EQUAL_M


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_met_beyond_the_reach_nor_behind(kind: str) -> None:
    scene = Scene().add()
    add = {
        "sphere": lambda: scene.sphere([0.0, 0.0, 0.3], 0.1),
        "box": lambda: scene.box([0.0, 0.0, 0.3], [0.05, 0.05, 0.1]),
        "tetrahedron": lambda: scene.tetrahedron(
            [[0.0, 0.0, 0.2], [0.1, 0.0, 0.3], [-0.1, 0.1, 0.3], [0.0, -0.1, 0.3]]
        ),
        "half_space": lambda: scene.half_space([0.0, 0.0, -1.0], -0.2),
        "ellipsoid": lambda: scene.ellipsoid([0.0, 0.0, 0.3], [0.05, 0.05, 0.1]),
    }
    add[kind]()
    for sign, reach, met in ((1.0, 0.181, True), (1.0, 0.179, False), (-1.0, 1.0, False)):
        direction = np.array([0.0, 0.0, sign])
        # Strengths begin up to a margin before the contact. So an object up to a margin beyond the reach is still met.
        found = look(ball_pose(0.01), scene.objects(), along(direction, reach_m=reach - MARGIN_M + 0.01))
        assert bool(found.counts[Count.PAIRS] > 0) is met
