"""Viewpoints of the two views of §4.3: cameras of the model, or else poses that exist for every arm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec
import numpy as np

from common.arrays import FloatArray
from common.protocol.view_messages import Eye, ViewName
from robot_side.arm.stick_frames import Frame, StickFrames

if TYPE_CHECKING:
    # A rendering process uses `Viewpoint` alone, and loads no scene.
    from robot_side.drivers.mujoco.scene import Scene

Triple = tuple[float, float, float]

_OVERVIEW = "overview"
_SHORTEST_REACH_M = 0.3
_LEAST_ALONG = 0.5
"""Cosine of the largest angle, 60°, between the approach axis and the line of sight of a camera that shows it"""
_CLEARANCE_M = 0.05
_WIDE_DEG = 70.0


class Viewpoint(msgspec.Struct, frozen=True):
    """Viewpoint of a view: a camera of the model; without one, a pose in the frame of a body."""

    camera: int | None = None
    body: int = 0
    position_m: Triple = (0.0, 0.0, 0.0)
    forward: Triple = (1.0, 0.0, 0.0)
    """Unit vector"""
    up: Triple = (0.0, 0.0, 1.0)
    """Unit vector, orthogonal to `forward`"""
    fovy_deg: float = 45.0
    """Vertical field of view: angle from the picture's lower edge to its upper edge"""


def viewpoints(scene: Scene) -> dict[ViewName, Viewpoint]:
    """Return the viewpoints of both views, for a scene at its start."""
    return {"overview": _overview(scene), "first_person": _first_person(scene)}


def first_person_eye(scene: Scene) -> Eye:
    """Return the first-person viewpoint in the tool frame, for a scene at its start."""
    tool_m, tool = scene.data.site_xpos[scene.robot.site], scene.data.site_xmat[scene.robot.site].reshape(3, 3)
    return _eye(scene, _first_person(scene), tool_m, tool)


def overview_eye(scene: Scene) -> Eye | None:
    """Return the overview's viewpoint in the world frame, for a scene at its start; None for a camera that moves."""
    view, model = _overview(scene), scene.model
    if view.camera is not None and model.body_weldid[model.cam_bodyid[view.camera]] != 0:
        return None
    return _eye(scene, view, np.zeros(3), np.eye(3))


def _eye(scene: Scene, view: Viewpoint, frame_m: FloatArray, frame: FloatArray) -> Eye:
    """Return a viewpoint in a frame: its origin (3,) and its axes as columns (3, 3), in the world frame."""
    model, data = scene.model, scene.data
    if view.camera is not None:
        # A camera looks along its own -z, with y upwards.
        axes, place_m = data.cam_xmat[view.camera].reshape(3, 3), data.cam_xpos[view.camera]
        forward, up, fovy_deg = -axes[:, 2], axes[:, 1], float(model.cam_fovy[view.camera])
    else:
        axes, fovy_deg = data.xmat[view.body].reshape(3, 3), view.fovy_deg
        place_m = data.xpos[view.body] + axes @ view.position_m
        forward, up = axes @ view.forward, axes @ view.up
    return Eye(_triple(frame.T @ (place_m - frame_m)), _triple(frame.T @ forward), _triple(frame.T @ up), fovy_deg)


def stick_frames(scene: Scene) -> StickFrames:
    """Return the frames in which an operator may steer, for a scene at its start."""
    yaw, view, data, sky = _yaw_rad(scene), _overview(scene), scene.data, np.array([0.0, 0.0, 1.0])
    ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    if view.camera is not None:
        # A camera looks along its own -z, with y upwards.
        axes = data.cam_xmat[view.camera].reshape(3, 3)
        camera = Frame(axes[:, 0].copy(), axes[:, 1].copy(), -axes[:, 2])
    else:
        forward, up = np.array(view.forward), np.array(view.up)
        camera = Frame(np.cross(forward, up), up, forward)
    return StickFrames(Frame(np.cross(ahead, sky), sky, ahead), camera)


def _reach_m(scene: Scene) -> float:
    data, robot = scene.data, scene.robot
    return max(float(np.linalg.norm(data.site_xpos[robot.site] - data.xpos[robot.root_body])), _SHORTEST_REACH_M)


