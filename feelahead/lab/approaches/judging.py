"""Judge whether full strength came in time, and which strengths are false alarms."""

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from scipy.special import ndtri

from common.arrays import FloatArray
from common.reaction import REACTION_S
from feelahead.lab.approaches.placements import shifted
from feelahead.lab.approaches.stopping_path import stopping_path
from feelahead.lab.approaches.strengths import Draw, Judged
from operator_side.controller.feel import SENSED_TRAVEL, ZONE_COUNT
from operator_side.dualsense.simulated.trigger_model import zone_of
from operator_side.hands.travel_calibration import TriggerTravel
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.drivers.mujoco.posed_scene import PosedScene, ToolPath
from robot_side.enlargement.kinematic_error import directional_variance, position_covariance

ALARM_STRENGTH: Final = 4
CLEAR_M: Final = 0.015
"""Distance in metres, beyond D_σ, that a path must keep from all objects for a strength to be a false alarm."""
ALARM_STEP_S: Final = 0.02
_R2 = 1
_TRAVEL = TriggerTravel()


def strength_before_release(law: Judged, draw: Draw, last_release_s: float) -> int:
    """Return the strength, 0 to 8, of the farthest zone that the trigger had reached 0.25 s before the last release.

    The draw counts as covered if this is full strength.
    """
    at_s = last_release_s - REACTION_S
    record = draw.replay.record
    reached = record.travel[record.tick_row(at_s) : record.tick_row(last_release_s) + 1, _R2].max()
    return int(law.strengths(draw, np.array([at_s]))[0, _R2, zone_of(float(reached))])


def zone_speed_m_s(zone: int) -> float:
    """Return the speed that a pull to a zone's middle commands: calibrated travel times full speed."""
    raw = min((zone + 0.5) / ZONE_COUNT / SENSED_TRAVEL, 1.0)
    return _TRAVEL.travel(raw) * ToolMotionSettings().trigger_speed_m_s


class Alarms(NamedTuple):
    """False alarms: strengths of 4 or more under the finger although the path is clear."""

    number: int
    """Number of false alarms; one that lasts counts once."""
    alarm_s: float
    judged_s: float
    """Judged time, in which R2 was pulled, in seconds."""


def false_alarms(law: Judged, draw: Draw, posed: PosedScene, shift_m: FloatArray, until_s: float) -> Alarms:
    """Count false alarms, judged every 20 ms from the pull's beginning until `until_s` or the end of the record.

    An alarm is false if the gripper, pulled to this zone and then stopped, would keep D_σ(P) + 15 mm from all objects.
    It must keep them in three cases: sticks and objects go on moving, at half speed, or not at all.
    """
    replay = draw.replay
    record = replay.record
    times = np.arange(record.began_s, min(until_s, replay.end_s), ALARM_STEP_S)
    travels = record.travel[[record.tick_row(time_s) for time_s in times], _R2]
    pulled = travels > SENSED_TRAVEL * _TRAVEL.dead_zone
    if not pulled.any():
        return Alarms(0, 0.0, 0.0)
    strengths = law.strengths(draw, times)[:, _R2]
    alarmed = np.zeros(len(times), dtype=np.bool_)
    for number in np.flatnonzero(pulled):
        zone = zone_of(float(travels[number]))
        if strengths[number, zone] >= ALARM_STRENGTH:
            time_s = float(times[number])
            joints, _ = replay.joints_at(time_s)
            there_m = shifted(shift_m, replay, draw.speed_m_s, time_s)
            posed.set_pose(joints, record.finger_positions[record.pose_row(time_s)], there_m)
            margin_m = statistical_distance_m(draw, time_s, law.probability) + CLEAR_M
            alarmed[number] = all(posed.stays_clear(path, margin_m) for path in _paths(draw, time_s, zone))
    starts = int(np.count_nonzero(alarmed & ~np.concatenate([[False], alarmed[:-1]])))
    return Alarms(starts, ALARM_STEP_S * float(alarmed.sum()), ALARM_STEP_S * float(pulled.sum()))


def _paths(draw: Draw, time_s: float, zone: int) -> Iterator[ToolPath]:
    """Yield three stopping paths relative to the objects: motion aside ends, continues by half, or continues."""
    replay = draw.replay
    moves = draw.speed_m_s != 0.0 or replay.sticks_at(time_s).any()
    for share in (0.0, 0.5, 1.0) if moves else (0.0,):
        since_s, path = stopping_path(replay, time_s, zone_speed_m_s(zone), share)
        yield path._replace(
            positions_m=path.positions_m - share * draw.speed_m_s * since_s[:, None] * replay.axis,
        )


def statistical_distance_m(draw: Draw, time_s: float, probability: float) -> float:
    """Return the largest D_σ(P) of all spheres: max(0, Φ⁻¹(P) √(ûᵀΣû + σ_c²)), eq. 9-10 without the delay."""
    replay = draw.replay
    pose = replay.estimated[replay.record.pose_row(time_s)]
    covariances = position_covariance(pose.sphere_jacobians, replay.encoder_sigma_rad)
    directions = np.broadcast_to(pose.tool_rotation[:, 2], (len(covariances), 1, 3))
    variance = float(np.max(directional_variance(covariances, directions))) + draw.camera_sd_m**2
    return max(0.0, float(ndtri(probability)) * math.sqrt(variance))
