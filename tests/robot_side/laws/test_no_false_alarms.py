"""Objects beside the path or behind are not felt, however near; an object ahead is felt, at its own distance."""

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.overlap import Mesh
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import AHEAD, RADIUS_M, along, ball_pose, look, ways_of
from tests.helpers.gripper_poses import gripper_pose
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES, grid_tetrahedra
from tests.helpers.perceived_scenes import Scene, random_rotation

INFLATED_M = 0.007
GRIPPER = gripper_pose()
SIDE_M = float((GRIPPER.sphere_centers_m[:, 0] + GRIPPER.sphere_radii_m).max())


def bench(made_of: str, top_m: float, rotation: FloatArray) -> PerceivedObjects:
    """Return a bench of 0.8 x 0.8 m, 40 mm thick, with its top at `top_m` along x.

    The same solid can be made of different primitives.
    """
    center, half = np.array([top_m + 0.02, 0.0, 0.1]), np.array([0.02, 0.4, 0.4])
    halves = [(center + side * np.array([0.0, 0.0, 0.2]), half * [1.0, 1.0, 0.5]) for side in (-1.0, 1.0)]
    scene = Scene().add()
    if made_of == "1 box":
        scene.box(rotation @ center, half, rotation)
    elif made_of == "mesh":
        scene.mesh(Mesh(CUBE_CORNERS * half, CUBE_TRIANGLES), rotation @ center, rotation)
    for part, size in halves:
        if made_of == "2 boxes":
            scene.box(rotation @ part, size, rotation)
        elif made_of == "12 tetrahedra":
            places, tetrahedra = grid_tetrahedra(1)
            for corners in (part + (2.0 * places - 1.0) * size)[tetrahedra]:
                scene.tetrahedron(corners @ rotation.T)
    return scene.objects()


MADE_OF = ("1 box", "2 boxes", "12 tetrahedra", "mesh")


@pytest.mark.parametrize("made_of", MADE_OF)
@pytest.mark.parametrize("gap_m", [0.0, 0.001, 0.003, 0.0069, 0.0071, 0.01, 0.02, 0.03])
def test_along_a_bench_there_is_no_way_however_it_is_told(made_of: str, gap_m: float) -> None:
    rotation = random_rotation(np.random.default_rng(3))
    pose = gripper_pose((0.0, 0.0, 0.0), rotation)
    objects = bench(made_of, SIDE_M + gap_m, rotation)
    for direction in (AHEAD, -AHEAD, [0.0, 1.0, 0.0], [0.0, 0.6, -0.8]):
        found = look(pose, objects, along(rotation @ direction, INFLATED_M))
        assert np.isinf(found.fast_m).all()
        assert np.isinf(found.slow_m).all()


@pytest.mark.parametrize("kind", ["wall", "half-space", "ball", "tetrahedron", "mesh"])
@pytest.mark.parametrize("depth_m", [-0.01, 0.0, 0.005, 0.012, 0.03])
def test_the_way_back_out_is_free(kind: str, depth_m: float) -> None:
    """The sphere starts before an object, at it or in it. Going back makes nothing worse, so nothing is felt."""
    face_m = RADIUS_M - depth_m
    scene = Scene().add()
    if kind == "wall":
        scene.box([0.0, 0.0, face_m + 0.05], [0.3, 0.3, 0.05])
    elif kind == "half-space":
        scene.half_space(-AHEAD, -face_m)
    elif kind == "ball":
        scene.sphere([0.0, 0.0, face_m + 0.03], 0.03)
    elif kind == "mesh":
        scene.mesh(Mesh(0.05 * CUBE_CORNERS, CUBE_TRIANGLES), [0.0, 0.0, face_m + 0.05])
    else:
        corners = np.array([[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
        scene.tetrahedron(corners + face_m * AHEAD)
    assert np.isinf(ways_of(ball_pose(), scene.objects(), along(-AHEAD, INFLATED_M))).all()


@pytest.mark.parametrize("made_of", ["boxes", "tetrahedra"])
@pytest.mark.parametrize("inside_m", [-0.004, 0.0, 0.006, 0.02])
def test_a_seam_within_an_object_is_no_surface(made_of: str, inside_m: float) -> None:
    """The sphere moves along the face of two blocks, one behind the other, `inside_m` deep in them, past their seam."""
    scene, half = Scene().add(), np.array([0.1, 0.2, 0.05])
    center = np.array([RADIUS_M + 0.1 - inside_m, 0.0, 0.0])
    for place in (-0.05, 0.05):
        if made_of == "boxes":
            scene.box(center + place * AHEAD, half)
        else:
            scene.box_of_tetrahedra(center + place * AHEAD, half, np.eye(3))
    for start_m in (-0.04, -0.01, -0.001, 0.0, 0.01):
        pose = ball_pose(tool_position_m=start_m * AHEAD)
        assert np.isinf(ways_of(pose, scene.objects(), along(AHEAD, INFLATED_M, reach_m=0.3))).all()


@pytest.mark.parametrize("side_gap_m", [0.0005, 0.002, 0.0069, 0.01])
@pytest.mark.parametrize("seamless", [True, False])
def test_inside_a_u_the_way_is_the_one_to_its_bottom(side_gap_m: float, seamless: bool) -> None:
    """The inflated sphere overlaps both sides of the U from the start; sides and bottom are one object."""
    free_m = 0.06
    bottom_m = RADIUS_M + INFLATED_M + free_m
    alone = ways_of(ball_pose(), Scene().add().half_space(-AHEAD, -bottom_m).objects(), along(AHEAD, INFLATED_M))
    side_m = RADIUS_M + side_gap_m
    scene = Scene().add()
    for side in (-1.0, 1.0):
        length = 0.5 * (bottom_m + 0.1) + (0.01 if seamless else 0.0)
        scene.box([side * (side_m + 0.02), 0.0, bottom_m + (0.02 if seamless else 0.0) - length], [0.02, 0.1, length])
    scene.box([0.0, 0.0, bottom_m + 0.01], [side_m + (0.0 if seamless else 0.04), 0.1, 0.01])
    onsets = ways_of(ball_pose(), scene.objects(), along(AHEAD, INFLATED_M))
    # A narrow U exposes less of the bottom, so that weak strengths begin a little earlier.
    assert free_m - 0.012 < onsets[0] <= alone[0] + 1e-5
    assert free_m - 0.0015 < onsets[7] <= free_m
