"""Checks of a model's target: that there is one, and that the tool reaches it and the places to which it is carried."""

import math
from typing import Final

import numpy as np

from common.roles import Role
from robot_side.drivers.mujoco.brought.reach import NEAR_M, go, grasp_places
from robot_side.drivers.mujoco.scene import Scene

_PLACES: Final = (
    "where it comes into line with the tool",
    "it",
    *("where it is lifted to",) * 2,
    "where it is put down",
)
_TURNED_DEG: Final = 20.0


def target_findings(scene: Scene) -> list[str]:
    """Return a line if no object is a target."""
    if Role.TARGET in scene.roles.values():
        return []
    return [
        "no object is a target, so there is nothing to advance to; to name one: let its name begin with target, or"
        ' [roles] NAME = "target" in the --config file (feelahead demo: --robot-config)'
    ]


def reach_findings(scene: Scene) -> list[str]:
    """Return a line if the tool cannot go from its start to the first target, lift it, and put it down farther back."""
    model, data, robot = scene.model, scene.data, scene.robot
    targets = [thing for thing in scene.objects if scene.roles[thing.name] is Role.TARGET]
    if not targets:
        return []
    name, target_m = targets[0].name, data.geom_xpos[list(targets[0].geoms)].mean(axis=0)
    tool_m, approach = data.site_xpos[robot.site], data.site_xmat[robot.site].reshape(3, 3)[:, 2]
    gone = go(model, robot, data.qpos, grasp_places(tool_m, approach, target_m))
    ends = [model.joint(int(robot.arm_joints[joint])).name or f"joint{joint}" for joint in gone.at_end]
    because = f", with {', '.join(ends)} at an end of the range" if ends else ""
    if gone.left_m > NEAR_M:
        return [
            f"{name!r} is out of reach from the start: the tool stays {1e3 * gone.left_m:.0f} mm away from"
            f" {_PLACES[gone.place]}{because} (to choose another start: a keyframe named 'home')"
        ]
    turned_deg = math.degrees(gone.turned_rad)
    if turned_deg > _TURNED_DEG:
        count = np.size(robot.arm_joints)
        return [f"on the way to {name!r} the tool turns by {turned_deg:.0f}°{because}: the arm has {count} joints"]
    return []
