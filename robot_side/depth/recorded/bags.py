"""Clouds in bags of ROS 2, read by `rosbags`."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from common.errors import ConfigurationError
from robot_side.depth.recorded.cloud import Cloud
from robot_side.depth.recorded.cloud_files import coordinates

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

_KIND: Final = "sensor_msgs/msg/PointCloud2"
_TYPES: Final = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""NumPy's types by PointField's numbers"""


def bag_clouds(path: Path, topic: str | None = None) -> Iterator[tuple[float, Cloud]]:
    """Yield each cloud of a bag, the folder `path`, and its stamp in s.

    topic: None if only one has clouds. ConfigurationError names the bag and what is invalid.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError  # noqa: PLC0415  # optional
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415
    except ImportError as error:
        raise ConfigurationError(f"{path}: {error}; valid: with `pip install '.[recorded]'` in the clone") from error
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
        yield stamp.sec + 1e-9 * stamp.nanosec, _cloud(message, f"{path}: {chosen}")


def _cloud(message: Any, where: str) -> Cloud:
    fields = {one.name: one for one in message.fields}
    order = ">" if message.is_bigendian else "<"
    try:
        formats = [order + _TYPES[fields[name].datatype] for name in "xyz"]
        offsets = [fields[name].offset for name in "xyz"]
        point = np.dtype(
            {"names": ["x", "y", "z"], "formats": formats, "offsets": offsets, "itemsize": message.point_step}
        )
        rows = np.asarray(message.data).reshape(message.height, message.row_step)
    except (KeyError, ValueError) as error:
        raise ConfigurationError(f"{where}: fields, point_step or row_step: {error}; valid: x, y, z") from error
    # A row may end with padding.
    used = np.ascontiguousarray(rows[:, : message.width * message.point_step])
    shape = (message.height, message.width) if message.height > 1 else None
    return Cloud(coordinates(used.reshape(-1).view(point)), shape)
