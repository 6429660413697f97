"""Surfaces that depth cameras see, as viewers get them."""

from dataclasses import replace

import numpy as np
import pytest

from common.protocol.codec import decode_view, encode
from common.protocol.view_messages import SceneShapes, SceneState
from common.roles import ROLES, Role
from robot_side.arm.bounds import KeepOut
from robot_side.core.robot_side import RobotSide
from robot_side.depth.boxes import Boxes
from robot_side.depth.slots import Slots
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.surroundings.fixed_objects import joined
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.viewing.scene_view import SURFACES_BYTES_PER_S, SceneView
from robot_side.viewing.surfaces import SurfaceModel, seen_surfaces
from tests.helpers.perceived_scenes import Scene
from tests.robot_side.viewing.test_shapes import finished, shapes_of

SLOTS = 64
TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
ROLES_GIVEN = np.array([-1, ROLES.index(Role.TARGET), ROLES.index(Role.SUPPORT)])
ROW_BYTES = 41


def seen(count: int = 3, first_m: tuple[float, float, float] = (0.0, 0.2, 0.3)) -> PerceivedObjects:
    """Return a frame of surfaces in a row along x, 0.1 m apart."""
    mapped, shown = Slots(SLOTS), Slots(SLOTS)
    centers_m = np.array(first_m) + 0.1 * np.arange(count)[:, None] * (1.0, 0.0, 0.0)
    boxes = Boxes(
        ids=np.arange(count),
        centers_m=centers_m,
        rotations=np.tile(TURNED, (count, 1, 1)),
        half_sizes_m=np.tile([0.04, 0.03, 0.002], (count, 1)),
        roles=np.resize(ROLES_GIVEN, count),
        sds_m=np.full(count, 0.001),
    )
    shown.apply(mapped.update(boxes, np.zeros(3)))
    return shown.frame(0.0, np.full(len(shown.sds_m), 0.003))


def rows_of(state: SceneState) -> "np.ndarray[tuple[int, int], np.dtype[np.float32]]":
    assert state.surfaces is not None
    return np.frombuffer(state.surfaces, "<f4").reshape(-1, 10)


class Viewer:
    """Robot side whose view shows surfaces before a box to keep out of."""

    def __init__(self) -> None:
        keep_out = KeepOut((0.5, 0.5, 0.5), (0.1, 0.1, 0.1))
        self.parts = build_parts(RobotSettings(arm_keep_out=(keep_out,)), 1, "clock")
        self.robot = RobotSide(self.parts)
        self.robot.tick(0.0)
        model = SurfaceModel(self.parts.scene, self.parts.fixed, 1 + SLOTS)
        parts = self.parts
        self.view = SceneView(model, parts.kinematics, parts.explains, parts.enlarged, parts.surroundings)
        self.show(seen())

    def show(self, frame: PerceivedObjects) -> None:
        assert self.robot.newest is not None
        sensed, situation = self.robot.newest
        self.robot.newest = sensed, replace(situation, objects=joined(frame, self.parts.fixed))

    def state(self, taken_s: float = 0.0, surfaces_bytes_per_s: float = SURFACES_BYTES_PER_S) -> SceneState:
        assert self.robot.newest is not None
        sensed, situation = self.robot.newest
        self.view.begin_state(sensed, situation, taken_s, surfaces_bytes_per_s)
        message = decode_view(encode(finished(self.view)))
        assert isinstance(message, SceneState)
        return message

    def shapes(self) -> SceneShapes:
        return shapes_of(self.robot, self.view)


@pytest.fixture(scope="module")
def viewer() -> Viewer:
    return Viewer()


