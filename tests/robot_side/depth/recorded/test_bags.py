"""Clouds of a ROS 2 bag, written and read by rosbags."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags import rosbag2, typesys

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.depth.recorded.pictures import recorded_pictures
from tests.robot_side.depth.recorded.test_recorded_pictures import CAMERA, POINTS, organised, require_seen


def cloud(types: dict[str, Any], points_m: FloatArray, stamp_s: float, height: int, order: str) -> Any:
    """Return a message with 4 bytes before each point's x, 8 after its z, and 3 after each row."""
    points = np.full((len(points_m), 24), 255, dtype=np.uint8)
    points[:, 4:16] = points_m.astype(f"{order}f4").view(np.uint8)
    rows = np.pad(points.reshape(height, -1), ((0, 0), (0, 3)))
    stamp = types["builtin_interfaces/msg/Time"](int(stamp_s), int(stamp_s % 1.0 * 1e9))
    fields = [types["sensor_msgs/msg/PointField"](name, 4 + 4 * k, 7, 1) for k, name in enumerate("xyz")]
    header, width = types["std_msgs/msg/Header"](stamp, "eye"), len(points_m) // height
    numbers = order == ">", 24, rows.shape[1], rows.reshape(-1), False
    return types["sensor_msgs/msg/PointCloud2"](header, height, width, fields, *numbers)


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    path, kind = tmp_path / "bag", "sensor_msgs/msg/PointCloud2"
    with rosbag2.Writer(path, version=9) as writer:
        for topic, messages in (
            ("/eye/points", [(POINTS, 100.25, 1, "<"), (POINTS, 100.5, 1, ">")]),
            ("/organised", [(organised()[1], 101.0, 12, "<")]),
        ):
            connection = writer.add_connection(topic, kind, typestore=store)
            for points_m, stamp_s, height, order in messages:
                message = cloud(store.types, points_m, stamp_s, height, order)
                writer.write(connection, int(stamp_s * 1e9), store.serialize_cdr(message, kind))
    return path


def test_a_bags_clouds_are_seen_with_their_stamps(bag: Path) -> None:
    found = list(recorded_pictures(bag, camera=CAMERA, topic="/eye/points"))
    assert [one.picture.taken_s for one in found] == [100.25, 100.5]
    for one in found:
        require_seen(one)


def test_a_bags_organised_cloud_is_a_picture(bag: Path) -> None:
    [found] = recorded_pictures(bag, topic="/organised")
    assert found.picture.depth_m == pytest.approx(organised()[0], rel=1e-6)


def test_a_topic_that_is_not_there_or_not_given_is_refused_by_those_that_are(bag: Path, tmp_path: Path) -> None:
    for topic in (None, "/other"):
        with pytest.raises(ConfigurationError, match=f"topic = {topic}; valid: /eye/points, /organised"):
            next(recorded_pictures(bag, topic=topic))
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigurationError, match="valid: the folder of a bag"):
        next(recorded_pictures(tmp_path / "empty"))
