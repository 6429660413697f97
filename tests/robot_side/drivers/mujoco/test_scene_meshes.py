"""Curved and non-convex objects, as the robot side perceives them: never smaller than in the model, hardly larger."""

import math
from collections.abc import Callable
from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray, IntArray
from robot_side.drivers.mujoco.camera import MujocoCamera
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.field.object_class import OBSTACLE, SKIPPED
from robot_side.field.total_overlap import total_overlap_m3
from robot_side.overlap import sphere_sphere
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import scene_table
from tests.helpers.arm_models import planar_arm
from tests.helpers.field.nearest_point import distance_to_object
from tests.helpers.meshes import CELL_M, cup

TURNED = 'pos="0.9 0.3 0.2" euler="20 30 40"'
ROUND = {
    "cylinder": f'<body name="round" {TURNED}><geom type="cylinder" size="0.05 0.1"/></body>',
    "capsule": f'<body name="round" {TURNED}><geom type="capsule" size="0.03 0.05"/></body>',
    "ball": f'<body name="round" {TURNED}><geom type="ellipsoid" size="0.04 0.04 0.04"/></body>',
    "ellipsoid": f'<body name="round" {TURNED}><geom type="ellipsoid" size="0.03 0.04 0.06"/></body>',
}
VOLUMES_M3 = {
    "cylinder": math.pi * 0.05**2 * 0.2,
    "capsule": math.pi * 0.03**2 * (0.1 + 4.0 / 3.0 * 0.03),
    "ball": 4.0 / 3.0 * math.pi * 0.04**3,
    "ellipsoid": 4.0 / 3.0 * math.pi * 0.03 * 0.04 * 0.06,
}


def mesh_asset(name: str, vertices: FloatArray, triangles: IntArray, inertia: str = "convex") -> str:
    numbers = " ".join(f"{value:.17g}" for value in vertices.ravel())
    indices = " ".join(str(index) for index in triangles.ravel())
    return f'<asset><mesh name="{name}" inertia="{inertia}" vertex="{numbers}" face="{indices}"/></asset>'


def scene_with(path: Path, world: str, assets: str = "") -> Scene:
    return load_scene(planar_arm(path, world=world, extra_top=assets), "tcp")


def placed(scene: Scene, in_body_m: FloatArray, body: str = "round") -> FloatArray:
    frame = scene.data.body(body)
    in_world: FloatArray = frame.xpos + in_body_m @ frame.xmat.reshape(3, 3).T
    return in_world


def overlap_of(objects: PerceivedObjects, name: str, centers_m: FloatArray, radius_m: float) -> FloatArray:
    """Return the overlaps (n,) in m³ of single spheres with one object, computed by the code that a tick runs."""
    scene = scene_table(objects)
    classes = np.full(len(objects.names), SKIPPED, dtype=np.int64)
    classes[objects.names.index(name)] = OBSTACLE
    spheres = np.insert(centers_m, 3, radius_m, axis=1)
    return np.array([total_overlap_m3(sphere[None], scene, classes) for sphere in spheres])


def cap(radius_m: float, depth_m: float) -> float:
    return math.pi * depth_m**2 * (3.0 * radius_m - depth_m) / 3.0


def axis_points(*heights_m: float) -> FloatArray:
    return np.array([[0.0, 0.0, height] for height in heights_m])


# Round shapes


@pytest.mark.parametrize(
    ("shape", "heights_m", "radius_m", "closed_form"),
    [
        # Through the flat end, and within.
        ("cylinder", [0.12, 0.105, 0.09, 0.0], 0.03, lambda z: cap(0.03, min(0.13 - z, 0.06) if z < 0.1 else 0.13 - z)),
        # The end of a capsule equals a ball if the other ball reaches no farther than its middle.
        ("capsule", [0.1, 0.085, 0.08], 0.03, lambda z: float(sphere_sphere([0, 0, z], 0.03, [0, 0, 0.05], 0.03))),
        ("ball", [0.08, 0.06, 0.03, 0.0], 0.05, lambda z: float(sphere_sphere([0, 0, z], 0.05, [0, 0, 0], 0.04))),
    ],
)
def test_overlaps_are_the_closed_forms_within_the_stated_error(
    shape: str, heights_m: list[float], radius_m: float, closed_form: Callable[[float], float], tmp_path: Path
) -> None:
    scene = scene_with(tmp_path, ROUND[shape])
    allowance = scene.primitives.volume_errors.get("round", 1e-9) * VOLUMES_M3[shape]
    found = overlap_of(MujocoCamera(scene).perceive(0.0), "round", placed(scene, axis_points(*heights_m)), radius_m)
    for height, volume in zip(heights_m, found, strict=True):
        exact = closed_form(height)
        # The mesh adds at most the allowance to the shape, for every place of the sphere.
        assert exact * (1.0 - 1e-9) <= volume <= exact + allowance * (1.0 + 1e-12)


