"""Poses of many things at once: rows of x, y, z and the quaternion w, x, y, z."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def rotated(turns: Floats, points: Floats) -> Floats:
    """Points (n, 3) turned by unit quaternions (n, 4)."""
    w, axis = turns[:, :1], turns[:, 1:]
    across = 2.0 * np.cross(axis, points)
    turned: Floats = points + w * across + np.cross(axis, across)
    return turned


def compose(outer: Floats, inner: Floats) -> Floats:
    """Poses (n, 7): `inner`, in the frame of `outer`, in the frame that that is in."""
    w, v = outer[:, 3:4], outer[:, 4:]
    iw, iv = inner[:, 3:4], inner[:, 4:]
    position = outer[:, :3] + rotated(outer[:, 3:], inner[:, :3])
    real = w * iw - np.sum(v * iv, axis=1, keepdims=True)
    return np.concatenate([position, real, w * iv + iw * v + np.cross(v, iv)], axis=1)


def approach(tool_pose: tuple[float, ...]) -> Floats:
    """The z axis (3,) of the tool."""
    turn = np.array(tool_pose[3:])[np.newaxis]
    return rotated(turn, np.array([[0.0, 0.0, 1.0]])).reshape(3)
