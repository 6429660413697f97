"""Clouds in bags of ROS 2, read by `rosbags`."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from common.errors import ConfigurationError
from common.extras import installing
from robot_side.depth.recorded.cloud import Cloud
from robot_side.depth.recorded.ros_messages import cloud_of

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

_KIND: Final = "sensor_msgs/msg/PointCloud2"


def bag_clouds(path: Path, topic: str | None = None) -> Iterator[tuple[float, Cloud]]:
    """Yield each cloud of a bag, the folder `path`, and its stamp in s.

    topic: None if only one has clouds. ConfigurationError names the bag and what is invalid.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError  # noqa: PLC0415  # optional
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415
    except ImportError as error:
        raise ConfigurationError(f"{path}: {error}; to install it: {installing('recorded')}") from error
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            yield from _clouds(reader, path, topic)
    except (AnyReaderError, OSError) as error:
        raise ConfigurationError(f"{path}: {error}; valid: the folder of a bag") from error


def _clouds(reader: "AnyReader", path: Path, topic: str | None) -> Iterator[tuple[float, Cloud]]:
    topics = sorted({one.topic for one in reader.connections if one.msgtype == _KIND})
    chosen = topics[0] if topic is None and len(topics) == 1 else topic
    if chosen not in topics:
        raise ConfigurationError(f"{path}: topic = {topic}; valid: {', '.join(topics) or f'none: it has no {_KIND}'}")
    for connection, _, payload in reader.messages([one for one in reader.connections if one.topic == chosen]):
        message: Any = reader.deserialize(payload, connection.msgtype)
        stamp = message.header.stamp
        yield stamp.sec + 1e-9 * stamp.nanosec, cloud_of(message, f"{path}: {chosen}")
