"""Check of a model's joints: whether they follow a command, tried in empty space."""

from typing import Final

import numpy as np

from robot_side.arm.following import Following
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.model_enums import JointKind
from robot_side.drivers.mujoco.robot_model import joint_names
from robot_side.drivers.mujoco.scene import Scene

_TRIED_S: Final = 0.5
_TRIED_RAD_S: Final = 1.0
_TRIED_M_S: Final = 0.25
"""Duration of the try; greatest velocities of joints that turn, and of those that slide"""
_ROOM: Final = 0.5
"""Share of a joint's room, up to the end of its range, that it may cross"""


def following_findings(scene: Scene, arm: MujocoArm, limits: JointLimits) -> list[str]:
    """Return a line if joints do not follow a command; nothing may have moved before. It takes some 500 steps."""
    robot, model = scene.robot, scene.model
    slides = model.jnt_type[robot.arm_joints] == JointKind.SLIDE
    lower_rad, upper_rad = arm.ends_rad
    at_rad = scene.data.qpos[robot.arm_positions]
    up, down = upper_rad - at_rad, at_rad - lower_rad
    fastest = np.minimum(np.where(slides, _TRIED_M_S, _TRIED_RAD_S), _ROOM * np.maximum(up, down) / _TRIED_S)
    fastest = np.minimum(fastest, limits.velocity_rad_s)
    told = np.where(up >= down, fastest, -fastest)
    following = Following(limits, joint_names(scene)[0])
    nothing = np.empty(0)
    for step, positions_rad in enumerate(arm.rehearse(told, _TRIED_S)):
        state = ArmState(step * float(model.opt.timestep), positions_rad, told, nothing, 0.0, gripper_holding=False)
        following.update(told, state, 0.0, lambda _: False)
    if following.text is None:
        return []
    return [f"tried in empty space, at up to {_TRIED_RAD_S:.0f} rad/s: {following.text}"]
