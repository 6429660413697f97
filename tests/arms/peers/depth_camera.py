"""Depth camera under ROS 2 before a wall at 0.6 m, 15 times a second: /camera/depth, camera_info and points.

Usage: depth_camera.py 16UC1|32FC1|cloud|... [STAMP-S]. Left of the optical axis there is the wall, right of it nothing.
Pictures have an odd row step and the other order of bytes. They were taken 50 ms ago, or at STAMP-S.
"""

import sys
import time

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Header

WIDTH, HEIGHT, FOCAL_PX, WALL_M, AGE_NS = 160, 120, 130.0, 0.6, 50_000_000
CENTER_PX = 79.5, 59.5
"""As ROS counts them: in the middle of the picture"""


def depth_m(hole: float) -> "np.ndarray[tuple[int, ...], np.dtype[np.float32]]":
    """Return the depth of each pixel."""
    return np.where(np.arange(WIDTH) < WIDTH // 2, WALL_M, hole).astype(np.float32) * np.ones((HEIGHT, 1), np.float32)


def image(encoding: str, header: Header) -> Image:
    """Return a padded picture of big-endian numbers."""
    depth = depth_m(np.nan) if encoding == "32FC1" else (1e3 * depth_m(0.0)).round()
    numbers = np.ascontiguousarray(depth.astype(">f4" if encoding == "32FC1" else ">u2"))
    padded = np.pad(numbers.view(np.uint8), ((0, 0), (0, 3)), constant_values=7)
    shape = {"height": HEIGHT, "width": WIDTH, "step": padded.shape[1], "is_bigendian": 1}
    return Image(header=header, encoding=encoding, data=padded.tobytes(), **shape)


def cloud(header: Header) -> PointCloud2:
    """Return the same as an organised cloud."""
    z = depth_m(np.nan)
    x = z * (np.arange(WIDTH) - CENTER_PX[0]) / FOCAL_PX
    y = z * (np.arange(HEIGHT)[:, None] - CENTER_PX[1]) / FOCAL_PX
    points = np.stack([x, y, z], axis=-1).astype("<f4")
    fields = [PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1) for k, name in enumerate("xyz")]
    steps = {"height": HEIGHT, "width": WIDTH, "point_step": 12, "row_step": 12 * WIDTH}
    return PointCloud2(header=header, fields=fields, data=points.tobytes(), **steps)


def main(what: str, stamp_s: str = "") -> None:
    """Publish until a signal ends it."""
    rclpy.init()
    node = rclpy.create_node("depth_camera")
    pictures = node.create_publisher(Image, "/camera/depth", qos_profile_sensor_data)
    clouds = node.create_publisher(PointCloud2, "/camera/points", qos_profile_sensor_data)
    infos = node.create_publisher(CameraInfo, "/camera/camera_info", qos_profile_sensor_data)

    def publish() -> None:
        taken_ns = int(1e9 * float(stamp_s)) if stamp_s else time.time_ns() - AGE_NS
        header = Header(stamp=Time(sec=taken_ns // 10**9, nanosec=taken_ns % 10**9), frame_id="camera_optical")
        if what == "cloud":
            clouds.publish(cloud(header))
            return
        matrix = [FOCAL_PX, 0.0, CENTER_PX[0], 0.0, FOCAL_PX, CENTER_PX[1], 0.0, 0.0, 1.0]
        said = {"distortion_model": "plumb_bob", "d": [0.0] * 5, "k": matrix}
        infos.publish(CameraInfo(header=header, width=WIDTH, height=HEIGHT, **said))
        pictures.publish(image(what, header))

    node.create_timer(1 / 15, publish)
    rclpy.spin(node)


if __name__ == "__main__":
    main(*sys.argv[1:])
