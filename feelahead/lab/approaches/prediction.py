"""Compare the gripper's predicted with its true displacement until a command takes effect (eq. 8 and ours)."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple, get_args

import numpy as np
from scipy.interpolate import CubicHermiteSpline, make_interp_spline

from common.arrays import BoolArray, FloatArray
from common.protocol.messages import Compensation
from feelahead.lab.approaches.recording import RecordedApproach
from feelahead.lab.table import Row, Table
from operator_side.feel.commands_under_way import CommandsUnderWay, Report
from robot_side.arm.ability import along_approach
from robot_side.arm.limits import ArmLimits
from robot_side.arm.port import GripperPose

COMPENSATIONS: Final[tuple[Compensation, ...]] = get_args(Compensation)
"""operator: the commands under way, known by their sender. robot: v t_d with the robot's high quantile of the loop age
(eq. 8)."""
_STEP_S: Final = 0.01
_LEAST_SPEED: Final = 1e-9
AGE_BINS_S: Final = tuple(pairwise((0.0, 0.02, 0.06, 0.13, 0.28, 0.58, 1.2)))
"""Bins of the loop age in seconds; approaches are pooled by the median of theirs. A moment's own age does not choose:
where it is short by chance, the next command takes longer than the last, which would look like an error."""
PoseAt = Callable[[FloatArray], GripperPose]
"""Function from joint positions (n,) to the gripper's pose."""


class ToolPath:
    """Position of the tool over time in the world frame, interpolated between the recorded poses."""

    def __init__(self, record: RecordedApproach, pose_at: PoseAt, limits: ArmLimits, full_speed_m_s: float) -> None:
        """record: its true joints are followed. limits, full_speed_m_s: decide what is within the arm's reach."""
        poses = [pose_at(joints) for joints in record.joint_positions_rad]
        able = [along_approach(pose, limits.of_joints(pose.tool_jacobian.shape[1]), full_speed_m_s) for pose in poses]
        self.time_s = record.pose_time_s
        axes = np.array([pose.tool_rotation[:, 2] for pose in poses])
        rates = zip(poses, record.joint_velocities_rad_s, strict=True)
        velocities_m_s = np.array([pose.tool_jacobian[:3] @ of_joints for pose, of_joints in rates])
        self._axes = make_interp_spline(self.time_s, axes, k=1)
        self._positions_m = CubicHermiteSpline(self.time_s, [pose.tool_position_m for pose in poses], velocities_m_s)
        speeds_m_s = np.einsum("ki,ki->k", velocities_m_s, axes)
        ability = [
            (speed, one.full_speed_m_s, one.acceleration_m_s2) for speed, one in zip(speeds_m_s, able, strict=True)
        ]
        self.ability = make_interp_spline(self.time_s, ability, k=1)
        """Function from times (k,) to speed along the approach axis, v_max and least acceleration (k, 3)."""
        self._within_reach: BoolArray = np.array([one.within_reach for one in able])

    def within_reach(self, from_s: FloatArray, to_s: FloatArray) -> BoolArray:
        """Return for each interval (k,) whether the arm could reach full speed throughout."""
        outside = np.concatenate([[0], np.cumsum(~self._within_reach)])
        first = np.maximum(np.searchsorted(self.time_s, from_s, side="right") - 1, 0)
        behind = np.minimum(np.searchsorted(self.time_s, to_s, side="left") + 1, len(self.time_s))
        clear: BoolArray = outside[behind] == outside[first]
        return clear

    def onsets_m(self, from_s: FloatArray, to_s: FloatArray) -> FloatArray:
        """Return the tool's displacement in each interval (k,), along its approach axis at the interval's beginning."""
        axes = self._axes(from_s)
        axes /= np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), _LEAST_SPEED)
        displacements_m: FloatArray = np.einsum("ki,ki->k", self._positions_m(to_s) - self._positions_m(from_s), axes)
        return displacements_m


@dataclass(frozen=True)
class Moments:
    """What the operator side knew at several times of one approach, and when its commands arrived."""

    now_s: FloatArray
    """(k,) when the command was sent for which the prediction is made"""
    reported_s: FloatArray
    """(k,) T: when the robot side sent the newest stiffness that the operator side had"""
    arrives_s: FloatArray
    """(k,) when the arm began to follow the command sent at `now_s`, or a newer one"""
    echo_sent_s: FloatArray
    """(k,) when the command was sent that the arm followed at T"""
    echo_held_s: FloatArray
    """(k,) time for which the robot side had that command, at T"""
    loop_age_quantile_s: FloatArray
    """(k,) t_d at the robot side, at T"""

    def __len__(self) -> int:
        return len(self.now_s)

    @property
    def loop_age_s(self) -> FloatArray:
        """(k,) age of the newest command that had reached the robot side when it sent the report."""
        return self.now_s - self.echo_sent_s


