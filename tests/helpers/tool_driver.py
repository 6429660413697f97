"""Motion of a simulated arm's tool in tests, as the robot side commands it: from encoder readings, tick by tick."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from common.arrays import FloatArray
from robot_side.arm.port import ArmState, GripperPose
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.ground_truth import GroundTruth
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.scene import Scene, load_scene

PERIOD_S = 0.004
VALID_S = 0.05


@dataclass
class ToolDriver:
    """Simulated arm in its scene, which a test moves in virtual time `now_s`."""

    scene: Scene
    arm: MujocoArm
    kinematics: MujocoKinematics
    now_s: float = 100.0
    contacts: set[tuple[str, str]] = field(default_factory=set)
    """All contacts during `go_to` so far"""

    @staticmethod
    def load(model_path: Path | None = None, site: str | None = None, encoder: Encoder | None = None) -> "ToolDriver":
        scene = load_scene(model_path, site)
        driver = ToolDriver(scene, MujocoArm(scene, encoder or Encoder(seed=1)), MujocoKinematics(scene))
        driver.arm.state(driver.now_s)
        return driver

    def pose(self, state: ArmState) -> GripperPose:
        return self.kinematics.pose(state)

    def tool_m(self) -> FloatArray:
        """Return the tool's true position (3,)."""
        position: FloatArray = self.scene.data.site_xpos[self.scene.robot.site].copy()
        return position

    def wait(self, duration_s: float) -> ArmState:
        """Let time pass without commands."""
        self.now_s += duration_s
        return self.arm.state(self.now_s)

    def move(self, twist: FloatArray, duration_s: float) -> FloatArray:
        """Command `twist` (6,) for `duration_s`; return the tool's true positions, one row for each tick."""
        path = [self.tool_m()]
        for _ in range(round(duration_s / PERIOD_S)):
            self._command(self.pose(self.wait(PERIOD_S)), twist)
            path.append(self.tool_m())
        return np.array(path)

    def go_to(self, goal_m: FloatArray, duration_s: float) -> None:
        """Move the tool to `goal_m` without turning it."""
        truth = GroundTruth(self.scene)
        wanted = self.pose(self.arm.state(self.now_s)).tool_rotation
        for _ in range(round(duration_s / PERIOD_S)):
            pose = self.pose(self.wait(PERIOD_S))
            linear = np.clip(4.0 * (goal_m - pose.tool_position_m), -0.15, 0.15)
            error = wanted @ pose.tool_rotation.T
            angular = 2.0 * np.array([error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1]])
            self._command(pose, np.concatenate([linear, angular]))
            self.contacts |= truth.observe().contacts

    def grip(self, closing: float, duration_s: float) -> ArmState:
        """Close (+1) or open (-1) the gripper for `duration_s`; return the last state."""
        for _ in range(round(duration_s / PERIOD_S)):
            self.arm.command_gripper(closing, self.now_s + VALID_S)
            state = self.wait(PERIOD_S)
        return state

    def _command(self, pose: GripperPose, twist: FloatArray) -> None:
        limits = np.full(self.arm.joint_count, 2.0)
        self.arm.command(joint_velocities(pose.tool_jacobian, twist, limits), self.now_s + VALID_S)
