"""Known models beside surfaces: solids that stand for them, joined frames, roles by name."""

from dataclasses import replace

import numpy as np
import pytest

from common.roles import Role
from robot_side.depth.picture import BOX, SPHERE
from robot_side.perceiving.known_models import WithModels, solids_of
from robot_side.surroundings.fixed_objects import only
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from tests.helpers.perceived_scenes import Scene
from tests.robot_side.viewing.test_surfaces import SLOTS, seen

SIZE_M = [0.02, 0.03, 0.04]


def models(x_m: float = 1.0) -> PerceivedObjects:
    """Return a frame of a sphere, a box and a half-space."""
    scene = Scene()
    scene.add().sphere([x_m, 0.0, 0.0], 0.05)
    scene.add().box([0.0, x_m, 0.0], SIZE_M)
    scene.add().half_space([0.0, 0.0, 1.0], -1.0)
    frame = scene.objects()
    count = len(frame.names)
    names = "target", "box", "floor"
    return replace(frame, names=names, positions_m=np.zeros((count, 3)), rotations=np.tile(np.eye(3), (count, 1, 1)))


class Source:
    """Stand-in for both sources: the test says what is there."""

    def __init__(self, frame: PerceivedObjects) -> None:
        self.frame = frame
        self.roles: list[tuple[str, Role]] = []
        self.solids = np.empty((0, 16))

    def perceive(self, now_s: float) -> PerceivedObjects:
        del now_s
        return self.frame

    def set_role(self, name: str, role: Role) -> None:
        self.roles.append((name, role))

    def explain(self, solids: "np.ndarray[tuple[int, int], np.dtype[np.float64]]") -> None:
        self.solids = solids

    def put_back(self) -> None: ...

    def on_tick(self, tick: object) -> None: ...


def test_spheres_and_boxes_are_solids_and_half_spaces_are_none() -> None:
    ball, box = solids_of(models())
    assert ball[0] == SPHERE
    assert ball[1:4].tolist() == [1.0, 0.0, 0.0]
    assert ball[13] == 0.05
    assert box[0] == BOX
    assert box[13:].tolist() == SIZE_M


def test_the_tables_of_joined_frames_follow_both_sources() -> None:
    surfaces, known = Source(seen()), Source(models())
    both, law = WithModels(surfaces, known), Surroundings()
    for step, (one, other) in enumerate(((seen(), models()), (seen(40), models()), (seen(40), models(2.0)))):
        surfaces.frame, known.frame = one, other
        frame = both.perceive(0.0)
        assert both.perceive(0.0) is frame
        table = law.see(frame)
        # As if the frame had been made anew.
        whole = Surroundings().see(only(frame, range(len(frame.names))))
        np.testing.assert_allclose(table.shapes, whole.shapes, atol=1e-12)
        np.testing.assert_allclose(table.object_bounds, whole.object_bounds, atol=1e-12)
        assert frame.names[1 + SLOTS :] == ("target!", "box", "floor")
        assert known.frame.sphere_centers_m[0, 0] == frame.sphere_centers_m[0, 0] == (2.0 if step == 2 else 1.0)
    assert surfaces.solids[0, 1] == 2.0


def test_known_names_alone_are_felt_and_a_role_goes_to_the_source_of_its_object() -> None:
    surfaces, known = Source(seen()), Source(models())
    both = WithModels(surfaces, known, ("target",))
    frame = both.perceive(0.0)
    assert frame.names[1 + SLOTS :] == ("target!",)
    assert len(surfaces.solids) == 1
    both.set_role("target!", Role.TARGET)
    both.set_role("target", Role.OBSTACLE)
    assert known.roles == [("target", Role.TARGET)]
    assert surfaces.roles == [("target", Role.OBSTACLE)]


def test_an_error_of_a_model_is_its_own() -> None:
    frame = replace(models(), sds_m=np.array([0.001, np.nan, 0.002]), unseen_m=0.01)
    joined = WithModels(Source(seen()), Source(frame)).perceive(0.0)
    assert joined.sds_m is not None
    assert joined.sds_m[-3:] == pytest.approx([0.001, np.nan, 0.002], nan_ok=True)
    assert joined.sds_m[1] == 0.003
    assert joined.unseen_m == 0.01