def moments(record: RecordedApproach) -> Moments:
    """Return the times at which predictions are judged: every 10 ms of the pull, with the newest command sent.

    Left out are times before the first report, and commands that never arrived.
    """
    rows = []
    # Times beyond the recorded poses cannot be compared.
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
    """Predict δ and w (k,) from the operator side's commands and the reports' v, v_max and a (k,).

    NaN where no prediction is possible.
    """
    commands, sent = CommandsUnderWay(), 0
    onsets_m, speeds = np.full(len(at), np.nan), np.full(len(at), np.nan)
    for row, now_s in enumerate(at.now_s):
        while sent < len(record.command_time_s) and record.command_time_s[sent] <= now_s:
            commands.sent(float(record.command_time_s[sent]), float(record.command[sent]))
            sent += 1
        numbers = at.echo_sent_s[row], at.echo_held_s[row], speeds_m_s[row], full_speeds_m_s[row]
        found = commands.displacement(float(now_s), Report(*map(float, numbers)), float(accelerations_m_s2[row]))
        if found is not None:
            onsets_m[row], speeds[row] = found
    return onsets_m, speeds


def judge(record: RecordedApproach, pose_at: PoseAt, limits: ArmLimits, full_speed_m_s: float) -> Row:
    """Compare every prediction with the arm's true displacement. full_speed_m_s: v_max of the settings.

    Return lists (k,), an entry for each judged time: `loop_age_s`, `within_reach`, `displacement_m` and the errors.
    within_reach: False at the edge of the arm's reach, where it cannot follow the command. displacement_m: true
    displacement along the direction in which R2 advances. Errors: truth less prediction, by COMPENSATIONS; NaN without
    a prediction.
    """
    path = ToolPath(record, pose_at, limits, full_speed_m_s)
    at = moments(record)
    displacement_m = path.onsets_m(at.reported_s, at.arrives_s)
    speed_m_s, full_m_s, here_m_s2 = path.ability(at.reported_s).T
    own_m, own_m_s = predicted(record, at, speed_m_s, full_m_s, here_m_s2)
    errors = {
        "operator": displacement_m - own_m,
        "robot": displacement_m - speed_m_s * at.loop_age_quantile_s,
        "speed at the end": path.ability(at.arrives_s)[:, 0] - own_m_s,
    }
    within = path.within_reach(at.reported_s, at.arrives_s)
    known = {"loop_age_s": at.loop_age_s, "displacement_m": displacement_m, "within_reach": within}
    return {name: values.tolist() for name, values in (known | errors).items()}


class Spread(NamedTuple):
    """Distribution of prediction errors; 99 % quantile and maximum are those of the errors' magnitudes."""

    moments: int
    loop_age_ms: float
    mean_mm: float
    sd_mm: float
    p99_mm: float
    max_mm: float


def over(judged: Table, name: str, ages_s: tuple[float, float] = (0.0, np.inf), *, within_reach: bool = True) -> Spread:
    """Pool the errors in column `name` of all approaches whose loop age is within `ages_s`: from the first to below the
    second.

    within_reach: take the times at which the arm could follow the command; if False, the other times.
    """
    errors_mm, ages_ms = [np.empty(0)], [np.empty(0)]
    for row in judged:
        if row["loop_age_s"] and ages_s[0] <= float(np.median(row["loop_age_s"])) < ages_s[1]:
            error_mm, age_ms = 1e3 * np.array(row[name], dtype=float), 1e3 * np.array(row["loop_age_s"])
            wanted = (np.array(row["within_reach"]) == within_reach) & ~np.isnan(error_mm)
            errors_mm.append(error_mm[wanted])
            ages_ms.append(age_ms[wanted])
    all_mm, all_ms = np.concatenate(errors_mm), np.concatenate(ages_ms)
    if not all_mm.size:
        return Spread(0, *[math.nan] * 5)
    magnitudes = np.abs(all_mm)
    figures = all_ms.mean(), all_mm.mean(), all_mm.std(), np.quantile(magnitudes, 0.99), magnitudes.max()
    return Spread(int(all_mm.size), *map(float, figures))


def error_table(judged: Table, arm: str, frozen: str, full_speed_m_s: float) -> str:
    """Return a TOML table with μ_δ and σ_δ of eq. 10 for each kind of compensation and bin of loop age with errors.

    arm: fingerprint of the measured arm.
    """
    pulls, links = (", ".join(f'"{name}"' for name in dict.fromkeys(judged.values(key))) for key in ("pull", "link"))
    lines = [
        "# How wrong the predicted displacement is: truth less prediction along the direction in which R2 advances, so",
        "# that mu_mm above 0 is a gripper farther ahead than predicted. p99_mm is of the magnitude.",
        "# [[operator]]: by the commands under way, as their sender knows them. [[robot]]: v t_d, t_d the robot's high",
        "# quantile of the loop age (eq. 8). Moments at the edge of the arm's reach, where it cannot do as told,",
        "# are not in it.",
        f'arm = "{arm}"',
        f'frozen = "{frozen}"',
        f"full_speed_m_s = {full_speed_m_s:g}",
        f"pulls = [{pulls}]",
        f"links = [{links}]",
        f"seeds = {sorted(set(judged.values('seed')))}",
    ]
    for kind in COMPENSATIONS:
        for ages_s in AGE_BINS_S:
            found = over(judged, kind, ages_s)
            if found.moments:
                lines += ["", f"[[{kind}]]", f"loop_age_ms = {found.loop_age_ms:.1f}", f"mu_mm = {found.mean_mm:.4f}"]
                lines += [f"sigma_mm = {found.sd_mm:.4f}", f"p99_mm = {found.p99_mm:.4f}", f"n = {found.moments}"]
    return "\n".join(lines) + "\n"
