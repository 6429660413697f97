"""Recorded files become pictures of a depth camera."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.depth.picture import CameraPose, DepthPicture, Pinhole
from robot_side.depth.recorded.bags import bag_clouds
from robot_side.depth.recorded.cloud import Cloud, VirtualCamera, depth_of
from robot_side.depth.recorded.cloud_files import read_pcd, read_ply

_INTRINSICS: Final = ("fx", "fy", "cx", "cy")


class Recorded(NamedTuple):
    """Recorded picture, and where its camera stood."""

    picture: DepthPicture
    pose: CameraPose | None
    """In the recording's frame, which is the world's for a fixed camera; None if the file does not tell"""


def recorded_pictures(
    path: Path, taken_s: float = 0.0, camera: VirtualCamera | None = None, topic: str | None = None
) -> Iterator[Recorded]:
    """Yield the pictures of a file (.npz, .pcd, .ply), or of a ROS 2 bag's folder.

    taken_s: time of a cloud whose file has none. camera: sees clouds that are in no order. topic: of a bag's clouds.
    ConfigurationError names the file, and the field that is invalid.
    """
    camera = camera or VirtualCamera()
    match path.suffix.lower():
        case ".npz":
            yield _depth(path)
        case ".pcd":
            yield _seen(taken_s, read_pcd(path), camera)
        case ".ply":
            yield _seen(taken_s, read_ply(path), camera)
        case _ if path.is_dir():
            for stamp_s, cloud in bag_clouds(path, topic):
                yield _seen(stamp_s, cloud, camera)
        case _:
            raise ConfigurationError(f"{path}; valid: .npz, .pcd, .ply, or the folder of a ROS 2 bag")


def _seen(taken_s: float, cloud: Cloud, camera: VirtualCamera) -> Recorded:
    return Recorded(DepthPicture(taken_s, *depth_of(cloud, camera)), cloud.sensor)


def _depth(path: Path) -> Recorded:
    """Return the picture of an .npz: depth_m (h, w), fx, fy, cx, cy, taken_s, and perhaps position_m and rotation."""
    try:
        with np.load(path, allow_pickle=False) as found:
            held = {name: found[name] for name in found.files}
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path}: {error}; valid: an .npz file of NumPy") from error
    depth_m = _array(path, held, "depth_m", 2)
    numbers = [float(_array(path, held, name, 0)) for name in (*_INTRINSICS, "taken_s")]
    pose = None
    if "position_m" in held or "rotation" in held:
        position_m, rotation = _array(path, held, "position_m", 1), _array(path, held, "rotation", 2)
        turned = rotation.shape == (3, 3) and np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3)
        if position_m.shape != (3,) or not turned or np.linalg.det(rotation) < 0.0:
            raise ConfigurationError(f"{path}: position_m, rotation; valid: 3 numbers, and a rotation of 3 x 3")
        pose = CameraPose(position_m, rotation)
    measured = np.isfinite(depth_m) & (depth_m > 0.0)
    picture = DepthPicture(numbers[4], np.where(measured, depth_m, 0.0).astype(np.float32), Pinhole(*numbers[:4]))
    return Recorded(picture, pose)


def _array(path: Path, held: dict[str, FloatArray], name: str, dimensions: int) -> FloatArray:
    """Return the array `name`, which must have this number of dimensions."""
    if name not in held:
        raise ConfigurationError(f"{path}: {name} is missing; valid: depth_m, {', '.join(_INTRINSICS)}, taken_s")
    found = held[name]
    if found.ndim != dimensions or found.dtype.kind not in "fiu" or (dimensions < 2 and not np.isfinite(found).all()):
        text = f"finite numbers in {dimensions} dimensions"
        raise ConfigurationError(f"{path}: {name} has {found.dtype} in {found.ndim} dimensions; valid: {text}")
    return found.astype(np.float64)
