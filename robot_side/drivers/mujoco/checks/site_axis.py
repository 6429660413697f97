"""Check of a model's site against the gripper's shape."""

import mujoco  # type: ignore[import-untyped]
import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel
from robot_side.drivers.mujoco.robot_model import AXES, SiteAxis
from robot_side.drivers.mujoco.scene import Scene

_ALONG_DEG = 35.0
"""Largest angle between the approach and the fingers; a jaw that turns about a hinge stands askew."""
_SHORTEST_M = 0.02
_FARTHEST_M = 0.1
"""Largest distance of a usable site from the fingers."""


def site_findings(scene: Scene, axis: SiteAxis, travel: GripperTravel | None) -> list[str]:
    """Return a line for each reason why the site, approaching along its `axis`, does not suit the gripper."""
    model, robot = scene.model, scene.robot
    data = mujoco.MjData(model)
    data.qpos[:] = scene.data.qpos
    if travel is not None:
        # An open jaw on a hinge may point anywhere.
        data.qpos[robot.finger_positions] = travel.closed_fingers
    mujoco.mj_kinematics(model, data)
    geoms = robot.gripper_geoms[robot.geom_on_finger] if robot.geom_on_finger.any() else robot.gripper_geoms
    if geoms.size == 0:
        return []
    middles_m = data.geom_xpos[geoms] + np.einsum(
        "gij,gj->gi", data.geom_xmat[geoms].reshape(-1, 3, 3), model.geom_aabb[geoms, :3]
    )
    name = model.site(robot.site).name
    tool_m, tool = data.site_xpos[robot.site], data.site_xmat[robot.site].reshape(3, 3)
    found = _askew(axis, tool.T @ (middles_m.mean(axis=0) - data.xanchor[robot.arm_joints[-1]]))
    outside_m = np.linalg.norm(middles_m - tool_m, axis=1) - model.geom_rbound[geoms]
    if (apart_m := float(outside_m.min())) > _FARTHEST_M:
        found.append(
            f"the site {name!r} stands {1e3 * apart_m:.0f} mm away from the fingers; valid: between the fingertips"
        )
    return found


def _askew(axis: SiteAxis, fingers: FloatArray) -> list[str]:
    """Return a line if the way from wrist to fingers (3,), in the turned site's frame, is not along its z axis."""
    length_m = float(np.linalg.norm(fingers))
    if length_m < _SHORTEST_M:
        return []
    # In the model's own site frame, in which a person names an axis.
    own = Rotation.align_vectors([AXES[axis]], [AXES["z"]])[0].apply(fingers) / length_m
    angles_deg = {one: float(np.degrees(np.arccos(np.clip(own @ unit, -1.0, 1.0)))) for one, unit in AXES.items()}
    if angles_deg[axis] <= _ALONG_DEG:
        return []
    best = min(angles_deg, key=lambda one: angles_deg[one])
    fits = f"--site-axis {best} fits" if angles_deg[best] <= _ALONG_DEG else f"--site-axis {best} comes nearest"
    return [
        f"the site's {axis} axis, along which R2 advances, is {angles_deg[axis]:.0f}° off the direction of the fingers:"
        f" {fits} ({angles_deg[best]:.0f}° off)"
    ]
