"""Recorded depth and clouds become pictures, and files that cannot be read say why."""

import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.depth.picture import Pinhole
from robot_side.depth.recorded.cloud import Cloud, VirtualCamera, depth_of
from robot_side.depth.recorded.pictures import Recorded, recorded_pictures

POINTS = np.array([[0.1, -0.2, 1.0], [0.1, -0.2, 0.999], [-0.3, 0.2, 1.5], [np.nan, np.nan, np.nan], [0.0, 0.0, -1.0]])
"""Two on one pixel's ray, one farther, one that was not measured, and one behind"""
PINHOLE = Pinhole(20.0, 22.0, 8.25, 5.5)
CAMERA = VirtualCamera(40, 30, 70.0)


def only(path: Path, **options: Any) -> Recorded:
    [found] = recorded_pictures(path, **options)
    return found


def require_seen(found: Recorded) -> None:
    """Check that a file with POINTS was seen by CAMERA: two pixels, the nearer point in the first."""
    depth_m, pinhole = found.picture.depth_m, CAMERA.pinhole
    assert depth_m.shape == (30, 40)
    assert depth_m.dtype == np.float32
    assert found.picture.pinhole == pinhole
    pixels = {
        (int(pinhole.fy * y / z + pinhole.cy), int(pinhole.fx * x / z + pinhole.cx)): z for x, y, z in POINTS[1:3]
    }
    assert sorted(zip(*map(np.ndarray.tolist, np.nonzero(depth_m)), strict=True)) == sorted(pixels)
    for pixel, z in pixels.items():
        assert depth_m[pixel] == pytest.approx(z)


def organised() -> tuple[FloatArray, FloatArray]:
    """Return a depth picture (12, 16) with a hole, and its points (12 * 16, 3), NaN there."""
    depth_m = np.random.default_rng(3).uniform(0.3, 2.0, (12, 16))
    depth_m[4, 5] = 0.0
    z = np.where(depth_m > 0.0, depth_m, np.nan)
    x = z * (np.arange(16) + 0.5 - PINHOLE.cx) / PINHOLE.fx
    y = z * (np.arange(12)[:, None] + 0.5 - PINHOLE.cy) / PINHOLE.fy
    return depth_m, np.stack([x, y, z], axis=-1).reshape(-1, 3)