def test_things_of_the_same_shape_share_one_mesh(tmp_path: Path) -> None:
    vertices, triangles = cup()
    world = "".join(
        f'<body name="{kind}{number}" pos="{0.8 + 0.3 * number} {side} 0.3" euler="0 {20 * number} 0">{geom}</body>'
        for number in range(3)
        for side, (kind, geom) in enumerate(
            [
                ("post", '<geom type="cylinder" size="0.02 0.1"/>'),
                ("rod", '<geom type="capsule" size="0.02 0.1"/>'),
                ("cup", '<geom type="mesh" mesh="cup"/>'),
            ]
        )
    )
    scene = scene_with(tmp_path, world, mesh_asset("cup", vertices, triangles))
    objects = MujocoCamera(scene).perceive(0.0)
    assert objects.mesh_library is not None
    assert len(objects.mesh_library) == 3
    for kind in ("post", "rod", "cup"):
        rows = np.isin(objects.mesh_object, [objects.names.index(f"{kind}{number}") for number in range(3)])
        assert rows.sum() == 3
        assert len(set(objects.mesh_index[rows].tolist())) == 1


# Meshes of any form


def test_a_cup_is_seen_with_its_mouth(tmp_path: Path) -> None:
    scene = scene_with(
        tmp_path, f'<body name="cup" {TURNED}><geom type="mesh" mesh="cup"/></body>', mesh_asset("cup", *cup())
    )
    assert scene.primitives.volume_errors == {}
    objects = MujocoCamera(scene).perceive(0.0)
    # In the mouth, halfway into a wall, across the rim, in the wall and under the floor of the mouth.
    centers = CELL_M * np.array([[0, 0, 0.1], [0.5, 0, 0.5], [1.0, 0, 1.5], [1.0, 0, 0], [0, 0, -0.7], [0, 0, -0.5]])
    radius = 0.4 * CELL_M
    sphere = 4.0 / 3.0 * math.pi * radius**3
    found = overlap_of(objects, "cup", placed(scene, centers, "cup"), radius)
    expected = [0.0, sphere / 2.0, sphere / 2.0, sphere, sphere - cap(radius, 0.2 * CELL_M), sphere / 2.0]
    # MuJoCo keeps vertices in single precision.
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * sphere)
    in_mouth = placed(scene, centers[:1], "cup")[0]
    assert distance_to_object(objects, objects.names.index("cup"), in_mouth) == pytest.approx(0.5 * CELL_M, rel=1e-6)


@pytest.mark.parametrize("change", ["open", "one triangle turned", "each triangle twice", "inward"])
def test_a_mesh_without_an_inside_stands_for_its_convex_hull(change: str, tmp_path: Path) -> None:
    vertices, triangles = cup()
    if change == "open":
        triangles = triangles[1:]
    elif change == "one triangle turned":
        triangles = np.concatenate([triangles[:1, ::-1], triangles[1:]])
    elif change == "each triangle twice":
        triangles = np.concatenate([triangles, triangles])
    else:
        triangles = triangles[:, ::-1]
    scene = scene_with(
        tmp_path,
        f'<body name="cup" {TURNED}><geom type="mesh" mesh="cup"/></body>',
        mesh_asset("cup", vertices, triangles),
    )
    objects = MujocoCamera(scene).perceive(0.0)
    mouth = overlap_of(objects, "cup", placed(scene, np.zeros((1, 3)), "cup"), 0.01)[0]
    if change == "inward":
        # Turned round as a whole it is closed, and describes the same solid.
        assert scene.primitives.volume_errors == {}
        assert mouth == 0.0
    else:
        assert scene.primitives.volume_errors == {"cup": math.inf}
        assert mouth == pytest.approx(4.0 / 3.0 * math.pi * 0.01**3)
        around = overlap_of(objects, "cup", placed(scene, np.zeros((1, 3)), "cup"), 0.2)[0]
        assert around == pytest.approx((3.0 * CELL_M) ** 3, rel=1e-6)


