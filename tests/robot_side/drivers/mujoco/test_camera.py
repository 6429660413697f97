import numpy as np
import pytest

from common.roles import Role
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.camera import CameraError, MujocoCamera
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.surroundings.perceived import KINDS
from tests.helpers.repository import DATA


def test_exact_shapes_are_exact(shapes: Scene) -> None:
    seen = MujocoCamera(shapes).perceive(0.0)
    model, data = shapes.model, shapes.data
    table = int(np.flatnonzero(seen.box_object == seen.names.index("table_slab"))[0])
    geom = model.geom("table_slab").id
    np.testing.assert_allclose(seen.box_centers_m[table], [0.8, -0.4, 0.1], atol=1e-12)
    np.testing.assert_allclose(seen.box_rotations[table], data.geom_xmat[geom].reshape(3, 3))
    np.testing.assert_allclose(seen.box_half_sizes_m[table], [0.1, 0.2, 0.1])

    lamp = int(np.flatnonzero(seen.sphere_object == seen.names.index("post"))[0])
    np.testing.assert_allclose(seen.sphere_centers_m[lamp], data.geom("lamp").xpos)
    assert seen.sphere_radii_m[lamp] == pytest.approx(0.04)

    # The vertices as written, moved to the world by the body's own frame.
    written = np.array([[0, 0, 0.1], [0.07, 0, 0], [-0.035, 0.06, 0], [-0.035, -0.06, 0.01]])
    body = data.body("stone")
    expected = body.xpos + written @ body.xmat.reshape(3, 3).T
    found = seen.tetrahedron_vertices_m[0]
    # MuJoCo stores a mesh in single precision.
    for vertex in expected:
        assert np.linalg.norm(found - vertex, axis=1).min() < 1e-7

    # Solid is the side away from the plane's z axis.
    away = np.array([-1.0, 0.0, 0.2]) / np.linalg.norm([-1.0, 0.0, 0.2])
    np.testing.assert_allclose(seen.half_space_normals, [away], atol=1e-12)
    np.testing.assert_allclose(seen.half_space_offsets_m, [away @ np.array([1.5, 0.0, 0.0])], atol=1e-12)


def test_the_camera_errs_by_the_same_vector_for_every_primitive_of_an_object(shapes: Scene) -> None:
    names = tuple(thing.name for thing in shapes.objects)
    error = CameraError(names, mean_m=0.01, standard_deviation_m=0.005, seed=3)
    true, seen = MujocoCamera(shapes).perceive(0.0), MujocoCamera(shapes, error).perceive(0.0)
    offsets = error.next_frame()
    np.testing.assert_allclose(seen.sphere_centers_m - true.sphere_centers_m, offsets[seen.sphere_object], atol=1e-12)
    np.testing.assert_allclose(seen.box_centers_m - true.box_centers_m, offsets[seen.box_object], atol=1e-12)
    moved = seen.tetrahedron_vertices_m - true.tetrahedron_vertices_m
    np.testing.assert_allclose(moved[0], np.tile(offsets[seen.tetrahedron_object[0]], (4, 1)), atol=1e-12)
    shift = seen.half_space_offsets_m - true.half_space_offsets_m
    np.testing.assert_allclose(shift, [seen.half_space_normals[0] @ offsets[seen.half_space_object[0]]], atol=1e-12)
    np.testing.assert_array_equal(seen.box_rotations, true.box_rotations)


def test_a_frame_lasts_until_the_next_is_due(built_in: Scene) -> None:
    names = tuple(thing.name for thing in built_in.objects)
    camera = MujocoCamera(built_in, CameraError(names, frame_standard_deviation_m=0.001))
    frames = {id(frame): frame for frame in [camera.perceive(5.0 + tick * 1e-3) for tick in range(1000)]}
    assert len(frames) == 30
    first, second, *_ = frames.values()
    assert first.time_s == 5.0
    assert second.time_s == pytest.approx(5.0 + 1.0 / 30.0, abs=1e-3)
    # A newly drawn error moves fixed objects as well.
    assert second.since is not None
    assert second.since[0].things.tolist() == list(range(len(names)))
    assert (first.box_centers_m != second.box_centers_m).all()
    # After a pause there is one new frame, not all the missed ones.
    late = camera.perceive(9.0)
    assert camera.perceive(9.001) is late


