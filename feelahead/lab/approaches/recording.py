"""Record a pull in free space without haptics, which can then be judged with any law, P, scene and camera error.

Both sides and the link run in the loopback, so the record has the effects of jitter, losses and the arm's limits.
Commands are sent at full rate, as a release at any time is examined later, and its command would be sent at once.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from common.arrays import FloatArray
from common.errors import FeelaheadError
from common.periods import TURN_S
from feelahead.both_sides.episode import Episode
from feelahead.both_sides.loopback import Loopback
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from feelahead.lab.approaches.pulls import PullKind, make_pull
from operator_side.people.port import Pulling
from operator_side.settings import OperatorSettings
from robot_side.drivers.mujoco.posed_scene import disable_contacts
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.settings import RobotSettings
from robot_side.tick.events import Listener

TICK_S = TURN_S
"""Period of both sides' turns, in seconds: that of the commands, and of which messages each had last received"""
POSE_S = 2.0 * TICK_S
"""Sampling period of the true pose, in seconds."""


@dataclass(frozen=True)
class RecordedApproach:
    """Record of one pull, from both sides, on their shared virtual clock; the pull begins at `began_s`."""

    seed: int
    began_s: float
    pose_time_s: FloatArray
    """(k,) times of the poses: every 8 ms, from a second before the pull"""
    joint_positions_rad: FloatArray
    """(k, n) true positions of the arm's joints"""
    joint_velocities_rad_s: FloatArray
    """(k, n) true velocities of the arm's joints"""
    finger_positions: FloatArray
    """(k, f) true positions of the fingers' joints"""
    loop_age_s: FloatArray
    """(k,) t_d of eq. 8 at the robot side"""
    tick_time_s: FloatArray
    """(l,) times of the ticks: every 4 ms"""
    applied_sent_s: FloatArray
    """(l,) when the operator side sent the command that the arm follows; NaN for none"""
    applied_at_s: FloatArray
    """(l,) when that command arrived"""
    seen_sent_s: FloatArray
    """(l,) when the robot side sent the operator side's newest stiffness; NaN for none"""
    travel: FloatArray
    """(l, 2) mechanical travel of L2 and R2, 0 to 1"""
    command_time_s: FloatArray
    """(c,) when each command was sent, every 4 ms"""
    command: FloatArray
    """(c,) calibrated travel of R2 less that of L2"""
    lateral: FloatArray
    """(c, 2) stick that moves across, right and up"""
    turning: FloatArray
    """(c, 2) stick that turns"""

    def pose_row(self, time_s: float) -> int:
        """Return the newest row of the poses until `time_s`; the first row if there is none."""
        return int(np.clip(np.searchsorted(self.pose_time_s, time_s + 1e-9) - 1, 0, len(self.pose_time_s) - 1))

    def tick_row(self, time_s: float) -> int:
        """Return the newest row of the ticks until `time_s`; the first row if there is none."""
        return int(np.clip(np.searchsorted(self.tick_time_s, time_s + 1e-9) - 1, 0, len(self.tick_time_s) - 1))

    def arrives_s(self, sent_s: float) -> float:
        """Return when a command sent at `sent_s`, or a newer one, reached the arm; infinite beyond the record."""
        # The newest command never gets older, except for gaps in which none is followed.
        newest = np.fmax.accumulate(np.where(np.isnan(self.applied_sent_s), -np.inf, self.applied_sent_s))
        row = int(np.searchsorted(newest, sent_s - 1e-9))
        return float(self.tick_time_s[row]) if row < len(newest) else float("inf")


def record_approach(
    pull: PullKind,
    link: str,
    seed: int,
    duration_s: float = 4.0,
    scene_name: str = "empty",
) -> RecordedApproach:
    """Record the pull of this kind and seed from the home pose of a frozen scene, without contact with its objects.

    FeelaheadError if the robot is not armed in time, or its arm is stopped during the pull.
    """
    robot = RobotSettings(model=frozen_scene(scene_name), site=SITE, link=link, seed=seed, full_rate=True)
    operator = OperatorSettings(link=link, seed=seed, haptics=False, full_rate=True)
    notes = _Notes()
    person = Pulling(make_pull(pull, seed))
    episode = Episode(
        robot=robot, operator=operator, world=_without_contacts, person=person, listeners=[notes], sampled=False
    )
    run = episode.loop
    notes.run, notes.scene = run, episode.scene
    began_s = episode.arm().acts_since_s
    run.run_until(began_s + duration_s)
    if run.robot.session.safety.stops:
        raise FeelaheadError(f"the arm was stopped over --link {link!r}: {run.robot.session.safety.stops[-1][1]}")
    return notes.record(seed, began_s)


def _without_contacts(settings: RobotSettings) -> Scene:
    scene = load_scene(settings.model, settings.site, settings.roles)
    disable_contacts(scene)
    return scene


class _Notes(Listener):
    """Listener that samples the record's columns after each tick of the robot side."""

    def __init__(self) -> None:
        self.run: Loopback | None = None
        self.scene: Scene | None = None
        self._poses: list[dict[str, Any]] = []
        self._ticks: list[dict[str, Any]] = []
        self._commands: list[dict[str, Any]] = []
        self._applied = (math.nan, math.nan)

    def on_sent(self, now_s: float) -> None:
        """Sample one tick."""
        if (run := self.run) is None or self.scene is None:
            return
        data, robot = self.scene.data, self.scene.robot
        command, seen = run.robot.session.safety.command, run.operator.stiffness
        if command is None:
            self._applied = (math.nan, math.nan)
        elif command.header.sent_s != self._applied[0]:
            self._applied = (command.header.sent_s, now_s)
        number = len(self._ticks)
        row = {"tick_time_s": now_s, "applied_sent_s": self._applied[0], "applied_at_s": self._applied[1]}
        row["seen_sent_s"] = math.nan if seen is None else seen.header.sent_s
        self._ticks.append(row | {"travel": run.device.travel})
        if (intent := run.operator.intent) is not None:
            row = {"command_time_s": now_s, "command": intent.r2 - intent.l2}
            self._commands.append(row | {"lateral": intent.lateral, "turning": intent.turning})
        if number % round(POSE_S / TICK_S) == 0:
            row = {"pose_time_s": now_s, "loop_age_s": run.robot.loop_age_s(now_s)}
            row["joint_positions_rad"] = data.qpos[robot.arm_positions].copy()
            row["joint_velocities_rad_s"] = data.qvel[robot.arm_velocities].copy()
            self._poses.append(row | {"finger_positions": data.qpos[robot.finger_positions].copy()})

    def record(self, seed: int, began_s: float) -> RecordedApproach:
        """Return the record: poses and ticks from a second before the pull, commands from the start of both sides."""
        from_s = began_s - 1.0
        poses = [row for row in self._poses if row["pose_time_s"] >= from_s]
        ticks = [row for row in self._ticks if row["tick_time_s"] >= from_s]
        columns = {
            name: np.array([row[name] for row in rows]) for rows in (poses, ticks, self._commands) for name in rows[0]
        }
        return RecordedApproach(seed=seed, began_s=began_s, **columns)
