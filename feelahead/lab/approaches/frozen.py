"""Frozen scenes, forces and limits: they must not change, so that figures of different laws can be compared.

The scenes are in tests/data. The simulated finger's forces and the arm's limits are those of commit 92ca53a.
"""

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from common.errors import ConfigurationError
from common.protocol.messages import Vector2
from operator_side.controller.feel import MAX_STRENGTH, SENSED_TRAVEL, ZONE_COUNT
from operator_side.dualsense.simulated.trigger_model import (
    FINGER_TIME_CONSTANT_S,
    NORMAL_FINGER_FORCE_N,
    SPRING_PRELOAD_N,
    SPRING_RISE_N,
)
from operator_side.hands.travel_calibration import TravelCalibration
from robot_side.arm.limits import ACCELERATION_RAD_S2, DECELERATION_RAD_S2, VELOCITY_RAD_S
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.drivers.mujoco.joint_reference import WINDUP_RAD
from robot_side.settings import CameraSettings, EncoderSettings

SCENES: Final = Path(__file__).parents[3] / "tests" / "data"
SITE: Final = "tool"
AHEAD: Final = (
    *("wall", "plate", "ball", "post", "rod_2mm", "rod_5mm", "rod_10mm"),
    *("wall_45", "slot", "shelf_edge", "moving", "fleeing", "place_held", "u_mesh", "mug"),
    "terrain_ahead",
)
"""Scenes in which a pull that goes on ends in a contact."""
PASSED: Final = (
    *("wall_beside", "table_1_box", "table_2_boxes", "table_12_tetrahedra", "table_mesh"),
    *("cluttered", "terrain", "empty"),
)
"""Scenes in which a straight pull touches nothing, so that any strength is a false alarm."""
ASIDE: Final[dict[str, tuple[Vector2, Vector2]]] = {"edge": ((1.0, 0.0), (0.0, 0.0)), "turn": ((0.0, 0.0), (1.0, 0.0))}
"""Scenes in which a straight pull touches nothing, with the deflections of both sticks that end in a contact:
(stick that moves across, stick that turns)."""
REACHING: Final = ("hand",)
"""Scenes of what reaches in, in a folder of their own: they are not frozen, and not in the hash."""
GRIPPED: Final = ("place_held",)
"""Scenes in which the gripper holds an object before the pull begins."""
_HASH_DIGITS = 12


def frozen_scene(name: str) -> Path:
    """Return the MJCF file of a frozen scene, or of one of REACHING; ConfigurationError if it is missing.

    An installed wheel has none.
    """
    path = SCENES / ("reaching" if name in REACHING else "") / f"{name}.xml"
    if not path.is_file():
        names = (
            ", ".join((*AHEAD, *ASIDE, *PASSED))
            if SCENES.is_dir()
            else "none here, as scenes are in a clone of the repository: run it there"
        )
        raise ConfigurationError(f"scene {name!r}: {path} does not exist; valid: {names}")
    return path


def scene_names(models: Iterable[Path]) -> dict[Path, str]:
    """Return a name for each scene's file: its stem, or the whole path if several files have the same stem."""
    known = list(dict.fromkeys(models))
    stems = [model.stem for model in known]
    return {model: model.stem if stems.count(model.stem) == 1 else str(model) for model in known}


def frozen_values() -> dict[str, Any]:
    """Return the simulated finger's forces, and the limits of finger and arm, as the code has them."""
    return {
        "finger": {
            "preload_n": SPRING_PRELOAD_N,
            "rise_n": SPRING_RISE_N,
            "time_constant_s": FINGER_TIME_CONSTANT_S,
            "normal_n": NORMAL_FINGER_FORCE_N,
            "sensed_travel": SENSED_TRAVEL,
            "zones": ZONE_COUNT,
            "strengths": MAX_STRENGTH,
        },
        "travel": asdict(TravelCalibration()),
        "arm": {
            "velocity_rad_s": VELOCITY_RAD_S,
            "acceleration_rad_s2": ACCELERATION_RAD_S2,
            "deceleration_rad_s2": DECELERATION_RAD_S2,
            "windup_rad": WINDUP_RAD,
        },
        "tool": asdict(ToolMotionSettings()),
        "camera": {name: asdict(CameraSettings())[name] for name in ("mean_m", "sd_m", "frame_sd_m")},
        "encoder": asdict(EncoderSettings()),
    }


def frozen_hash(others: Sequence[Path] = ()) -> str:
    """Return a hash of all frozen scenes and values, and of those files in `others` that are no frozen scenes."""
    digest = hashlib.sha256(json.dumps(frozen_values(), sort_keys=True).encode())
    foreign = sorted(path for path in others if path.parent.resolve() != SCENES)
    for path in [*sorted(SCENES.glob("*.xml")), *foreign]:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:_HASH_DIGITS]