def test_used_surfaces_are_shown_with_their_roles_and_no_parked_one() -> None:
    surfaces, roles = seen_surfaces(seen(), 1 + SLOTS)
    rows = np.frombuffer(surfaces, "<f4").reshape(-1, 10)
    assert rows[:, :3] == pytest.approx(np.array([[0.1, 0.2, 0.3], [0.0, 0.2, 0.3], [0.2, 0.2, 0.3]]))
    assert rows[:, 3:7] == pytest.approx(np.tile([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], (3, 1)))
    assert rows[:, 7:] == pytest.approx(np.tile([0.04, 0.03, 0.002], (3, 1)))
    assert [ROLES[role] for role in roles] == [Role.TARGET, Role.OBSTACLE, Role.SUPPORT]
    assert seen_surfaces(seen(0), 1 + SLOTS) == (b"", b"")


def test_shapes_have_what_is_fixed_and_stay_when_surfaces_come_and_go(viewer: Viewer) -> None:
    viewer.show(seen())
    shapes = viewer.shapes()
    assert shapes.objects == ("keep out 1",)
    assert [shape.owner for shape in shapes.shapes if not shape.of_robot] == [0]
    assert np.frombuffer(shapes.object_poses, "<f4")[:3] == pytest.approx([0.5, 0.5, 0.5])
    viewer.show(seen(40))
    assert viewer.robot.newest is not None
    assert not viewer.view.outdated(viewer.robot.newest[1].objects)


def test_states_have_surfaces_once_a_second(viewer: Viewer) -> None:
    viewer.show(seen())
    states = [viewer.state(100.0 + 0.1 * tick) for tick in range(25)]
    assert [tick for tick, state in enumerate(states) if state.surfaces is not None] == [0, 10, 20]
    assert len(rows_of(states[0])) == 3
    assert all(state.roles == bytes([ROLES.index(Role.OBSTACLE)]) for state in states)
    assert np.frombuffer(states[1].object_poses, "<f4")[:3] == pytest.approx([0.5, 0.5, 0.5])


def test_over_a_slow_link_they_come_less_often(viewer: Viewer) -> None:
    viewer.show(seen(SLOTS))
    every_s = 4.0
    slow = ROW_BYTES * SLOTS / every_s
    states = [viewer.state(200.0 + tick, slow) for tick in range(9)]
    assert [tick for tick, state in enumerate(states) if state.surfaces is not None] == [0, 4, 8]


def test_the_volumes_shared_with_surfaces_are_one_row_behind_the_objects(viewer: Viewer) -> None:
    viewer.show(seen())
    assert viewer.state(220.0).overlaps == ()
    assert viewer.robot.newest is not None
    x, y, z = viewer.robot.newest[1].pose.tool_position_m.tolist()
    viewer.show(seen(3, (x - 0.1, y, z)))
    ((index, _, r2_m3),) = viewer.state(221.0).overlaps
    assert index == len(viewer.shapes().objects) == 1
    assert r2_m3 > 1e-6


def test_models_behind_the_surfaces_have_shapes(viewer: Viewer) -> None:
    scene = Scene()
    scene.add().sphere([0.6, 0.0, 0.3], 0.05)
    ball = replace(scene.objects(), positions_m=np.array([[0.6, 0.0, 0.3]]), rotations=np.eye(3)[None])
    viewer.show(seen())
    assert viewer.robot.newest is not None
    sensed, situation = viewer.robot.newest
    viewer.robot.newest = sensed, replace(situation, objects=joined(situation.objects, ball))
    assert viewer.view.outdated(viewer.robot.newest[1].objects)
    shapes = viewer.shapes()
    assert shapes.objects == ("keep out 1", ball.names[0])
    assert {(shape.owner, shape.kind) for shape in shapes.shapes if not shape.of_robot} == {(0, "box"), (1, "sphere")}
    viewer.show(seen())
    assert viewer.view.outdated(viewer.robot.newest[1].objects)
    assert viewer.shapes().objects == ("keep out 1",)


def test_that_none_is_left_is_told_too(viewer: Viewer) -> None:
    viewer.show(seen(0))
    assert rows_of(viewer.state(300.0)).shape == (0, 10)
