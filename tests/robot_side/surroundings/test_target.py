import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.roles import Role
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table
from robot_side.surroundings.surroundings import Surroundings
from robot_side.surroundings.target import next_target, object_centers
from tests.helpers.perceived_scenes import Scene

ORIGIN = np.zeros(3)
AHEAD = np.array([0.0, 0.0, 1.0])
PLANE = "plane"


def balls(*places: tuple[list[float], Role]) -> PerceivedObjects:
    scene = Scene()
    for center, role in places:
        scene.add(role).sphere(center, 0.01)
    return scene.objects()


def following(
    objects: PerceivedObjects, tool_position_m: FloatArray = ORIGIN, approach: FloatArray = AHEAD
) -> str | None:
    present = Surroundings().target(objects)
    return next_target(objects, present, object_centers(scene_table(objects)), tool_position_m, approach)


def test_centres_are_the_mean_of_the_primitives_centres() -> None:
    scene = Scene().add().sphere([1.0, 0.0, 0.0], 0.1).box([0.0, 2.0, 0.0], [0.1, 0.1, 0.1])
    scene.tetrahedron([[0.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 4.0, 4.0], [8.0, 0.0, 4.0]])
    scene.add().box([0.5, 0.5, 0.5], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(object_centers(scene_table(scene.objects())), [[1.0, 1.0, 1.0], [0.5, 0.5, 0.5]])


def test_what_has_no_middle_has_no_centre() -> None:
    scene = Scene().add(Role.SUPPORT).half_space(AHEAD, 0.0).add(Role.IGNORED).add().sphere([0.1, 0.2, 0.3], 0.1)
    centers = object_centers(scene_table(scene.objects()))
    assert np.isnan(centers[:2]).all()
    np.testing.assert_array_equal(centers[2], [0.1, 0.2, 0.3])
    assert object_centers(scene_table(Scene().objects())).shape == (0, 3)


def test_the_target_is_found_by_its_role() -> None:
    seeing = Surroundings()
    assert seeing.target(balls(([0.0, 0.0, 0.1], Role.OBSTACLE), ([0.0, 0.0, 0.2], Role.TARGET))) == 1
    assert seeing.target(balls(([0.0, 0.0, 0.1], Role.OBSTACLE), ([0.0, 0.0, 0.2], Role.IGNORED))) is None
    assert seeing.target(Scene().objects()) is None


@settings(derandomize=True, deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(2, 7))
def test_pressing_again_and_again_visits_each_in_order_of_nearness_and_begins_anew(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    approach = random.normal(size=3)
    approach /= np.linalg.norm(approach)
    across = np.cross(approach, random.normal(size=3))
    tool = random.normal(size=3)
    places = (
        tool + random.uniform(0.1, 2.0, count)[:, None] * approach + random.uniform(0, 0.2, count)[:, None] * across
    )
    offsets = places - tool
    along = offsets @ approach
    order = np.argsort(along + 3.0 * np.linalg.norm(offsets - along[:, None] * approach, axis=1))
    roles = [Role.OBSTACLE] * count
    visited = []
    for _ in range(count + 1):
        objects = balls(*zip(places.tolist(), roles, strict=True))
        chosen = following(objects, tool, approach)
        assert chosen is not None
        visited.append(objects.names.index(chosen))
        roles = [Role.TARGET if name == chosen else Role.OBSTACLE for name in objects.names]
    assert visited == [*order.tolist(), order[0]]


def test_a_target_that_has_been_passed_keeps_its_place_in_the_order() -> None:
    objects = balls(([0.0, 0.0, 0.4], Role.OBSTACLE), ([0.0, 0.0, -0.1], Role.TARGET), ([0.0, 0.0, 0.2], Role.OBSTACLE))
    assert following(objects) == "object2"


def test_there_is_no_other() -> None:
    assert following(Scene().objects()) is None
    assert following(balls(([0.0, 0.0, 0.2], Role.TARGET))) is None
    behind = ([0.0, 0.0, -0.2], Role.OBSTACLE)
    assert following(balls(([0.0, 0.0, 0.2], Role.TARGET), behind)) is None
    assert following(balls(behind)) is None


@pytest.mark.parametrize("role", [Role.SUPPORT, Role.IGNORED, None])
def test_supports_what_is_ignored_and_half_spaces_are_never_chosen(role: Role | None) -> None:
    scene = Scene()
    scene.add().half_space(AHEAD, 5.0) if role is None else scene.add(role).sphere([0.0, 0.0, 0.1], 0.01)
    assert following(scene.add(Role.TARGET).sphere([0.0, 0.0, 0.3], 0.01).objects()) is None
    assert following(scene.add().sphere([0.0, 0.0, 0.4], 0.01).objects()) == "object2"


@pytest.mark.parametrize("order", list(itertools.permutations(["near", PLANE, "middle", "far"])))
def test_a_half_space_that_somebody_made_the_target_gives_way_to_the_nearest(order: tuple[str, ...]) -> None:
    distances = {"near": 0.1, "middle": 0.2, "far": 0.3}
    scene = Scene()
    for name in order:
        if name == PLANE:
            scene.add(Role.TARGET).half_space(AHEAD, 0.5)
        else:
            scene.add().sphere([0.0, 0.0, distances[name]], 0.01)
    assert following(scene.objects()) == f"object{order.index('near')}"