@pytest.mark.parametrize(("name", "speed_m_s"), [("moving", -0.06), ("fleeing", 0.03), ("wall", 0.0)])
def test_how_fast_a_thing_moves_is_seen_after_a_while(name: str, speed_m_s: float) -> None:
    scene = load_scene(DATA / f"{name}.xml", "tool")
    # A lasting error of the position causes no velocity.
    arm, camera = MujocoArm(scene, Encoder()), MujocoCamera(scene, CameraError(tuple(scene.roles), 0.01, 0.003, seed=1))
    arm.state(0.0)
    np.testing.assert_array_equal(camera.perceive(0.0).velocities_m_s, np.zeros((1, 3)))
    for tick in range(1, 21):
        arm.state(0.01 * tick)
        found = camera.perceive(0.01 * tick).velocities_m_s
    assert found is not None
    np.testing.assert_allclose(found, [[speed_m_s, 0.0, 0.0]], atol=0.002)


def test_a_role_changes_from_the_next_frame_on(built_in: Scene) -> None:
    camera = MujocoCamera(built_in)
    before = camera.perceive(0.0)
    camera.set_role("ball", Role.IGNORED)
    assert camera.perceive(0.01) is before
    after = camera.perceive(0.05)
    assert after.roles[after.names.index("ball")] is Role.IGNORED
    assert len(after.sphere_radii_m) == len(before.sphere_radii_m) - 1
    with pytest.raises(ValueError, match=r"'vase' is no object; valid: floor, table"):
        camera.set_role("vase", Role.TARGET)


def test_a_frame_says_what_moves_and_is_what_a_camera_that_says_all_sees(built_in: Scene) -> None:
    names = tuple(thing.name for thing in built_in.objects)
    error = CameraError(names, mean_m=0.01, standard_deviation_m=0.005, seed=3)
    arm, camera = MujocoArm(built_in, Encoder()), MujocoCamera(built_in, error)
    first = camera.perceive(0.0)
    assert first.since is None
    # Something falls meanwhile.
    built_in.data.joint(int(built_in.model.body("table_scene/ball").jntadr[0])).qpos[2] += 0.05
    for tick in range(1, 200):
        arm.state(0.001 * tick)
    second = camera.perceive(0.2)
    assert second.since is not None
    movers, _ = second.since
    assert movers.first is first
    assert {names[thing] for thing in movers.things} == set(names) - built_in.fixed
    data = built_in.data
    expected = built_in.primitives.perceived(0.2, built_in.roles, error.next_frame(), data.geom_xpos, data.geom_xmat)
    for kind in KINDS:
        for name in kind.fields:
            np.testing.assert_array_equal(getattr(second, name), getattr(expected, name), err_msg=name)
    ball = np.flatnonzero(second.sphere_object == second.names.index("ball"))
    assert (second.sphere_centers_m[ball] != first.sphere_centers_m[ball]).any()
    assert second.velocities_m_s is not None
    assert (second.velocities_m_s[[name in built_in.fixed for name in names]] == 0.0).all()


def test_roles_change_without_a_new_first_frame_unless_primitives_go(built_in: Scene) -> None:
    camera = MujocoCamera(built_in)
    first = camera.perceive(0.0)
    camera.set_role("ball", Role.TARGET)
    second = camera.perceive(0.05)
    assert second.since is not None
    assert second.since[0].first is first
    assert second.roles[second.names.index("ball")] is Role.TARGET
    for role in (Role.IGNORED, Role.OBSTACLE):
        camera.set_role("ball", role)
        number = 2.0 if role is Role.IGNORED else 3.0
        assert camera.perceive(number).since is None
        later = camera.perceive(number + 0.05)
        assert later.roles[later.names.index("ball")] is role
