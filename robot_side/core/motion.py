"""Motion of the arm by the operator's commands."""

from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.bounds import Bounds
from robot_side.arm.commanded import commanded
from robot_side.arm.following import Following
from robot_side.arm.hindrance import Hindrance
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import Arm, ArmState, GripperPose
from robot_side.arm.speed_assist import assisted
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.gripper.grip import Grip
from robot_side.operators.safety import Permission
from robot_side.tick.sensed import Sensed

_CUT: Final = "too many things overlap at the gripper to be looked at: the triggers are stiff"


class Motion:
    """Commander of the arm, which keeps the last command."""

    def __init__(
        self,
        arm: Arm,
        limits: JointLimits,
        settings: ToolMotionSettings,
        following: Following | None = None,
        *,
        assists: bool = False,
        bounds: Bounds | None = None,
    ) -> None:
        """following: judge of the arm's motion; a new one by default. assists: limit the speed along the triggers.

        bounds: of the tool's motion.
        """
        self.commanded_rad_s: FloatArray | None = None
        """(n,) commanded joint velocities; None: the arm is to stand still"""
        self.commanded_m_s = self.rises_m_s = 0.0
        """Commanded speeds of the tool: in the direction in which R2 advances; and upwards (0 if nothing is held)"""
        self.hindrance = Hindrance()
        self.following = following or Following(limits)
        self._arm, self._limits, self._settings, self._assists = arm, limits, settings, assists
        self._bounds = bounds
        self._still: FloatArray = np.zeros(arm.joint_count)

    def command(
        self,
        permission: Permission,
        pose: GripperPose,
        state: ArmState,
        grip: Grip,
        sensed: Sensed | None,
        now_s: float,
        homeward: FloatArray | str | None = None,
    ) -> None:
        """Command the arm; stop it if there is no permission.

        sensed: the law's result in the tick before. homeward: result of `Homing.velocity`, instead of the command.
        """
        command = permission.command
        if command is None or grip.touchdown.gives_way:
            self.commanded_rad_s, self.commanded_m_s, self.rises_m_s = None, 0.0, 0.0
            if command is None:
                self.hindrance.end(self.following.text)
            # Valid until the state's time: expiry between two physics steps would let a load sink, each time.
            self._arm.command(self._still, state.time_s)
            self._arm.command_gripper(0.0, now_s)
            return
        if self._assists and sensed is not None:
            command = assisted(command, sensed.l2, sensed.r2, self._limits.response_s)
        if homeward is None:
            where = pose, state.joint_positions_rad, self._limits, self._settings
            motion = commanded(command, *where, stands=grip.touchdown.stands, bounds=self._bounds)
            velocity, self.commanded_m_s = motion.velocity_rad_s, motion.commanded_m_s
            self.hindrance.update(motion.undone, motion.cause, motion.joint)
        elif isinstance(homeward, str):
            velocity, self.commanded_m_s = self._still, 0.0
            self.hindrance.refuse(homeward)
        else:
            velocity = homeward
            if self._bounds is not None:
                linear_m_s = pose.tool_jacobian[:3] @ homeward
                velocity = self._bounds.share(linear_m_s, pose.tool_position_m, self._limits) * homeward
            self.commanded_m_s = float(pose.tool_rotation[:, 2] @ pose.tool_jacobian[:3] @ velocity)
            self.hindrance.end()
        if self.following.text is not None:
            self.hindrance.find(self.following.text)
        if sensed is not None and sensed.cut:
            self.hindrance.find(_CUT)
        self.commanded_rad_s = velocity
        self.rises_m_s = 0.0 if grip.held is None else float(pose.tool_jacobian[2] @ velocity)
        self._arm.command(velocity, permission.valid_until_s)
        self._arm.command_gripper(command.gripper, permission.valid_until_s)
