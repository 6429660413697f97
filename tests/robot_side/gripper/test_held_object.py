from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.roles import Role
from robot_side.arm.port import GripperPose
from robot_side.gripper import spheres
from robot_side.gripper.held_covers import HeldCovers
from robot_side.gripper.held_object import grip, gripped_object, with_held
from robot_side.overlap import Mesh
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import Scene, random_rotation

ORIGIN = np.zeros(3)
REACH_M = 0.05


class SerialArm:
    """Random serial arm of turning joints, with a tool of three spheres."""

    def __init__(self, seed: int, joints: int = 6) -> None:
        random = np.random.default_rng(seed)
        axes = random.normal(size=(joints, 3))
        self._axes = axes / np.linalg.norm(axes, axis=1)[:, None]
        self._points_m = random.uniform(-0.5, 0.5, (joints, 3))
        self._tool_m, self._tool_rotation = random.uniform(-0.5, 0.5, 3), random_rotation(random)
        self._spheres_in_tool_m = random.uniform(-0.1, 0.1, (3, 3))

    def pose(self, angles_rad: FloatArray) -> GripperPose:
        """Compute the pose as a product of the joints' rotations, and the Jacobian from the moved axes."""
        rotation, translation = np.eye(3), np.zeros(3)
        axes, points = [], []
        for axis, point, angle in zip(self._axes, self._points_m, angles_rad, strict=True):
            axes.append(rotation @ axis)
            points.append(rotation @ point + translation)
            turn = Rotation.from_rotvec(angle * axis).as_matrix()
            rotation, translation = rotation @ turn, rotation @ (point - turn @ point) + translation
        tool_m = rotation @ self._tool_m + translation
        tool_rotation = rotation @ self._tool_rotation
        spheres = tool_m + self._spheres_in_tool_m @ tool_rotation.T

        linear = np.stack([np.cross(axis, tool_m - point) for axis, point in zip(axes, points, strict=True)], axis=1)
        return GripperPose(
            tool_position_m=tool_m,
            tool_rotation=tool_rotation,
            tool_jacobian=np.concatenate([linear, np.stack(axes, axis=1)]),
            sphere_centers_m=spheres,
            sphere_radii_m=np.full(3, 0.02),
            sphere_on_finger=np.array([False, True, True]),
        )


def thing(center_m: FloatArray, seed: int = 0) -> PerceivedObjects:
    """Return two objects: a large ball, and then a target that consists of two boxes, a ball and a tetrahedron."""
    random = np.random.default_rng(seed)
    scene = Scene().add().sphere(center_m, 0.3).add(Role.TARGET)
    scene.box(center_m, random.uniform(0.005, 0.05, 3), random_rotation(random))
    scene.box(center_m + random.normal(size=3) * 0.05, random.uniform(0.005, 0.05, 3), random_rotation(random))
    scene.sphere(center_m + random.normal(size=3) * 0.05, 0.02)
    scene.tetrahedron(center_m + random.normal(size=(4, 3)) * 0.03)
    return scene.objects()


def surface_of(objects: PerceivedObjects, index: int, random: np.random.Generator) -> FloatArray:
    """Return points (n, 3) all over the surfaces of an object's primitives, including all corners."""
    corners = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0])).reshape(3, -1).T
    unit = random.uniform(-1.0, 1.0, (200, 3))
    unit[np.arange(200), random.integers(3, size=200)] = random.choice([-1.0, 1.0], 200)
    unit = np.vstack([corners, unit])
    points = []
    for row in np.flatnonzero(objects.box_object == index):
        points.append(
            objects.box_centers_m[row] + (unit * objects.box_half_sizes_m[row]) @ objects.box_rotations[row].T
        )
    for row in np.flatnonzero(objects.sphere_object == index):
        on_surface = unit / np.linalg.norm(unit, axis=1)[:, None]
        points.append(objects.sphere_centers_m[row] + on_surface * objects.sphere_radii_m[row])
    for row in np.flatnonzero(objects.tetrahedron_object == index):
        shares = random.dirichlet(np.ones(4), 200)
        shares[np.arange(200), random.integers(4, size=200)] = 0.0
        shares = np.vstack([np.eye(4), shares / shares.sum(axis=1, keepdims=True)])
        points.append(shares @ objects.tetrahedron_vertices_m[row])
    return np.concatenate(points)


