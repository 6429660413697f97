"""What a peer's own positions say: when the arm stood, and how near its gripper came to the wall."""

from pathlib import Path
from typing import Final, NamedTuple

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray

STANDS_RAD: Final = 1e-3
"""Deviation from the last position within which a joint stands"""
_FAR_M: Final = 1.0


class Positions(NamedTuple):
    """Positions (k, n), in rad, and their times (k,), in s of the monotonic clock."""

    times_s: FloatArray
    joints_rad: FloatArray

    def between(self, begin_s: float, end_s: float) -> "Positions":
        """Return the part of this time."""
        inside = (self.times_s >= begin_s) & (self.times_s <= end_s)
        return Positions(self.times_s[inside], self.joints_rad[inside])

    def stands_after_s(self) -> float:
        """Return the time from the first position to the last one that differs from the end; 0 if none does."""
        moves = np.abs(self.joints_rad - self.joints_rad[-1]).max(axis=1) > STANDS_RAD
        return float(self.times_s[moves][-1] - self.times_s[0]) if moves.any() else 0.0

    def moved_rad(self) -> float:
        """Return the largest way between two positions of one joint; 0 for no positions."""
        return float(np.ptp(self.joints_rad, axis=0).max()) if len(self.times_s) else 0.0


class PositionLog:
    """Log that a peer writes; each reading goes on where the last one ended."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._rows = np.zeros((0, 2))
        self._read_bytes = 0

    def begin_anew(self) -> None:
        """Forget what was read, for another peer."""
        self.path.unlink(missing_ok=True)
        self._rows, self._read_bytes = np.zeros((0, 2)), 0

    def read(self) -> Positions:
        """Return all positions until now; a last line that is only half written is left to the next reading."""
        if self.path.exists():
            with self.path.open("rb") as log:
                log.seek(self._read_bytes)
                whole = log.read().rpartition(b"\n")[0]
            if whole:
                self._read_bytes += len(whole) + 1
                new = np.array([[float(value) for value in line.split(b",")] for line in whole.split(b"\n")])
                self._rows = np.vstack((self._rows, new)) if len(self._rows) else new
        return Positions(self._rows[:, 0], self._rows[:, 1:])


def least_gap_m(model_path: Path, positions: Positions, opening_m: float = 0.08) -> float:
    """Return the least distance from the hand and its fingers to the wall; negative if they were in it."""
    model = mujoco.MjModel.from_xml_path(str(model_path))
    data = mujoco.MjData(model)
    hand = {model.body(name).id for name in ("hand", "left_finger", "right_finger")}
    geoms = [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] in hand and model.geom_contype[geom]]
    wall, least_m = model.geom("wall").id, _FAR_M
    for joints_rad in positions.joints_rad[::-25]:
        data.qpos[: len(joints_rad)] = joints_rad
        data.qpos[len(joints_rad) :] = opening_m / 2.0
        mujoco.mj_kinematics(model, data)
        gaps_m = (mujoco.mj_geomDistance(model, data, geom, wall, _FAR_M, None) for geom in geoms)
        least_m = min(least_m, *gaps_m)
    return least_m
