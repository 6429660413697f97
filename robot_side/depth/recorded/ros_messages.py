"""Depth in messages of ROS 2: Image with its CameraInfo, and PointCloud2, of whatever package reads them.

Each function raises ConfigurationError, which names the field that is invalid.
"""

from typing import Any, Final

import numpy as np

from common.errors import ConfigurationError
from robot_side.depth.picture import DepthArray, Pinhole
from robot_side.depth.recorded.cloud import COORDINATES, Cloud, coordinates

_POINT_TYPES: Final = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""NumPy's types by PointField's numbers"""
_ENCODINGS: Final = {"16UC1": ("u2", 0.001), "32FC1": ("f4", 1.0)}
"""NumPy's type and the unit in m of a pixel"""
_STRAIGHT: Final = 1e-3
"""Largest coefficient of distortion that counts as none: it moves a corner's pixel by a fraction of one"""


def depth_of_image(image: Any) -> DepthArray:
    """Return the depth (h, w) in m of an Image; 0 where nothing was measured."""
    if image.encoding not in _ENCODINGS:
        raise ConfigurationError(f"encoding = {image.encoding}; valid: {', '.join(_ENCODINGS)}")
    (kind, unit_m), data = _ENCODINGS[image.encoding], np.frombuffer(image.data, np.uint8)
    dtype = np.dtype((">" if image.is_bigendian else "<") + kind)
    used = image.width * dtype.itemsize
    if image.step < used or data.size != image.height * image.step:
        valid = f"valid: {image.height} rows of {used} bytes or more"
        raise ConfigurationError(f"step = {image.step}, {data.size} bytes of data; {valid}")
    # A row may end with padding.
    rows = np.ascontiguousarray(data.reshape(image.height, image.step)[:, :used]).view(dtype)
    measured = np.isfinite(rows) & (rows > 0)
    return np.where(measured, rows, 0).astype(np.float32) * np.float32(unit_m)


def pinhole_of(info: Any, image: Any, rectified: bool = False) -> Pinhole:
    """Return the intrinsics of an Image by its CameraInfo.

    rectified: the image has no distortion, whatever D says. P counts then, and K does not.
    """
    if (info.width, info.height) != (image.width, image.height):
        raise ConfigurationError(
            f"CameraInfo: width, height = {info.width}, {info.height}; valid: the image's {image.width}, {image.height}"
        )
    bends = info.distortion_model == "equidistant" or not all(abs(one) <= _STRAIGHT for one in info.d)
    if bends and not rectified:
        said = f"{info.distortion_model}, d = {[round(float(one), 4) for one in info.d]}"
        raise ConfigurationError(f"CameraInfo: {said}; valid: d up to {_STRAIGHT}, or a rectified image, said to be so")
    matrix = np.reshape(info.p, (3, 4)) if rectified else np.reshape(info.k, (3, 3))
    # ROS counts from the centre of the upper left pixel.
    return Pinhole(*map(float, (matrix[0, 0], matrix[1, 1], matrix[0, 2] + 0.5, matrix[1, 2] + 0.5)))


def cloud_of(message: Any, where: str) -> Cloud:
    """Return the cloud of a PointCloud2. where: what an error's text begins with."""
    fields = {one.name: one for one in message.fields}
    order = ">" if message.is_bigendian else "<"
    try:
        formats = [order + _POINT_TYPES[fields[name].datatype] for name in COORDINATES]
        offsets = [fields[name].offset for name in COORDINATES]
        end = max(offset + np.dtype(one).itemsize for offset, one in zip(offsets, formats, strict=True))
        # NumPy's own check of offsets overflows.
        if end > message.point_step or message.width * message.point_step > message.row_step:
            sizes = f"{message.width} points of {message.point_step} bytes in rows of {message.row_step}"
            raise ValueError(f"x, y and z end at byte {end}, {sizes}")
        point = np.dtype({"names": COORDINATES, "formats": formats, "offsets": offsets, "itemsize": message.point_step})
        rows = np.asarray(message.data).reshape(message.height, message.row_step)
    except (KeyError, ValueError) as error:
        raise ConfigurationError(f"{where}: fields, point_step or row_step: {error}; valid: x, y, z") from error
    # A row may end with padding.
    used = np.ascontiguousarray(rows[:, : message.width * message.point_step])
    shape = (message.height, message.width) if message.height > 1 else None
    return Cloud(coordinates(used.reshape(-1).view(point)), shape)
