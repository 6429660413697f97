"""A recorded approach as both sides knew it: true motion, estimated poses, and where a release would stop the arm."""

import math
from functools import cached_property

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import Header, MotionCommand
from feelahead.lab.approaches.recording import POSE_S, TICK_S, RecordedApproach
from operator_side.controller.feel import SENSED_TRAVEL
from operator_side.dualsense.simulated.trigger_model import FINGER_TIME_CONSTANT_S
from operator_side.feel.commands_under_way import CommandsUnderWay
from operator_side.hands.travel_calibration import TriggerTravel
from robot_side.arm.joint_estimate import JointEstimate
from robot_side.arm.limits import ACCELERATION_RAD_S2
from robot_side.arm.port import ArmState, GripperPose
from robot_side.arm.tool_motion import ToolMotionSettings, tool_motion
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.scene import Scene
from robot_side.settings import EncoderSettings

_WHOLE_S = 1000.0
"""Time for which commands are remembered, in seconds: longer than any record."""
_ASKED_M_S = 0.05
_STALLED_ROWS = 25
"""Number of rows, 0.25 s, below half of the commanded speed after which the arm is at its limits."""
_TRAVEL = TriggerTravel()
_LONGEST_RETURN = 4.0
"""Upper bound on the time of the finger's return, in its time constants; from full travel to the dead zone takes 3."""
_COASTING_STEPS = 100


class Replay:
    """One recorded approach with newly drawn errors of the encoders, on the record's virtual clock."""

    def __init__(self, record: RecordedApproach, scene: Scene, encoder: EncoderSettings, seed: int) -> None:
        """scene: any scene with the recorded arm, which gives its kinematics. seed: draws the encoders' errors."""
        self.record = record
        self.encoder = encoder
        self._kinematics = MujocoKinematics(scene)
        self._seed = seed
        self.motion = ToolMotionSettings()
        true = [self._pose(row, record.joint_positions_rad[row]) for row in range(len(record.pose_time_s))]
        axis = true[record.pose_row(record.began_s)].tool_rotation[:, 2]
        start_m = true[record.pose_row(record.began_s)].tool_position_m
        self.axis = axis
        """(3,) approach axis when the pull begins, in the world frame"""
        self.moved_m: FloatArray = np.array([pose.tool_position_m - start_m for pose in true])
        """(k, 3) displacement of the true tool since the pull began, in the world frame"""
        self.along_m: FloatArray = self.moved_m @ axis
        """(k,) that displacement along `axis`"""
        self.approach_speed_m_s: FloatArray = np.array(
            [
                pose.tool_rotation[:, 2] @ (pose.tool_jacobian[:3] @ record.joint_velocities_rad_s[row])
                for row, pose in enumerate(true)
            ]
        )
        """(k,) û·v of the true tool"""
        self.true = true
        """True gripper, for each row of the poses"""
        self.end_s = self._end_s()
        """Time at which the record ends, or at which the arm comes to the edge of its reach"""

    @property
    def joints(self) -> int:
        """Number of the arm's joints."""
        return len(self.record.joint_positions_rad[0])

    @cached_property
    def commands(self) -> CommandsUnderWay:
        """All commands of the record, as the operator side remembers them."""
        commands = CommandsUnderWay(window_s=_WHOLE_S)
        sticks = np.hstack([self.record.lateral, self.record.turning]).tolist()
        for time_s, travel, stick in zip(self.record.command_time_s, self.record.command, sticks, strict=True):
            commands.sent(float(time_s), float(travel), tuple(stick))
        return commands

    @cached_property
    def encoder_sigma_rad(self) -> FloatArray:
        """(n,) standard deviations of the encoder errors that the robot side assumes (eq. 3)"""
        encoder = Encoder(self.encoder.sigma_rad, self.encoder.resolution_rad)
        return np.full(self.record.joint_positions_rad.shape[1], encoder.standard_deviation_rad())

    @cached_property
    def estimated(self) -> list[GripperPose]:
        """Gripper for each row of the poses, as estimated from noisy encoders that are read in every tick."""
        encoder = Encoder(self.encoder.sigma_rad, self.encoder.resolution_rad, self._seed)
        estimate, found = JointEstimate(), []
        for row, until_s in enumerate(self.record.pose_time_s.tolist()):
            for time_s in until_s - TICK_S * np.arange(round(POSE_S / TICK_S))[::-1]:
                joints_rad, velocities_rad_s = self.joints_at(float(time_s))
                state = self._state(row, float(time_s), encoder.read(joints_rad), velocities_rad_s)
                estimated = estimate.update(state)
            found.append(self._kinematics.pose(estimated))
        return found

    def _pose(self, row: int, joints_rad: FloatArray) -> GripperPose:
        record = self.record
        time_s = float(record.pose_time_s[row])
        return self._kinematics.pose(self._state(row, time_s, joints_rad, record.joint_velocities_rad_s[row]))

    def _state(self, row: int, time_s: float, joints_rad: FloatArray, velocities_rad_s: FloatArray) -> ArmState:
        return ArmState(
            time_s=time_s,
            joint_positions_rad=joints_rad,
            joint_velocities_rad_s=velocities_rad_s,
            finger_positions=self.record.finger_positions[row],
            gripper_opening_m=0.0,
            gripper_holding=False,
        )

    def joints_at(self, time_s: float) -> tuple[FloatArray, FloatArray]:
        """Return the true joint positions and velocities (n,) at `time_s`, interpolated."""
        record = self.record
        row = min(record.pose_row(time_s), len(record.pose_time_s) - 2)
        step_s = record.pose_time_s[row + 1] - record.pose_time_s[row]
        part = min(max((time_s - record.pose_time_s[row]) / step_s, 0.0), 1.0)
        positions, velocities = record.joint_positions_rad, record.joint_velocities_rad_s
        return (
            (1.0 - part) * positions[row] + part * positions[row + 1],
            (1.0 - part) * velocities[row] + part * velocities[row + 1],
        )

    def stopped_joints(self, released_s: float) -> tuple[float, float, FloatArray] | None:
        """Compute how the arm stops after a release of the trigger at `released_s`, at the operator side.

        Return the time at which the release reaches the arm, the time at which the arm is at rest, and its joint
        positions (n,) then. None if the record ends before. All joints slow down in proportion (`JointReference`).
        """
        arrives_s = self.record.arrives_s(released_s)
        if arrives_s > self.end_s:
            return None
        joints_rad, velocities_rad_s = self.joints_at(arrives_s)
        braking_s = float(np.abs(velocities_rad_s).max()) / ACCELERATION_RAD_S2
        travel = float(self.record.travel[self.record.tick_row(released_s), 1])
        rests_s = arrives_s + FINGER_TIME_CONSTANT_S + braking_s
        return arrives_s, rests_s, joints_rad + velocities_rad_s * coasting_s(braking_s, travel)

    def pose_at(self, time_s: float) -> GripperPose:
        """Return the true gripper at `time_s`."""
        joints_rad, velocities_rad_s = self.joints_at(time_s)
        return self._kinematics.pose(self._state(self.record.pose_row(time_s), time_s, joints_rad, velocities_rad_s))

    def sticks_at(self, time_s: float) -> FloatArray:
        """Return the twist (6,) that the newest command's sticks ask for, in the tool frame, linear part first."""
        record = self.record
        row = max(int(np.searchsorted(record.command_time_s, time_s + 1e-9)) - 1, 0)
        lateral, turning = ((float(stick[row][0]), float(stick[row][1])) for stick in (record.lateral, record.turning))
        command = MotionCommand(Header(epoch=1, sequence=row, sent_s=0.0), 0.0, 0.0, lateral, turning)
        return np.concatenate(tool_motion(command, self.motion))

    def moves_sticks(self, from_s: float, until_s: float) -> bool:
        """Return whether the commanded sticks change between `from_s` and `until_s`."""
        record = self.record
        first, last = (max(int(np.searchsorted(record.command_time_s, at + 1e-9)) - 1, 0) for at in (from_s, until_s))
        sticks = np.hstack([record.lateral, record.turning])[first : last + 1]
        return bool((sticks != sticks[0]).any())

    def _end_s(self) -> float:
        record = self.record
        ticks = [record.tick_row(time_s) for time_s in record.pose_time_s]
        sent_s = np.nan_to_num(record.applied_sent_s[ticks], nan=-np.inf)
        rows = np.searchsorted(record.command_time_s, sent_s + 1e-9) - 1
        asked = self.motion.trigger_speed_m_s * np.where(rows >= 0, record.command[rows], 0.0)
        behind = (asked > _ASKED_M_S) & (self.approach_speed_m_s < 0.5 * asked)
        lasting = 0
        for row, stalled in enumerate(behind):
            lasting = lasting + 1 if stalled else 0
            if lasting > _STALLED_ROWS:
                return float(record.pose_time_s[row - lasting + 1])
        return float(record.pose_time_s[-1])


def coasting_s(braking_s: float, travel: float, finger_s: float = FINGER_TIME_CONSTANT_S) -> float:
    """Compute for how long, at its present speed, an arm coasts after a release at travel 0 to 1.

    The mechanical travel falls as exp(-t / finger_s), and the command ends with the dead zone. The arm's relative speed
    falls by at most 1 / braking_s per second. The greater of the two relative speeds counts.
    """
    times = np.linspace(0.0, max(braking_s, _LONGEST_RETURN * finger_s), _COASTING_STEPS)
    commanded = np.array([_TRAVEL.travel(min(travel * math.exp(-t / finger_s) / SENSED_TRAVEL, 1.0)) for t in times])
    speeds = commanded / max(commanded[0], 1e-9)
    if braking_s > 1e-6:
        speeds = np.maximum(speeds, 1.0 - times / braking_s)
    return float(np.trapezoid(speeds, times))
