from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.protocol.codec import VIEW_MAXIMUM_BYTES, decode_view
from common.protocol.messages import Header
from common.protocol.view_messages import SceneShapes, SceneState, Shape
from common.roles import Role
from robot_side.arm.bounds import KeepOut, Workspace
from robot_side.core.robot_side import RobotSide
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.surroundings.fixed_objects import SIDES
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation
from robot_side.viewing import scene_view
from robot_side.viewing.scene_view import SceneView, TickFigures
from robot_side.viewing.shapes import SceneModel
from tests.helpers.arm_models import SHAPES, STONE, planar_arm

HEADER = Header(epoch=1, sequence=1, sent_s=0.0)


def looked_at(settings: RobotSettings, scene: Scene | None = None) -> tuple[RobotSide, SceneView]:
    parts = build_parts(settings, 1, "clock", scene=scene)
    robot = RobotSide(parts)
    robot.tick(0.0)
    return robot, SceneView(
        SceneModel(parts.scene, parts.fixed), parts.kinematics, parts.explains, parts.enlarged, parts.surroundings
    )


def shapes_of(robot: RobotSide, view: SceneView) -> SceneShapes:
    assert robot.newest is not None
    view.begin_shapes(HEADER, robot.newest[1])
    while not view.work_on_shapes():
        pass
    assert view.shapes is not None
    payload = view.shapes.under(HEADER)
    assert len(payload) == view.shapes_bytes <= VIEW_MAXIMUM_BYTES
    message = decode_view(payload)
    assert isinstance(message, SceneShapes)
    return message


def state_of(view: SceneView, sensed: Sensed, situation: Situation) -> SceneState:
    view.begin_state(sensed, situation, 0.0)
    return finished(view)


def finished(view: SceneView) -> SceneState:
    while (state := view.work_on_state(lambda: HEADER, TickFigures())) is None:
        pass
    return state