def test_the_object_nearest_to_the_tool_point_is_the_gripped_one() -> None:
    scene = Scene().add().sphere([0.06, 0.0, 0.0], 0.03)
    scene.add(Role.TARGET).box([0.0, 0.03, 0.0], [0.02, 0.02, 0.02])
    objects = scene.add().sphere([0.0, 0.0, 0.5], 0.4).objects()
    assert gripped_object(scene_table(objects), ORIGIN, REACH_M) == 1
    assert gripped_object(scene_table(objects), np.array([0.03, 0.0, 0.0]), REACH_M) == 0


def test_supports_and_what_is_ignored_are_never_gripped() -> None:
    scene = Scene().add(Role.SUPPORT).box([0.0, 0.0, 0.0], [1.0, 1.0, 0.01])
    objects = scene.add(Role.IGNORED).add().sphere([0.0, 0.0, 0.06], 0.03).objects()
    assert gripped_object(scene_table(objects), ORIGIN, REACH_M) == 2
    assert gripped_object(scene_table(objects), ORIGIN, 0.01) is None


def test_what_has_no_end_is_never_gripped() -> None:
    """An infinite wall or floor, even if its role is not support, cannot move with the tool."""
    scene = Scene().add().half_space([0.0, 0.0, 1.0], -0.01)
    assert gripped_object(scene_table(scene.objects()), ORIGIN, REACH_M) is None
    objects = scene.add(Role.TARGET).sphere([0.0, 0.0, 0.04], 0.02).objects()
    assert gripped_object(scene_table(objects), ORIGIN, REACH_M) == 1