@pytest.mark.parametrize("shape", ["cylinder", "capsule"])
@pytest.mark.parametrize("size_m", [0.003, 0.1])
def test_a_thing_of_ordinary_size_stands_out_by_half_a_millimetre_at_most(
    shape: str, size_m: float, tmp_path: Path
) -> None:
    scene = scene_with(tmp_path, f'<geom name="round" type="{shape}" size="{size_m} 0.1 {size_m}" pos="1 0 0"/>')
    assert 0.0 < scene.primitives.stands_out_m["round"] <= 5e-4
    assert scene.primitives.volume_errors["round"] <= 0.01


def test_an_ellipsoid_is_itself(tmp_path: Path) -> None:
    scene = scene_with(tmp_path, '<geom name="round" type="ellipsoid" size="3 2 1" pos="9 0 0"/>')
    assert scene.primitives.volume_errors == scene.primitives.stands_out_m == {}
    objects = MujocoCamera(scene).perceive(0.0)
    unit = np.random.default_rng(1).normal(size=(200, 3))
    surface = [9.0, 0.0, 0.0] + [3.0, 2.0, 1.0] * unit / np.linalg.norm(unit, axis=1)[:, None]
    assert max(abs(distance_to_object(objects, 0, point)) for point in surface) < 1e-12


# Terrain


def hills(path: Path, placed: str, rows: int = 5, columns: int = 7, seed: int = 0) -> Scene:
    elevation = " ".join(f"{height:.17g}" for height in np.random.default_rng(seed).uniform(size=rows * columns))
    size = 'size="0.3 0.2 0.15 0.05"'
    field = f'<hfield name="hills" nrow="{rows}" ncol="{columns}" {size} elevation="{elevation}"/>'
    return scene_with(path, f'<geom name="hills" type="hfield" hfield="hills" {placed}/>', f"<asset>{field}</asset>")


@pytest.mark.parametrize("shape", [(5, 7), (2, 2), (30, 20)])
def test_a_height_field_is_the_solid_that_rays_hit(shape: tuple[int, int], tmp_path: Path) -> None:
    scene = hills(tmp_path, 'pos="1 0.2 0.3" euler="20 30 40"', *shape)
    assert scene.primitives.volume_errors == {}
    objects = MujocoCamera(scene).perceive(0.0)
    assert len(objects.mesh_object) == 1
    geom, random = scene.data.geom("hills"), np.random.default_rng(1)
    rotation, hit = geom.xmat.reshape(3, 3), 0
    for _ in range(200):
        # From all round towards a point in the solid, through its top, its sides or its base.
        way = random.normal(size=3)
        way /= np.linalg.norm(way)
        aim = geom.xpos + rotation @ (random.uniform(-1.0, 1.0, 3) * [0.3, 0.2, 0.05])
        start, found = aim - 2.0 * way, np.zeros(1, dtype=np.int32)
        far = mujoco.mj_ray(scene.model, scene.data, start, way, None, 1, -1, found, None)
        if far >= 0.0 and scene.model.geom(int(found[0])).name == "hills":
            hit += 1
            assert abs(distance_to_object(objects, 0, start + far * way)) < 1e-8
            assert distance_to_object(objects, 0, start + (far - 1e-3) * way) > 0.0
            assert distance_to_object(objects, 0, start + (far + 1e-6) * way) < 1e-8
    assert hit > 100


# Notes and skipped work


def notes_on_shapes(model: Path) -> list[str]:
    notes = build_parts(RobotSettings(model=model, site="tcp"), 1, "clock").notes
    return [note for note in notes if "perceived larger" in note]


def test_what_is_perceived_larger_than_it_is_is_said_in_one_line(tmp_path: Path) -> None:
    vertices, triangles = cup()
    world = '<geom name="post" type="cylinder" size="0.1 0.1" pos="1 1 0"/>'
    world += '<geom name="bowl" type="mesh" mesh="bowl" pos="1 0 0.3"/>'
    model = planar_arm(tmp_path, world=world, extra_top=mesh_asset("bowl", vertices, triangles[1:]))
    [note] = notes_on_shapes(model)
    assert "\n" not in note
    assert "bowl as its convex hull or bounding box, post by 0.48 mm (0.3 % of its volume)" in note
