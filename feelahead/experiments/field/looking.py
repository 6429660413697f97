"""One look ahead at things at a known distance, and what it takes."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.ahead.field import Ahead, Along, FieldCounts
from robot_side.ahead.find import OBSTACLE
from robot_side.ahead.scene_table import scene_table
from robot_side.arm.port import ArmState
from robot_side.compiled.warm_up import warm_up
from robot_side.enlargement.distance import standard_quantile
from robot_side.settings import CameraSettings, EncoderSettings
from robot_side.simulation.encoders import Encoder
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.posed_scene import PosedScene
from robot_side.simulation.scene import load_scene

_REACH_M = 0.4
_FARTHEST_M = 2.0


@dataclass(frozen=True)
class Look:
    """What was found at one distance."""

    free_mm: float
    """The true gripper's free way along its approach."""
    ways_mm: tuple[float, ...]
    """After which R2's eight strengths begin; infinite for one that is never reached."""
    sigma_mm: float
    """D_σ"""
    overlaps: int
    """How many were worked out."""
    r2_us: float
    """Processor time of a look along R2, the median."""
    l2_us: float


class Looker:
    """The gripper of one scene, in its home pose."""

    def __init__(self, model: Path, site: str, probability: float) -> None:
        """ConfigurationError for a model that cannot be used, or that has nothing ahead of its gripper."""
        scene = load_scene(model, site)
        self._posed = PosedScene(scene)
        robot = scene.robot
        self._joints = scene.data.qpos[robot.arm_positions].copy()
        self._fingers = scene.data.qpos[robot.finger_positions].copy()
        still = np.zeros_like(self._joints)
        self._pose = MujocoKinematics(scene).pose(ArmState(0.0, self._joints, still, self._fingers, 0.0, False))
        self._standing = np.full(len(scene.objects), OBSTACLE, dtype=np.int64)
        self._errors = np.zeros((len(scene.objects), 3))
        encoder = EncoderSettings()
        sigma = Encoder(encoder.sigma_rad, encoder.resolution_rad).standard_deviation_rad()
        self._ahead = Ahead(np.full(len(self._joints), sigma))
        self._quantile = float(standard_quantile(probability))
        self._posed.put(self._joints, self._fingers, np.zeros(3))
        self._way_m = self._posed.way_m(_FARTHEST_M)
        if self._way_m >= _FARTHEST_M:
            raise ConfigurationError(
                f"--model {model}: nothing is ahead of the gripper within {_FARTHEST_M:g} m; valid: a scene with"
                " something on its way"
            )
        warm_up()

    def look(self, free_m: float, looks: int, now_s: Callable[[], float]) -> Look:
        """With the objects where the free way is `free_m`; `now_s` tells the processor time."""
        axis = self._pose.tool_rotation[:, 2]
        self._posed.put(self._joints, self._fingers, (free_m - self._way_m) * axis)
        scene = scene_table(self._posed.perceived(self._errors))

        def along(direction: FloatArray) -> Along:
            variance_m2 = CameraSettings().sd_m ** 2
            return Along(np.ascontiguousarray(direction), 0.0, variance_m2, self._quantile, _REACH_M)

        self._ahead.counts = FieldCounts()
        field = self._ahead.look(self._pose, scene, self._standing, along(axis))
        overlaps = self._ahead.counts.overlaps
        took_s: list[list[float]] = [[], []]
        for _ in range(looks):
            for side, direction in enumerate((axis, -axis)):
                began_s = now_s()
                self._ahead.look(self._pose, scene, self._standing, along(direction))
                took_s[side].append(now_s() - began_s)
        r2_us, l2_us = (1e6 * float(np.median(times)) for times in took_s)
        ways_mm = tuple(1e3 * way if math.isfinite(way) else math.inf for way in field.fast_m.tolist())
        return Look(1e3 * free_m, ways_mm, 1e3 * field.sigma_m, overlaps, r2_us, l2_us)
