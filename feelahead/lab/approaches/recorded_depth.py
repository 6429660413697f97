"""A recorded approach as depth cameras would have seen it, with newly drawn errors of theirs."""

from collections import deque
from collections.abc import Callable
from typing import Final

from common.arrays import FloatArray
from feelahead.lab.approaches.replay import Replay
from robot_side.depth.frames import SurfaceFrames
from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig
from robot_side.drivers.mujoco.posed_scene import PosedScene
from robot_side.surroundings.perceived import PerceivedObjects

_REMEMBERED: Final = 100
_BEFORE_S: Final = 0.5
"""Time for which the cameras see the scene before the pull begins"""


class RecordedDepth:
    """Frames by the cameras of a rig along a recorded approach, to be asked for at times that rise, or fall little."""

    def __init__(
        self,
        replay: Replay,
        posed: PosedScene,
        rig: DepthRig,
        shift_m: FloatArray,
        speed_m_s: float,
        frames: Callable[[], SurfaceFrames],
        seed: int,
    ) -> None:
        """shift_m (3,), speed_m_s: of the objects, as in `shifted`, but before the pull, too.

        frames: makes empty frames. seed: draws the cameras' errors.
        """
        self._replay, self._posed, self._rig = replay, posed, rig
        self._shift_m, self._speed_m_s, self._seed = shift_m, speed_m_s, seed
        self._roles, self._period_s = posed.scene.roles, 1.0 / rig.rate_hz
        self._first_s = max(float(replay.record.pose_time_s[0]), replay.record.began_s - _BEFORE_S)
        self._new_frames = frames
        self._frames, self._taken = frames(), 0
        self._shown: deque[tuple[float, PerceivedObjects]] = deque(maxlen=_REMEMBERED)
        """Newest frames, and the time of each"""
        self._rig.restart(seed)

    def at(self, time_s: float) -> PerceivedObjects:
        """Return the newest frame at `time_s`; long after it, all would have to be seen anew."""
        if self._shown and time_s < self._shown[0][0]:
            self._rig.restart(self._seed)
            self._frames, self._taken = self._new_frames(), 0
            self._shown.clear()
        record, rig = self._replay.record, self._rig
        while (due_s := self._first_s + self._taken * self._period_s) + rig.latency_s <= time_s:
            # What comes is coming already when the cameras begin to look.
            shift_m = self._shift_m + self._speed_m_s * (due_s - record.began_s) * self._replay.axis
            fingers = record.finger_positions[record.pose_row(due_s)]
            self._posed.set_pose(self._replay.joints_at(due_s)[0], fingers, shift_m)
            rig.take(self._posed.data, due_s, self._roles)
            known_s = due_s + rig.latency_s
            if (news := rig.arrived(known_s)) is not None:
                changes, taken_s = news
                self._frames.take(changes, (taken_s, taken_s))
            self._shown.append((known_s, self._frames.at(known_s)))
            self._taken += 1
        earlier = [frame for shown_s, frame in self._shown if shown_s <= time_s]
        if not earlier or time_s > self._shown[-1][0]:
            # What moves is carried on between pictures.
            frame = self._frames.at(time_s)
            if not self._shown or frame is not self._shown[-1][1]:
                self._shown.append((time_s, frame))
            return frame
        return earlier[-1]
