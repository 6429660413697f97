"""How far the gripper goes until a command takes effect, as predicted and in truth (eq. 8 and what replaces it)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from common.arrays import BoolArray, FloatArray
from feelahead.benchmarks.error.tool_path import PoseAt, ToolPath
from feelahead.lab.approaches.pulls import PullKind
from feelahead.lab.approaches.recording import RecordedApproach
from operator_side.feel.commands_under_way import CommandsUnderWay
from robot_side.arm.ability import along_approach
from robot_side.simulation.joint_reference import MotionLimits

Compensation = Literal["operator", "robot", "momentary"]
COMPENSATIONS: Final[tuple[Compensation, ...]] = get_args(Compensation)
"""operator: the commands under way, by who sent them. robot: v t_d, t_d the robot's high quantile of the loop age
(eq. 8). momentary: v times the loop age of this very moment."""
VARIANTS: Final = ("as reported", "v_max as set", "a of home", "a 2 m/s²", "a 3 m/s²", "a 5 m/s²", "a infinite")
"""What the operator's own prediction may take for v_max and a: by the pose in the report (what COMPENSATIONS has), or
the one as it is set, or the other always the same."""
_STEP_S: Final = 0.01


@dataclass(frozen=True)
class Moments:
    """What the operator side knew at moments of one approach, and what came of it."""

    now_s: FloatArray
    """(k,) when a command was sent, for which the prediction is made"""
    reported_s: FloatArray
    """(k,) T: when the robot sent the newest stiffness that the operator side had"""
    arrives_s: FloatArray
    """(k,) when the arm began to follow the command that was sent at `now_s`, or a newer one"""
    echo_sent_s: FloatArray
    """(k,) when the command was sent that the arm followed at T"""
    echo_held_s: FloatArray
    """(k,) for how long it had, at T"""
    loop_age_quantile_s: FloatArray
    """(k,) t_d at the robot, at T"""

    def __len__(self) -> int:
        return len(self.now_s)

    @property
    def loop_age_s(self) -> FloatArray:
        """(k,) how old the newest command was that the report knew of."""
        return self.now_s - self.echo_sent_s


@dataclass(frozen=True)
class Judged:
    """Truth less prediction in metres, along the direction in which R2 advances; a row for each moment."""

    pull: PullKind
    link: str
    seed: int
    loop_age_s: FloatArray
    """(k,)"""
    way_m: FloatArray
    """(k,) the true displacement"""
    within_reach: BoolArray
    """(k,) False: at the edge of its reach the arm cannot do what it is told."""
    errors_m: Mapping[Compensation, FloatArray]
    """(k,) each"""
    by_variant_m: Mapping[str, FloatArray]
    """(k,) each: of the operator's prediction with what VARIANTS name"""
    speed_errors_m_s: FloatArray
    """(k,) of the speed at the end, by the operator's prediction"""


def moments(record: RecordedApproach) -> Moments:
    """Every 10 ms of the pull: the newest command by then, where the robot was heard and the command arrived."""
    rows = []
    # What is not between two recorded poses cannot be compared with them.
    last_s = min(record.tick_time_s[-1], record.pose_time_s[-1])
    for number in range(max(0, int((last_s - record.began_s) / _STEP_S + 1e-6))):
        sent = int(np.searchsorted(record.command_time_s, record.began_s + number * _STEP_S + 1e-9)) - 1
        now_s = float(record.command_time_s[sent]) if sent >= 0 else -np.inf
        if now_s < record.tick_time_s[0]:
            continue
        reported_s = float(record.seen_sent_s[record.tick_row(now_s)])
        arrives_s = record.arrives_s(now_s)
        if not (reported_s >= record.pose_time_s[0] and arrives_s <= last_s):  # NaN, infinite
            continue
        report = record.tick_row(reported_s)
        echo_sent_s = float(record.applied_sent_s[report])
        if np.isnan(echo_sent_s):
            continue
        held_s = reported_s - float(record.applied_at_s[report])
        quantile_s = float(record.loop_age_s[record.pose_row(reported_s)])
        rows.append((now_s, reported_s, arrives_s, echo_sent_s, held_s, quantile_s))
    return Moments(*np.array(rows, dtype=np.float64).reshape(-1, 6).T.copy())


def predicted(
    record: RecordedApproach,
    at: Moments,
    speeds_m_s: FloatArray,
    full_speeds_m_s: FloatArray,
    accelerations_m_s2: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """δ and w (k,) by the operator side's own commands, from the speeds v, v_max and a (k,) in the reports.

    NaN where it has no answer.
    """
    commands, sent = CommandsUnderWay(), 0
    ways_m, speeds = np.full(len(at), np.nan), np.full(len(at), np.nan)
    for row, now_s in enumerate(at.now_s):
        while sent < len(record.command_time_s) and record.command_time_s[sent] <= now_s:
            commands.sent(float(record.command_time_s[sent]), float(record.command[sent]))
            sent += 1
        found = commands.displacement(
            float(now_s),
            float(at.echo_sent_s[row]),
            float(at.echo_held_s[row]),
            float(speeds_m_s[row]),
            float(full_speeds_m_s[row]),
            float(accelerations_m_s2[row]),
        )
        if found is not None:
            ways_m[row], speeds[row] = found
    return ways_m, speeds


def judge(record: RecordedApproach, pose_at: PoseAt, limits: MotionLimits, full_speed_m_s: float) -> Judged:
    """Compare every prediction with what the arm did; full_speed_m_s is v_max as it is set."""
    path = ToolPath(record, pose_at, limits, full_speed_m_s)
    at = moments(record)
    way_m = path.ways_m(at.reported_s, at.arrives_s)
    speed_m_s = path.speeds_m_s(at.reported_s)
    full_m_s, here_m_s2 = path.full_speeds_m_s(at.reported_s), path.accelerations_m_s2(at.reported_s)
    pose = pose_at(record.joint_positions_rad[0])
    home = along_approach(pose, limits.of_joints(pose.tool_jacobian.shape[1]), full_speed_m_s)
    fixed_m_s2 = (home.acceleration_m_s2, 2.0, 3.0, 5.0, np.inf)
    candidates = [
        (full_m_s, here_m_s2),
        (np.full(len(at), full_speed_m_s), here_m_s2),
        *((full_m_s, np.full(len(at), value)) for value in fixed_m_s2),
    ]
    found = {
        name: predicted(record, at, speed_m_s, *candidate) for name, candidate in zip(VARIANTS, candidates, strict=True)
    }
    by_variant = {name: way_m - own_m for name, (own_m, _) in found.items()}
    errors: dict[Compensation, FloatArray] = {
        "operator": by_variant[VARIANTS[0]],
        "robot": way_m - speed_m_s * at.loop_age_quantile_s,
        "momentary": way_m - speed_m_s * at.loop_age_s,
    }
    return Judged(
        pull=record.pull,
        link=record.link,
        seed=record.seed,
        loop_age_s=at.loop_age_s,
        way_m=way_m,
        within_reach=path.within_reach(at.reported_s, at.arrives_s),
        errors_m=errors,
        by_variant_m=by_variant,
        speed_errors_m_s=path.speeds_m_s(at.arrives_s) - found[VARIANTS[0]][1],
    )
