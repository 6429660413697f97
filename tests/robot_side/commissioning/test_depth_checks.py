"""Checks of depth cameras, with pictures by casting rays."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from robot_side.commissioning.checklist import Check
from robot_side.commissioning.depth_checks import depth_checks
from robot_side.commissioning.depth_figures import LookedAt
from robot_side.depth.own_body import beyond_m
from robot_side.depth.picture import CameraPose, DepthErrors, DepthPicture, OwnBody
from robot_side.depth.support import supported
from robot_side.depth.view import view_of
from robot_side.drivers.mujoco.model_enums import GeomKind
from robot_side.settings import RobotSettings
from tests.robot_side.depth.ray_cast import STEREO, Box, Camera, Rod, looking

ARM = Box((0.0, 0.0, 0.2), (0.06, 0.05, 0.2))
WALL = Box((0.0, 0.6, 0.5), (2.0, 0.02, 2.0))
CAMERA = Camera(looking((0.1, -0.6, 0.5), (0.0, 0.0, 0.2)))
TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def solid(kind: GeomKind, *sizes_m: float) -> OwnBody:
    """Return a solid at the height 0.2 m, turned by a quarter around it."""
    size = np.array([[*sizes_m, 0.0, 0.0][:3]])
    return OwnBody(np.array([int(kind)]), np.array([[0.0, 0.0, 0.2]]), TURNED[None], size)


def looked(
    moved_m: tuple[float, float, float] = (0.0, 0.0, 0.0), pictures: int = 10, arm_known: bool = True, **changes: Any
) -> dict[str, Check]:
    """Return the checks of pictures that were taken within a second by a camera which is believed elsewhere."""
    looks = LookedAt()
    pose = CameraPose(CAMERA.pose.position_m + np.array(moved_m), CAMERA.pose.rotation)
    noise = np.random.default_rng(52)
    for number in range(pictures):
        looks.now_s = 0.1 * number + 0.07
        taken = dataclasses.replace(CAMERA.picture([ARM, WALL], 0.1 * number, noise), **changes)
        looks.see(taken, pose, solid(GeomKind.BOX, 0.05, 0.06, 0.2), STEREO, 0)
    found = depth_checks("eye", looks.figures[0], 1.0, RobotSettings(), arm_known=arm_known)
    return {check.name.removeprefix("eye: "): check for check in found}


@pytest.mark.parametrize(
    ("body", "point_m", "distance_m"),
    [
        (solid(GeomKind.BOX, 0.05, 0.1, 0.2), (0.13, 0.09, 0.2), 0.05),
        (solid(GeomKind.BOX, 0.05, 0.1, 0.2), (0.08, 0.0, 0.2), -0.02),
        (solid(GeomKind.SPHERE, 0.1), (0.0, 0.0, 0.23), -0.07),
        (solid(GeomKind.CAPSULE, 0.05, 0.1), (0.0, 0.0, 0.37), 0.02),
        (solid(GeomKind.CYLINDER, 0.05, 0.1), (0.0, 0.0, 0.29), -0.01),
        (solid(GeomKind.CYLINDER, 0.05, 0.1), (0.0, 0.08, 0.34), 0.05),
        (solid(GeomKind.ELLIPSOID, 0.05, 0.1, 0.2), (0.1, 0.0, 0.2), 0.0),
    ],
)
def test_distances_from_a_solid_have_a_sign(
    body: OwnBody, point_m: tuple[float, float, float], distance_m: float
) -> None:
    assert beyond_m(np.array([point_m]), body) == pytest.approx([distance_m])


def test_the_nearest_solid_counts() -> None:
    one, other = solid(GeomKind.SPHERE, 0.1), solid(GeomKind.SPHERE, 0.05)
    names = "kinds", "positions_m", "rotations", "sizes_m"
    both = OwnBody(*(np.concatenate([getattr(one, name), getattr(other, name)]) for name in names))
    assert beyond_m(np.array([[0.0, 0.0, 0.32]]), both) == pytest.approx([0.02])


def test_a_good_camera_passes() -> None:
    found = looked()
    assert {name: check.good for name, check in found.items()} == {
        **dict.fromkeys(("pictures", "age", "holes", "range", "mount"), True),
        "rods": None,
    }
    assert found["pictures"].said == "10 a second, 320 x 240 pixels"
    assert found["age"].said == "at most 70 ms in half of the pictures, 70 ms in 95 %"
    assert found["rods"].said == (
        "thinnest with support: 4.2 mm at 0.3 m, 6.9 mm at 0.5 m, 13.9 mm at 1 m; one of 5 mm is felt up to 0.36 m"
    )


@pytest.mark.parametrize(
    ("moved_m", "good", "said"),
    [
        ((0.0, -0.008, 0.0), None, "6 mm is allowed for"),
        ((0.0, -0.016, 0.0), False, "the arm warns of itself"),
        ((0.0, 0.016, 0.0), False, "the arm warns of itself"),
        ((0.5, 0.0, 0.0), None, "points a picture lie within 30 mm"),
    ],
)
def test_a_wrong_mount_is_told_by_the_arms_own_surface(
    moved_m: tuple[float, float, float], good: bool | None, said: str
) -> None:
    mount = looked(moved_m)["mount"]
    assert mount.good is good
    assert said in mount.said
    assert mount.remedy is not None


def test_a_camera_that_is_moved_towards_itself_sees_the_arm_nearer() -> None:
    said = looked((0.0, -0.008, 0.0))["mount"].said
    assert 3.0 < float(said.split()[5]) < 8.0


def test_without_the_arms_readings_no_mount_is_judged() -> None:
    mount = looked(arm_known=False)["mount"]
    assert mount.good is None
    assert "as its model starts" in mount.said


@pytest.mark.parametrize(
    ("changes", "pictures", "wrong", "said"),
    [
        ({}, 3, "pictures", "3 a second"),
        ({"taken_s": -0.3}, 10, "age", "1225 ms in 95 %"),
        ({"depth_m": np.zeros((240, 320), np.float32)}, 10, "holes", "100% of the pixels are empty"),
        ({"depth_m": np.zeros((240, 320), np.float32)}, 10, "range", "nothing is measured"),
        ({"depth_m": np.full((240, 320), 600.0, np.float32)}, 10, "range", "600.00 to 600.00 m are measured"),
    ],
)
def test_what_is_wrong_with_pictures_is_told(changes: dict[str, Any], pictures: int, wrong: str, said: str) -> None:
    check = looked(pictures=pictures, **changes)[wrong]
    assert check.good is not True
    assert said in check.said
    assert check.remedy is not None


@pytest.mark.parametrize("depth_m", [0.3, 0.5, 1.0])
def test_the_thinnest_rod_has_support_wherever_it_stands_even_with_an_edge_that_is_a_hole(depth_m: float) -> None:
    camera = Camera(looking((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    radius_m = 0.5 * 3.0 * depth_m / camera.pinhole.fx
    for shift_px in np.arange(0.0, 1.0, 0.1):
        rod = Rod(shift_px * depth_m / camera.pinhole.fx, depth_m, radius_m)
        seen = camera.picture([rod, Box((0.0, depth_m + 0.5, 0.0), (3.0, 0.01, 3.0))])
        edge = int(np.flatnonzero(seen.depth_m[120] < depth_m + 0.2)[0])
        seen.depth_m[:, edge] = 0.0
        kept = supported(seen.depth_m, view_of(seen.pinhole, camera.pose, DepthErrors(STEREO.growth_per_m)))
        assert np.all(np.abs(kept[120, edge + 1 : edge + 3] - depth_m) < 0.01)


def test_a_picture_without_anything_has_no_points() -> None:
    looks = LookedAt()
    nothing = DepthPicture(0.0, np.zeros((240, 320), np.float32), CAMERA.pinhole)
    looks.see(nothing, CAMERA.pose, solid(GeomKind.BOX, 0.1, 0.1, 0.1), STEREO, 0)
    assert len(looks.figures[0][0].beyond_m) == 0
    assert np.isnan(looks.figures[0][0].depths_m).all()
