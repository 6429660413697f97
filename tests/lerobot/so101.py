"""SO-101 of the tests: the published model with a wall, where its servos stand, and how near it came to the wall."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.arrays import FloatArray
from tests.lerobot.servo_bus import CENTRE, STEP_RAD, STEPS, ServoBus

START_RAD: Final = (0.0, -1.5, 1.6, -0.1, 0.0, 0.8)
"""Where the joints and the jaw stand first: the gripper points ahead, and has 130 mm of way"""
JAW_RAD: Final = (-0.174, 1.745)
"""Angles of the closed and of the open jaw"""
NAMES: Final = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
ID: Final = "emulated"
SITE: Final = "gripperframe"
AXIS: Final = "x"
FACE_M: Final = 0.34
"""Where the near face of the wall stands, ahead of the arm's base"""


def write_model(published: Path, path: Path, face_m: float = FACE_M) -> None:
    """Write the published model with the wall, and with the start as its keyframe."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = published.read_text("utf-8").replace('meshdir="assets"', f'meshdir="{published.parent / "assets"}"')
    wall = f'<body name="wall" pos="{face_m + 0.01} 0 0.2"><geom type="box" size="0.01 0.3 0.2"/></body>'
    start = " ".join(map(str, START_RAD))
    text = text.replace("  </worldbody>", f"    {wall}\n  </worldbody>")
    home = f'<keyframe><key name="home" qpos="{start}" ctrl="{start}"/></keyframe>'
    path.write_text(text.replace("</mujoco>", f"{home}</mujoco>"), "utf-8")


def calibrate(bus: ServoBus, home: Path) -> None:
    """Calibrate the emulated servos, and write the same into LeRobot's folder `home`."""
    found = {}
    for number, name in enumerate(NAMES, start=1):
        ends = [0, STEPS - 1] if name != "gripper" else [round(CENTRE + angle / STEP_RAD) for angle in JAW_RAD]
        bus.servos.by_number[number].limit(*ends)
        found[name] = {"id": number, "drive_mode": 0, "homing_offset": 0, "range_min": ends[0], "range_max": ends[1]}
    for robot in ("so_follower", "so101_follower"):
        folder = home / "calibration" / "robots" / robot
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{ID}.json").write_text(json.dumps(found), "utf-8")


class Truth:
    """Where the gripper really was, from the servos' own positions."""

    def __init__(self, model: Path) -> None:
        self._model = mujoco.MjModel.from_xml_path(str(model))
        self._data = mujoco.MjData(self._model)
        self._wall = int(self._model.body("wall").geomadr[0])
        hands = {self._model.body(name).id for name in ("gripper", "moving_jaw_so101_v1")}
        self._hand = [
            geom
            for geom in range(self._model.ngeom)
            if self._model.geom_bodyid[geom] in hands and self._model.geom_group[geom] == 3
        ]

    def distance_m(self, positions_rad: Sequence[float]) -> float:
        """Return the distance of gripper and wall; 0 or less where they touch."""
        self._pose(positions_rad)
        model, data, line = self._model, self._data, np.zeros(6)
        return min(float(mujoco.mj_geomDistance(model, data, geom, self._wall, 1.0, line)) for geom in self._hand)

    def tool_m(self, positions_rad: Sequence[float]) -> FloatArray:
        """Return the place of the tool (3,), in m."""
        self._pose(positions_rad)
        return np.array(self._data.site(SITE).xpos)

    def _pose(self, positions_rad: Sequence[float]) -> None:
        self._data.qpos[:] = positions_rad
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)


def fastest_rad_s(before: Sequence[float], after: Sequence[float], passed_s: float) -> float:
    """Return the speed of the fastest joint between two rows of positions."""
    return max((abs(b - a) for a, b in zip(before, after, strict=True)), default=0.0) / max(passed_s, math.ulp(1.0))