def _yaw_rad(scene: Scene) -> float:
    """Return the direction in which the tool stands as seen from the base; 0 if it stands above the base."""
    ahead = (scene.data.site_xpos[scene.robot.site] - scene.data.xpos[scene.robot.root_body])[:2]
    return float(np.arctan2(ahead[1], ahead[0])) if np.linalg.norm(ahead) > 0.05 * _reach_m(scene) else 0.0


def _overview(scene: Scene) -> Viewpoint:
    """Return the model's camera of that name, else a viewpoint that looks straight down, with ahead up (§4.3)."""
    model, data, robot = scene.model, scene.data, scene.robot
    for camera in range(model.ncam):
        if model.camera(camera).name.rpartition("/")[2] == _OVERVIEW:
            return Viewpoint(camera=camera)
    base_m, tool_m = data.xpos[robot.root_body], data.site_xpos[robot.site]
    reach_m, yaw = _reach_m(scene), _yaw_rad(scene)
    ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    looked_at_m = np.array([*tool_m[:2], 0.5 * (base_m[2] + tool_m[2])]) + 0.1 * reach_m * ahead
    position_m = looked_at_m + np.array((0.0, 0.0, 2.3 * reach_m))
    return Viewpoint(position_m=_triple(position_m), forward=(0.0, 0.0, -1.0), up=_triple(ahead))


def _first_person(scene: Scene) -> Viewpoint:
    """Return the gripper's camera, else a viewpoint behind and beside the palm that closing fingers do not hide."""
    model, data, robot = scene.model, scene.data, scene.robot
    tool_m, tool = data.site_xpos[robot.site], data.site_xmat[robot.site].reshape(3, 3)
    carriers = {int(model.site_bodyid[robot.site]), *model.geom_bodyid[robot.gripper_geoms].tolist()}
    for camera in range(model.ncam):
        # A camera looks along its own -z.
        looks_ahead = -data.cam_xmat[camera].reshape(3, 3)[:, 2] @ tool[:, 2] > _LEAST_ALONG
        if looks_ahead and int(model.cam_bodyid[camera]) in carriers:
            return Viewpoint(camera=camera)
    low_m, high_m = _extent(scene, tool_m, tool)
    # On the gripper's thin side: fingers close along the wide one.
    axis = int(np.argmin((high_m - low_m)[:2]))
    side = 1.0 if tool[2, axis] >= 0.0 else -1.0
    aside_m = max(abs(high_m[axis] if side > 0.0 else low_m[axis]), 0.02) + _CLEARANCE_M
    up = np.zeros(3)
    up[axis] = side
    length_m = max(float(-low_m[2]), 0.05)
    place_m = aside_m * up - np.array([0.0, 0.0, 1.6 * length_m])
    # Towards a point as far ahead as the palm is behind, so that fingers and objects ahead are both visible.
    forward = np.array([0.0, 0.0, length_m]) - place_m
    forward /= np.linalg.norm(forward)
    up -= (up @ forward) * forward
    up /= np.linalg.norm(up)
    body = int(model.site_bodyid[robot.site])
    rotation = data.xmat[body].reshape(3, 3)
    return Viewpoint(
        body=body,
        position_m=_triple(rotation.T @ (tool_m + tool @ place_m - data.xpos[body])),
        forward=_triple(rotation.T @ tool @ forward),
        up=_triple(rotation.T @ tool @ up),
        fovy_deg=_WIDE_DEG,
    )


def _extent(scene: Scene, tool_m: FloatArray, tool: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest corner (3,) of a box around the gripper's geoms, in the tool frame."""
    model, data, geoms = scene.model, scene.data, scene.robot.gripper_geoms
    if geoms.size == 0:
        return np.full(3, -0.05), np.full(3, 0.05)
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    corners = model.geom_aabb[geoms, None, :3] + signs * model.geom_aabb[geoms, None, 3:]
    in_world = data.geom_xpos[geoms, None] + np.einsum("gij,gcj->gci", data.geom_xmat[geoms].reshape(-1, 3, 3), corners)
    seen = ((in_world - tool_m) @ tool).reshape(-1, 3)
    return seen.min(axis=0), seen.max(axis=0)


def _triple(values: FloatArray) -> Triple:
    x, y, z = values.tolist()
    return (x, y, z)