def placed(shape: Shape, owner_pose: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a shape's position (3,) and rotation (3, 3) in the world."""
    turned = Rotation.from_quat(owner_pose[3:], scalar_first=True)
    rotation = turned * Rotation.from_quat(shape.pose[3:], scalar_first=True)
    position_m: FloatArray = owner_pose[:3] + turned.apply(shape.pose[:3])
    return position_m, rotation.as_matrix()


def test_every_kind_of_geom_is_where_the_model_has_it(tmp_path: Path) -> None:
    path = planar_arm(tmp_path, world=SHAPES, extra_top=STONE)
    scene = load_scene(path, "tcp")
    robot, view = looked_at(RobotSettings(model=path, site="tcp"), scene)
    said = shapes_of(robot, view)
    model, data = scene.model, scene.data
    poses = np.frombuffer(said.object_poses, "<f4").reshape(-1, 7).astype(np.float64)
    geoms = [(index, geom) for index, thing in enumerate(scene.objects) for geom in thing.geoms]
    mine = [shape for shape in said.shapes if not shape.of_robot]
    assert len(mine) == len(geoms)
    assert {shape.kind for shape in mine} == {"cylinder", "capsule", "sphere", "ellipsoid", "plane", "box", "mesh"}
    left = list(geoms)
    for shape in mine:
        position_m, rotation = placed(shape, poses[shape.owner])
        [fits] = [
            (index, geom)
            for index, geom in left
            if index == shape.owner
            # The view has the camera's error, the same for all parts of an object.
            and np.linalg.norm(position_m - data.geom_xpos[geom] - _offset(scene, poses, index)) < 1e-5
            and np.abs(rotation - data.geom_xmat[geom].reshape(3, 3)).max() < 1e-5
        ]
        left.remove(fits)
        if shape.kind == "mesh":
            vertices_m = np.frombuffer(shape.vertices_m, "<f4").reshape(-1, 3)
            assert vertices_m.shape == (4, 3)
            assert np.frombuffer(shape.triangles, "<u4").max() == 3
        else:
            used = [size for size in shape.size_m if size > 0.0]
            assert used == pytest.approx(model.geom_size[fits[1]][: len(used)])
    assert left == []


def _offset(scene: Scene, poses: FloatArray, index: int) -> FloatArray:
    offset: FloatArray = poses[index, :3] - scene.data.geom_xpos[scene.objects[index].geoms[0]]
    return offset


def test_what_is_near_the_gripper_is_said_as_perceived() -> None:
    robot, view = looked_at(RobotSettings())
    sensed, situation = robot.newest or pytest.fail("no tick")
    near, status = state_of(view, sensed, situation).near, robot.status(0.0)
    assert near is not None
    assert (near.nearest, near.held) == (status.nearest, None)
    assert status.nearest_mm is not None
    assert status.target_mm is not None
    assert (near.nearest_m, near.target_m) == pytest.approx((1e-3 * status.nearest_mm, 1e-3 * status.target_mm))
    target = situation.objects.roles.index(Role.TARGET)
    held = state_of(view, sensed, replace(situation, held=target)).near
    assert held is not None
    assert (held.held, held.target_m) == (situation.objects.names[target], None)


def test_links_are_the_robots_bodies_and_their_shapes_go_with_them() -> None:
    scene = load_scene()
    robot, view = looked_at(RobotSettings(), scene)
    said = shapes_of(robot, view)
    assert said.links[-3:] == ("gripper", "left_finger", "right_finger")
    sensed, situation = robot.newest or pytest.fail("no tick")
    state = state_of(view, sensed, situation)
    links = np.frombuffer(state.link_poses, "<f4").reshape(-1, 7).astype(np.float64)
    for shape in said.shapes:
        if shape.of_robot:
            position_m, _ = placed(shape, links[shape.owner])
            body = scene.model.body(said.links[shape.owner]).id
            near = [geom for geom in range(scene.model.ngeom) if scene.model.geom_bodyid[geom] == body]
            # Apart from the encoders' error.
            assert min(np.linalg.norm(scene.data.geom_xpos[near] - position_m, axis=1)) < 2e-3
    assert sum(shape.of_robot for shape in said.shapes) > 10


def test_what_there_is_no_room_for_is_counted_and_the_nearest_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, view = looked_at(RobotSettings())
    whole = shapes_of(robot, view)
    assert view.complete
    monkeypatch.setattr(scene_view, "_MOST_SHAPES_BYTES", 3500)
    robot, view = looked_at(RobotSettings())
    said = shapes_of(robot, view)
    assert said.objects == whole.objects
    assert 0 < said.left_out < len(said.objects)
    assert not view.complete
    kept = {shape.owner for shape in said.shapes if not shape.of_robot}
    assert len(kept) == len(said.objects) - said.left_out
    poses = np.frombuffer(said.object_poses, "<f4").reshape(-1, 7)
    assert robot.newest is not None
    tool_m = robot.newest[1].pose.tool_position_m
    distances = np.linalg.norm(poses[:, :3] - tool_m, axis=1)
    # A mesh takes more room than the objects after it.
    left_out = set(range(len(distances))) - kept - {said.objects.index("tetrahedron")}
    assert max(distances[list(kept)]) <= min(distances[list(left_out)])


def test_a_robots_mesh_without_room_becomes_a_box_around_it() -> None:
    generator = np.random.default_rng(1)
    vertices_m = generator.uniform(-1.0, 1.0, (50, 3)) * [0.1, 0.2, 0.3] + [0.5, 0.0, 0.0]
    turned = Rotation.random(random_state=2)
    w, x, y, z = turned.as_quat(scalar_first=True).tolist()
    pose = (0.1, 0.2, 0.3, w, x, y, z)
    shape = Shape(
        0, True, "mesh", (1.0, 1.0, 1.0), pose, vertices_m=vertices_m.astype("<f4").tobytes(), triangles=bytes(12)
    )
    box = scene_view._boxed(shape)
    assert box.kind == "box"
    position_m, rotation = placed(box, np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    inside = ((turned.apply(vertices_m) + np.array([0.1, 0.2, 0.3])) - position_m) @ rotation
    assert (np.abs(inside) <= np.array(box.size_m) + 1e-6).all()
    np.testing.assert_allclose(np.abs(inside).max(axis=0), box.size_m, atol=1e-6)


def test_what_is_moved_without_a_joint_is_said_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(scene_view, "_FEW", 3)
    path = planar_arm(tmp_path, world=SHAPES, extra_top=STONE)
    robot, view = looked_at(RobotSettings(model=path, site="tcp"))
    said = shapes_of(robot, view)
    sensed, situation = robot.newest or pytest.fail("no tick")
    positions_m = situation.objects.positions_m
    assert positions_m is not None
    wall = said.objects.index("wall")
    shifted_m = positions_m + 0.01 * (np.arange(len(positions_m)) == wall)[:, None]
    elsewhere = replace(situation, objects=replace(situation.objects, positions_m=shifted_m))
    state = state_of(view, sensed, elsewhere)
    index = np.frombuffer(state.object_index, "<u4").tolist()
    assert {said.objects[one] for one in index} == {"post", "Target_egg", "wall"}
    poses = np.frombuffer(state.object_poses, "<f4").reshape(-1, 7)
    assert poses[index.index(wall), :3] == pytest.approx(shifted_m[wall], abs=1e-6)


def test_boxes_to_keep_out_of_are_drawn_behind_the_scenes_own_objects_and_sides_are_not() -> None:
    sides = Workspace((-2.0, -2.0, 0.0), (2.0, 2.0, 2.0))
    settings = RobotSettings(arm_workspace=sides, arm_keep_out=(KeepOut((0.5, 0.6, 0.2), (0.1, 0.05, 0.2)),))
    robot, view = looked_at(settings)
    shapes = shapes_of(robot, view)
    index = shapes.objects.index("keep out 1")
    [drawn] = [shape for shape in shapes.shapes if not shape.of_robot and shape.owner == index]
    assert (drawn.kind, drawn.size_m) == ("box", (0.1, 0.05, 0.2))
    beyond = {shapes.objects.index(name) for name in SIDES}
    assert not [shape for shape in shapes.shapes if not shape.of_robot and shape.owner in beyond]
    assert robot.newest is not None
    state_of(view, *robot.newest)