@settings(derandomize=True, deadline=None, max_examples=6)
@given(seed=st.integers(0, 10_000))
def test_the_spheres_cover_the_object_and_nothing_of_another(seed: int) -> None:
    random = np.random.default_rng(seed)
    objects = thing(random.uniform(-0.5, 0.5, 3), seed)
    pose = SerialArm(seed).pose(random.uniform(-2.0, 2.0, 6))
    held = grip(objects, 1, pose)
    assert (held.index, held.name) == (1, "object1")
    whole = with_held(pose, held)
    for name in ("sphere_centers_m", "sphere_radii_m", "sphere_jacobians", "sphere_on_finger"):
        np.testing.assert_array_equal(getattr(whole, name)[:3], getattr(pose, name))
    assert not whole.sphere_on_finger[3:].any()
    centers, radii = whole.sphere_centers_m[3:], whole.sphere_radii_m[3:]
    points = surface_of(objects, 1, random)
    apart = np.linalg.norm(points[:, None] - centers[None], axis=2)
    assert (apart <= radii * (1.0 + 1e-9)).any(axis=1).all()
    # No sphere is larger than the largest primitive's circumsphere, so the other object's is not among them.
    tetrahedron_m = objects.tetrahedron_vertices_m[0]
    largest_m = [
        np.linalg.norm(objects.box_half_sizes_m, axis=1).max(),
        objects.sphere_radii_m[1],
        np.linalg.norm(tetrahedron_m - tetrahedron_m.mean(axis=0), axis=1).max(),
    ]
    assert radii.max() <= max(largest_m) * (1.0 + 1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_its_jacobians_are_the_change_of_its_centres_with_the_joints(seed: int) -> None:
    random = np.random.default_rng(seed)
    arm, angles, step_rad = SerialArm(seed), random.uniform(-1.5, 1.5, 6), 1e-5
    gripped_at = arm.pose(random.uniform(-1.5, 1.5, 6))
    held = grip(thing(gripped_at.tool_position_m, seed), 1, gripped_at)
    found = with_held(arm.pose(angles), held).sphere_jacobians
    for joint in range(6):
        step = np.zeros(6)
        step[joint] = step_rad
        ahead, behind = (with_held(arm.pose(angles + sign * step), held).sphere_centers_m for sign in (1.0, -1.0))
        np.testing.assert_allclose(found[:, :, joint], (ahead - behind) / (2.0 * step_rad), atol=1e-8)


def test_what_is_made_of_tetrahedra_is_felt_as_early_as_the_same_box() -> None:
    half, rotation = np.array([0.02, 0.015, 0.03]), random_rotation(np.random.default_rng(4))
    objects = Scene().add().box_of_tetrahedra(np.array([0.1, 0.2, 0.3]), half, rotation).objects()
    held = grip(objects, 0, free_pose([ORIGIN], [0.01]))
    local = (held.centers_in_tool_m - [0.1, 0.2, 0.3]) @ rotation
    assert (held.radii_m[1:] - (half - np.abs(local)).min(axis=1)).max() <= 0.003 * (1.0 + 1e-6)


def test_a_cup_is_felt_at_its_wall_and_not_at_its_box() -> None:
    """The inside of a held cup stays free of spheres: they cover the surface of a mesh, convex or not."""
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ring = np.column_stack([np.cos(turns), np.sin(turns)])
    outline = [(0.0, 0.0), (0.03, 0.0), (0.03, 0.06), (0.025, 0.06), (0.025, 0.005), (0.0, 0.005)]
    vertices = np.array([[radius * x, radius * y, z] for radius, z in outline for x, y in ring])
    triangles = []
    for level in range(len(outline) - 1):
        for here in range(12):
            a, b = 12 * level + here, 12 * level + (here + 1) % 12
            triangles += [[a, b, b + 12], [a, b + 12, a + 12]]
    mesh = Mesh(vertices, np.array(triangles))
    rotation = random_rotation(np.random.default_rng(1))
    objects = Scene().add().mesh(mesh, [0.1, 0.0, 0.2], rotation).objects()
    covers = HeldCovers(objects)
    assert covers.coarse == ()
    moved = Scene().add().mesh(mesh, [0.3, 0.1, 0.0]).objects()
    moved = replace(moved, mesh_library=objects.mesh_library)
    held = grip(moved, 0, free_pose([ORIGIN], [0.01]), covers)
    local = held.centers_in_tool_m - [0.3, 0.1, 0.0]
    on_wall = mesh_points(vertices[np.array(triangles)], np.random.default_rng(0))
    apart = np.linalg.norm(on_wall[:, None] - local[None], axis=2) - held.radii_m[1:]
    assert apart.min(axis=1).max() <= 1e-9
    inside = np.column_stack([np.zeros((5, 2)), np.linspace(0.02, 0.06, 5)])
    assert (np.linalg.norm(inside[:, None] - local[None], axis=2) - held.radii_m[1:]).min() > 0.005


def mesh_points(corners_m: FloatArray, random: np.random.Generator) -> FloatArray:
    """Draw points (n, 3) on the triangles (t, 3, 3), 20 on each."""
    points: FloatArray = np.einsum(
        "tnk,tki->tni", random.dirichlet(np.ones(3), (len(corners_m), 20)), corners_m
    ).reshape(-1, 3)
    return points


def test_a_scene_unknown_before_is_held_without_a_search() -> None:
    """A tick has no time to search for few spheres: it uses a box's known cover, or a ball around each tetrahedron."""
    unknown = HeldCovers(Scene().add().sphere(ORIGIN, 0.01).objects())
    objects = thing(ORIGIN)
    held = grip(objects, 1, free_pose([ORIGIN], [0.01]), unknown)
    vertices = objects.tetrahedron_vertices_m[0]
    around_m = np.linalg.norm(vertices - vertices.mean(axis=0), axis=1).max()
    assert held.radii_m[-1] == pytest.approx(around_m)


def test_the_spheres_of_a_box_are_planned_before_it_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    objects = Scene().add().box(ORIGIN, [0.011, 0.022, 0.033]).objects()
    covers = HeldCovers(objects)
    monkeypatch.setattr(spheres, "_fewest", None)
    assert len(grip(objects, 0, free_pose([ORIGIN], [0.01]), covers).radii_m) > 9
