"""Places of points and objects in a camera view, from the scene and the robot side's viewpoint."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.protocol.view_messages import Eye, Shape

Floats = NDArray[np.float64]
Box = tuple[float, float, float, float]
"""Left, lower, right and upper edge, in half heights of the picture from its centre; right and up are positive"""
SIGNS: Final = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
"""(8, 3) corners of a box with half sizes of 1"""
_NEAREST_M: Final = 0.005
"""Least distance before the eye; a corner behind it has no place in the picture"""


def corners_m(shape: Shape) -> Floats:
    """Return the corners (8, 3) of a box around a shape, in its owner's frame."""
    x, y, z = shape.size_m
    low, high = np.zeros(3), np.zeros(3)
    if shape.kind == "mesh":
        vertices = np.frombuffer(shape.vertices_m, np.float32).reshape(-1, 3)
        low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    else:
        half = {"sphere": (x, x, x), "cylinder": (x, x, y), "capsule": (x, x, x + y)}.get(shape.kind, (x, y, z))
        low, high = -np.array(half), np.array(half)
    box = 0.5 * (low + high) + 0.5 * SIGNS * (high - low)
    return moved(np.array(shape.pose), box)


def seen(points: Floats, eye_frame: Floats, eye: Eye) -> Floats | None:
    """Return where the eye sees points (n, 3) of the world frame; None if one of them is behind the eye.

    The result is (n, 2), right and above the picture's centre, in half heights. eye_frame: pose (7,) of the frame in
    which `eye` is given, position and quaternion, w first.
    """
    from_eye = (points - eye_frame[:3]) @ rotation(eye_frame) - np.array(eye.position_m)
    forward, up = np.array(eye.forward), np.array(eye.up)
    depth_m = from_eye @ forward
    if depth_m.min() < _NEAREST_M:
        return None
    axes = np.column_stack((np.cross(forward, up), up))
    place: Floats = (from_eye @ axes) / (depth_m * np.tan(np.radians(0.5 * eye.fovy_deg)))[:, None]
    return place * (eye.stretch, 1.0) + eye.middle


def outline(corners: Floats, eye_frame: Floats, eye: Eye) -> Box | None:
    """Return the box around corners (n, 3) of the world frame as the eye sees them; None if one is behind the eye."""
    if (places := seen(corners, eye_frame, eye)) is None:
        return None
    (left, low), (right, high) = places.min(axis=0), places.max(axis=0)
    return float(left), float(low), float(right), float(high)


def moved(pose: Floats, points: Floats) -> Floats:
    """Return points (n, 3), given in the frame whose pose (7,) in the world frame is `pose`, in the world frame."""
    placed: Floats = points @ rotation(pose).T + pose[:3]
    return placed


def rotation(pose: Floats) -> Floats:
    """Return the rotation matrix (3, 3) of a pose (7,): position, then unit quaternion, w first.

    viser's `SO3.apply` does the same in 25 times the time.
    """
    w, x, y, z = pose[3:].tolist()
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )
