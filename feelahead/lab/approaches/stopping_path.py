"""Path of the true gripper until it stops, if the finger stays in a zone for a reaction and then releases."""

import math
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.reaction import HORIZON_S
from feelahead.lab.approaches.replay import Replay
from robot_side.arm.limits import ACCELERATION_RAD_S2
from robot_side.arm.resolved_rate import joint_velocities
from robot_side.drivers.mujoco.posed_scene import ToolPath

_STEP_S: Final = 0.005


def stopping_path(replay: Replay, time_s: float, speed_m_s: float, share: float = 1.0) -> tuple[FloatArray, ToolPath]:
    """Follow the gripper from `time_s`; return the times since then (k,) and its path.

    The path is the record until a command sent at `time_s` arrives. Then the arm moves towards `speed_m_s` along its
    approach axis for 0.3 s, and brakes. `share` of the sticks commanded at `time_s` continues from the arrival until
    the arm stops. The joints' acceleration bounds each change, in proportion to the remaining change.
    """
    record, arrives_s = replay.record, min(replay.record.arrives_s(time_s), replay.end_s)
    between = slice(record.pose_row(time_s) + 1, record.pose_row(arrives_s) + 1)
    last = replay.pose_at(arrives_s)
    poses = [replay.pose_at(time_s), *replay.true[between], last]
    jacobian = np.kron(np.eye(2), last.tool_rotation.T) @ last.tool_jacobian
    began, let_go = jacobian @ replay.joints_at(arrives_s)[1], share * replay.sticks_at(time_s)
    change = let_go + speed_m_s * np.eye(6)[2] - began
    changing_s = _changing_s(jacobian, change)
    reached = began + change * min(HORIZON_S / max(changing_s, _STEP_S), 1.0)
    rests_s = HORIZON_S + _changing_s(jacobian, let_go - reached)
    # The tool's twist in the middle of each step.
    since_s = _STEP_S * (np.arange(math.ceil(rests_s / _STEP_S)) + 0.5)
    knots_s = [0.0, min(changing_s, HORIZON_S), HORIZON_S, rests_s]
    columns = zip(began, reached, reached, let_go, strict=True)
    twists = np.stack([np.interp(since_s, knots_s, column) for column in columns], axis=1)
    steps_m = _STEP_S * (twists[:, :3] + 0.5 * _STEP_S * np.cross(twists[:, 3:], twists[:, :3]))
    rotations, positions_m = [pose.tool_rotation for pose in poses], [pose.tool_position_m for pose in poses]
    for turn, step_m in zip(Rotation.from_rotvec(_STEP_S * twists[:, 3:]).as_matrix(), steps_m, strict=True):
        positions_m.append(positions_m[-1] + rotations[-1] @ step_m)
        rotations.append(rotations[-1] @ turn)
    times_s = [time_s, *record.pose_time_s[between], arrives_s, *(arrives_s + since_s + 0.5 * _STEP_S)]
    return np.array(times_s) - time_s, ToolPath(np.array(positions_m), np.array(rotations))


def _changing_s(jacobian: FloatArray, change: FloatArray) -> float:
    """Return the time in seconds that the joints, all in proportion, need to change the tool's twist by `change`."""
    unlimited = np.full(jacobian.shape[1], np.inf)
    return float(np.abs(joint_velocities(jacobian, change, unlimited)).max()) / ACCELERATION_RAD_S2
