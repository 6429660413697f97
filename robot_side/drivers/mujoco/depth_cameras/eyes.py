"""Where simulated depth cameras are: on the gripper, or beside and above it."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from robot_side.drivers.mujoco.depth_cameras.posed_robot import WORLD
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.viewpoints import first_person_eye
from robot_side.surroundings.mount import Mount

WRIST: Final = "wrist"
FIXED: Final = "fixed"
_ASIDE_M: Final = np.array((-0.1, 0.35, 0.5))
"""Place of the fixed camera from the tool at its start: ahead, to the left, and up"""
_LOOKS_AHEAD_M: Final = 0.2
_FOVY_DEG: Final = {WRIST: 70.0, FIXED: 58.0}
_TURN_RAD_PER_M: Final = math.radians(0.1) / 1e-3
"""Turn of a wrong mount, by its displacement: 0.2 degrees for 2 mm"""


@dataclass(frozen=True)
class Eye:
    """Camera on a link."""

    name: str
    link: str
    mount: Mount
    fovy_deg: float


def simulated_eyes(scene: Scene, which: str) -> list[Eye]:
    """Return the cameras of the setting `which`, for a scene at its start: on the gripper, or beside and above it."""
    site, data = scene.robot.site, scene.data
    tool_m, tool = data.site_xpos[site].copy(), data.site_xmat[site].reshape(3, 3).copy()
    eyes = []
    if which in (FIXED, "both"):
        ahead = tool[:, 2] if abs(tool[2, 2]) < 0.7 else np.array([1.0, 0.0, 0.0])
        ahead = np.array([ahead[0], ahead[1], 0.0]) / math.hypot(ahead[0], ahead[1])
        up = np.array([0.0, 0.0, 1.0])
        place_m = tool_m + np.stack([ahead, np.cross(up, ahead), up], axis=1) @ _ASIDE_M
        forward = tool_m + _LOOKS_AHEAD_M * tool[:, 2] - place_m
        eyes.append(_eye(FIXED, WORLD, place_m, forward / np.linalg.norm(forward), up))
    if which in (WRIST, "both"):
        # The tool's own frame carries the camera; its link is the site's body.
        eye, body = first_person_eye(scene), int(scene.model.site_bodyid[site])
        link_m, link = data.xpos[body], data.xmat[body].reshape(3, 3)
        place_m = link.T @ (tool_m + tool @ np.array(eye.position_m) - link_m)
        forward, up = (link.T @ tool @ np.array(way) for way in (eye.forward, eye.up))
        eyes.append(_eye(WRIST, scene.model.body(body).name, place_m, forward, up))
    return eyes


def _eye(name: str, link: str, place_m: FloatArray, forward: FloatArray, up: FloatArray) -> Eye:
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward], axis=1)
    w, x, y, z = Rotation.from_matrix(axes).as_quat(scalar_first=True).tolist()
    at_x, at_y, at_z = place_m.tolist()
    return Eye(name, link, Mount((at_x, at_y, at_z), (w, x, y, z)), _FOVY_DEG[name])


def misplaced(mount: Mount, error_m: float, generator: np.random.Generator) -> Mount:
    """Return the mount moved by `error_m` in a drawn direction, and turned by 0.1 degrees for each millimetre."""
    if error_m == 0.0:
        return mount
    ways = generator.standard_normal((2, 3))
    ways *= error_m / np.linalg.norm(ways, axis=1, keepdims=True)
    turned = Rotation.from_quat(mount.quaternion, scalar_first=True) * Rotation.from_rotvec(_TURN_RAD_PER_M * ways[1])
    w, x, y, z = turned.as_quat(scalar_first=True).tolist()
    at_x, at_y, at_z = (np.array(mount.position_m) + ways[0]).tolist()
    return Mount((at_x, at_y, at_z), (w, x, y, z))
