"""Depth in messages of ROS 2, as rosbags has their classes; rclpy's own are in tests/arms."""

from typing import Any

import numpy as np
import pytest
from rosbags import typesys

from common.errors import ConfigurationError
from robot_side.depth.picture import Pinhole
from robot_side.depth.recorded.cloud import Cloud, VirtualCamera, depth_of
from robot_side.depth.recorded.ros_messages import cloud_of, depth_of_image, pinhole_of
from tests.robot_side.depth.recorded.test_bags import cloud
from tests.robot_side.depth.recorded.test_recorded_pictures import POINTS, organised

TYPES: Any = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE).types
DEPTH_M = np.array([[0.25, 0.0, 0.5], [1.0, 2.0, 40.0]])
STILL: Any = TYPES["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)


def image(pixels: Any, encoding: str, order: str = "<", padding: int = 0, stamp_s: float = 0.0) -> Any:
    """Return an Image of numbers (h, w), whose rows end with so many bytes of padding."""
    numbers = np.array(pixels).astype(order + {"16UC1": "u2", "32FC1": "f4"}.get(encoding, "u1"))
    rows = np.pad(numbers.view(np.uint8), ((0, 0), (0, padding)), constant_values=63)
    stamp = TYPES["builtin_interfaces/msg/Time"](int(stamp_s), int(stamp_s % 1.0 * 1e9))
    said = TYPES["std_msgs/msg/Header"](stamp, "eye"), *numbers.shape, encoding, int(order == ">"), rows.shape[1]
    return TYPES["sensor_msgs/msg/Image"](*said, rows.reshape(-1))


def camera_info(size: tuple[int, int], d: tuple[float, ...] = (0.0,) * 5, model: str = "plumb_bob") -> Any:
    """Return the CameraInfo of a picture (h, w); its P is another than its K."""
    k, p = [50.0, 0, 30.5, 0, 51.0, 20.25, 0, 0, 1.0], [40.0, 0, 29.5, -3.0, 0, 41.0, 19.5, 0, 0, 0, 1.0, 0]
    matrices = (np.array(one) for one in (d, k, np.eye(3).ravel(), p))
    return TYPES["sensor_msgs/msg/CameraInfo"](None, *size, model, *matrices, 0, 0, STILL)


@pytest.mark.parametrize("padding", [0, 3, 8])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("encoding", "unit_m"), [("16UC1", 0.001), ("32FC1", 1.0)])
def test_an_images_depth_is_in_metres(encoding: str, unit_m: float, order: str, padding: int) -> None:
    found = depth_of_image(image(DEPTH_M / unit_m, encoding, order, padding))
    assert found.dtype == np.float32
    assert found == pytest.approx(DEPTH_M, rel=1e-6)


def test_what_was_not_measured_is_a_hole() -> None:
    found = depth_of_image(image([[np.nan, np.inf, -np.inf], [-0.5, 0.0, 0.5]], "32FC1"))
    assert found.tolist() == [[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]]


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"encoding": "mono16"}, "encoding = mono16; valid: 16UC1, 32FC1"),
        ({"step": 5}, "step = 5, 12 bytes of data; valid: 2 rows of 6 bytes or more"),
        ({"height": 3}, "step = 6, 12 bytes of data; valid: 3 rows of 6 bytes or more"),
        ({"width": 2, "encoding": "32FC1"}, "step = 6, 12 bytes of data; valid: 2 rows of 8 bytes or more"),
    ],
)
def test_an_image_that_cannot_be_is_refused_by_its_field(changed: dict[str, Any], says: str) -> None:
    sent = image(1e3 * DEPTH_M, "16UC1")
    vars(sent).update(changed)
    with pytest.raises(ConfigurationError) as refused:
        depth_of_image(sent)
    assert str(refused.value) == says


def test_a_pinhole_counts_from_the_upper_left_corner() -> None:
    seen = image(np.zeros((48, 64)), "16UC1")
    assert pinhole_of(camera_info((48, 64)), seen) == Pinhole(50.0, 51.0, 31.0, 20.75)
    assert pinhole_of(camera_info((48, 64), (0.001, -0.001)), seen) == Pinhole(50.0, 51.0, 31.0, 20.75)
    bent = camera_info((48, 64), (0.3, -0.2))
    assert pinhole_of(bent, seen, rectified=True) == Pinhole(40.0, 41.0, 30.0, 20.0)


@pytest.mark.parametrize(
    ("info", "says"),
    [
        (
            camera_info((48, 64), (0.0, -0.002, 0.0)),
            "CameraInfo: plumb_bob, d = [0.0, -0.002, 0.0]; valid: d up to 0.001",
        ),
        (camera_info((48, 64), (np.nan,)), "CameraInfo: plumb_bob, d = [nan]; valid"),
        (camera_info((48, 64), (0.0,) * 4, "equidistant"), "CameraInfo: equidistant, d = [0.0, 0.0, 0.0, 0.0]; valid"),
        (camera_info((96, 128)), "CameraInfo: width, height = 128, 96; valid: the image's 64, 48"),
    ],
)
def test_a_camera_info_that_is_not_the_images_is_refused(info: Any, says: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        pinhole_of(info, image(np.zeros((48, 64)), "16UC1"))
    assert str(refused.value).startswith(says)


def test_a_cloud_without_coordinates_is_refused_by_its_topic() -> None:
    sent = cloud(TYPES, POINTS, 0.0, 1, "<")
    sent.fields.pop()
    with pytest.raises(ConfigurationError, match=r"^/points: fields, point_step or row_step: 'z'; valid: x, y, z"):
        cloud_of(sent, "/points")


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        # NumPy takes such an offset, and reads elsewhere in memory.
        ({"offset": 2**31 - 1}, "x, y and z end at byte 21474836"),
        ({"offset": 1000}, "x, y and z end at byte 100"),
        ({"width": 1000}, "1000 points of "),
        ({"point_step": 2**32 - 1}, "points of 4294967295 bytes"),
        ({"row_step": 1}, "in rows of 1;"),
        ({"height": 2}, "reshape"),
    ],
)
def test_a_cloud_whose_sizes_lie_is_refused(fields: dict[str, int], says: str) -> None:
    sent = cloud(TYPES, POINTS, 0.0, 1, "<")
    for name, value in fields.items():
        setattr(sent.fields[-1] if name == "offset" else sent, name, value)
    with pytest.raises(ConfigurationError, match=r"^/points: fields, point_step or row_step: ") as refused:
        cloud_of(sent, "/points")
    assert says in str(refused.value)


def test_a_cloud_without_points_is_an_empty_picture() -> None:
    found = cloud_of(cloud(TYPES, np.empty((0, 3)), 0.0, 1, "<"), "/points")
    assert not depth_of(found, VirtualCamera())[0].any()


def test_points_that_are_not_finite_are_holes_of_an_organised_cloud() -> None:
    depth_m, points_m = organised()
    points_m[7], points_m[23, 0] = np.inf, -np.inf
    depth_m.flat[[7, 23]] = 0.0
    found, _ = depth_of(Cloud(points_m, depth_m.shape), VirtualCamera())
    assert found == pytest.approx(depth_m, rel=1e-6)