def pcd(points_m: FloatArray, form: str, height: int = 1, **fields: str) -> bytes:
    """Return a PCD file with a field of two numbers between x and the others, and padding. `fields` replace lines."""
    said = {
        "VERSION": "0.7",
        "FIELDS": "x pair y _ _ z",
        "SIZE": "4 2 4 1 1 8",
        "TYPE": "F U F U U F",
        "COUNT": "1 2 1 3 2 1",
        "WIDTH": str(len(points_m) // height),
        "HEIGHT": str(height),
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": str(len(points_m)),
        "DATA": form,
    } | fields
    lines = ["# .PCD v0.7", *(f"{name} {value}" for name, value in said.items() if value)]
    if form == "ascii":
        lines += [f"{x:.9g} 1 2 {y:.9g} 1 2 3 4 5 {z:.17g}" for x, y, z in points_m]
    content = ("\n".join(lines) + "\n").encode()
    if form != "ascii":
        content += b"".join(struct.pack("<fHHf5Bd", x, 1, 2, y, 1, 2, 3, 4, 5, z) for x, y, z in points_m)
    return content


def ply(points_m: FloatArray, form: str) -> bytes:
    """Return a PLY file with a field between x and the others, and a triangle after the points."""
    properties = "property float x\nproperty uchar red\nproperty float32 y\nproperty double z\n"
    faces = "element face 1\nproperty list uchar int vertex_indices\n"
    elements = f"comment element vertex 7\nelement vertex {len(points_m)}\n{properties}{faces}"
    head = f"ply\nformat {form} 1.0\n{elements}end_header\n"
    if form == "ascii":
        return (head + "".join(f"{x} 255 {y} {z}\n" for x, y, z in points_m) + "3 0 1 2\n").encode()
    body = b"".join(struct.pack("<fBfd", x, 255, y, z) for x, y, z in points_m)
    return head.encode() + body + struct.pack("<B3i", 3, 0, 1, 2)


@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_a_pcd_in_no_order_is_seen_from_its_origin(tmp_path: Path, form: str) -> None:
    path = tmp_path / "points.pcd"
    path.write_bytes(pcd(POINTS, form))
    found = only(path, camera=CAMERA, taken_s=4.5)
    require_seen(found)
    assert found.picture.taken_s == 4.5


@pytest.mark.parametrize("form", ["ascii", "binary"])
def test_a_pcd_is_seen_from_its_viewpoint(tmp_path: Path, form: str) -> None:
    position_m, turned = np.array([1.0, -2.0, 0.5]), Rotation.from_euler("zyx", [0.4, -0.9, 2.0])
    viewpoint = [*position_m, *turned.as_quat(scalar_first=True)]
    path = tmp_path / "points.PCD"
    path.write_bytes(pcd(POINTS @ turned.as_matrix().T + position_m, form, VIEWPOINT=" ".join(map(str, viewpoint))))
    found = only(path, camera=CAMERA)
    require_seen(found)
    assert found.pose is not None
    assert found.pose.position_m == pytest.approx(position_m)
    assert found.pose.rotation == pytest.approx(turned.as_matrix())


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_a_ply_is_seen_from_its_origin(tmp_path: Path, form: str) -> None:
    path = tmp_path / "points.ply"
    path.write_bytes(ply(POINTS, form))
    found = only(path, camera=CAMERA)
    require_seen(found)
    assert found.pose is None


def test_an_organised_cloud_is_the_picture_that_a_pinhole_took(tmp_path: Path) -> None:
    depth_m, points_m = organised()
    path = tmp_path / "points.pcd"
    path.write_bytes(pcd(points_m, "binary", height=12))
    found = only(path).picture
    assert found.depth_m == pytest.approx(depth_m, rel=1e-6)
    assert vars(found.pinhole) == pytest.approx(vars(PINHOLE), rel=1e-4)


def test_an_organised_cloud_that_no_pinhole_took_is_seen_by_the_virtual_camera() -> None:
    _, points_m = organised()
    points_m[40, 0] += 0.05
    depth_m, pinhole = depth_of(Cloud(points_m, (12, 16)), CAMERA)
    assert depth_m.shape == (30, 40)
    assert pinhole == CAMERA.pinhole
    assert depth_m.any()


def test_a_cloud_without_a_point_ahead_is_an_empty_picture() -> None:
    for shape in (None, (2, 1)):
        depth_m, _ = depth_of(Cloud(POINTS[3:], shape), CAMERA)
        assert not depth_m.any()


def test_recorded_depth_comes_with_its_time_and_its_pose(tmp_path: Path) -> None:
    depth_m, _ = organised()
    depth_m[0, :3] = np.nan, np.inf, -1.0
    path, turned = tmp_path / "depth.npz", Rotation.from_euler("x", 0.3).as_matrix()
    numbers: dict[str, Any] = {"fx": 20, "fy": 22.0, "cx": 8.25, "cy": 5.5, "taken_s": 12.5}
    np.savez(path, depth_m=depth_m, position_m=[1.0, 2.0, 3.0], rotation=turned, **numbers)
    found = only(path)
    depth_m[0, :3] = 0.0
    assert found.picture.depth_m == pytest.approx(depth_m, rel=1e-6)
    assert (found.picture.pinhole, found.picture.taken_s) == (PINHOLE, 12.5)
    assert found.pose is not None
    assert found.pose.position_m.tolist() == [1.0, 2.0, 3.0]
    assert found.pose.rotation == pytest.approx(turned)
    np.savez(path, depth_m=depth_m, **numbers)
    assert only(path).pose is None


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"fx": None}, "fx is missing"),
        ({"taken_s": np.nan}, "taken_s has float64 in 0 dimensions; valid: finite numbers in 0 dimensions"),
        ({"depth_m": np.ones(3)}, "depth_m has float64 in 1 dimensions; valid: finite numbers in 2"),
        ({"depth_m": np.array([["a"]])}, "depth_m has <U1"),
        ({"position_m": np.ones(3)}, "rotation is missing"),
        ({"position_m": np.ones(3), "rotation": np.diag([1.0, 1.0, -1.0])}, "position_m, rotation; valid"),
        ({"position_m": np.ones(2), "rotation": np.eye(3)}, "position_m, rotation; valid"),
    ],
)
def test_recorded_depth_that_cannot_be_is_refused_by_its_field(
    tmp_path: Path, changed: dict[str, Any], says: str
) -> None:
    path = tmp_path / "depth.npz"
    held: dict[str, Any] = {"depth_m": np.ones((2, 2)), "fx": 1.0, "fy": 1.0, "cx": 1.0, "cy": 1.0, "taken_s": 0.0}
    np.savez(path, **{name: value for name, value in (held | changed).items() if value is not None})
    with pytest.raises(ConfigurationError) as refused:
        only(path)
    assert str(refused.value).startswith(f"{path}: {says}")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (pcd(POINTS, "binary", FIELDS=""), "FIELDS is missing"),
        (pcd(POINTS, "binary", FIELDS="a pair y _ _ z"), "fields = a, pair, y, _, _, z; valid: x, y and z"),
        (pcd(POINTS, "binary", FIELDS="x pair y _ _ y"), "fields = x, pair, y, _, _, y; valid: x, y and z"),
        (pcd(POINTS, "binary", SIZE="2 2 4 1 1 8"), "x is F 2 1; valid: F 4 1"),
        (pcd(POINTS, "binary", TYPE="F U F"), "TYPE, SIZE or COUNT is too short"),
        (pcd(POINTS, "binary", WIDTH="-5"), "WIDTH = -5; valid: a whole number"),
        (pcd(POINTS, "binary", DATA="binary_compressed"), "DATA = binary_compressed; valid: ascii, binary"),
        (pcd(POINTS, "binary", VIEWPOINT="0 0 0 0 0 0 0"), "VIEWPOINT = "),
        (pcd(POINTS, "binary", VIEWPOINT="0 0 0 one 0 0 0"), "VIEWPOINT: could not convert string to float"),
        (pcd(POINTS, "binary", COUNT="2 2 1 1 1 1"), "fields = x, pair, y, _, _, z; valid: x, y and z, each once"),
        (pcd(POINTS, "binary")[:-1], "124 bytes of points; valid: 125 or more, for 5 points"),
        (pcd(POINTS, "ascii").replace(b"0.999", b"far"), "x, y, z: could not convert string to float"),
        (pcd(POINTS, "ascii", WIDTH="6"), "50 numbers of points; valid: 60"),
        (pcd(POINTS, "ascii", DATA=""), "the header has no end; valid: a line DATA"),
    ],
)
def test_a_pcd_that_cannot_be_read_is_refused_by_its_field(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "points.pcd"
    path.write_bytes(content)
    with pytest.raises(ConfigurationError) as refused:
        only(path)
    assert str(refused.value).startswith(f"{path}: {says}")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b"ascii", b"binary_big_endian", "format = binary_big_endian; valid: ascii, binary_little_endian"),
        (b"property float x\n", b"", "fields = red, y, z; valid: x, y and z, each once"),
        (b"float x", b"list uchar float x", "property list; valid: char"),
        (b"element vertex 5", b"element camera 1\nelement vertex 5", "element camera is before vertex"),
        (b"\nelement vertex 5", b"", "element vertex is missing"),
        (b"end_header", b"end", "the header has no end"),
    ],
)
def test_a_ply_that_cannot_be_read_is_refused_by_its_field(tmp_path: Path, old: bytes, new: bytes, says: str) -> None:
    path, content = tmp_path / "points.ply", ply(POINTS, "ascii")
    assert old in content
    path.write_bytes(content.replace(old, new))
    with pytest.raises(ConfigurationError) as refused:
        only(path)
    assert str(refused.value).startswith(f"{path}: {says}")


def test_other_files_are_refused_by_what_is_valid(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"points\.las; valid: \.npz, \.pcd, \.ply, or the folder"):
        only(tmp_path / "points.las")
    for name in ("missing.pcd", "missing.npz"):
        with pytest.raises(ConfigurationError, match=rf"{name}: .*No such file"):
            only(tmp_path / name)
    (tmp_path / "broken.npz").write_bytes(b"no archive")
    with pytest.raises(ConfigurationError, match=r"broken\.npz: .*; valid: an \.npz file"):
        only(tmp_path / "broken.npz")


def test_a_bag_without_rosbags_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(ConfigurationError, match=r"rosbags.*; to install it: pip install '.\[recorded\]'"):
        only(tmp_path)
