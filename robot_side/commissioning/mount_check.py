"""What `feelahead doctor --depth --solve NAME` says of the camera's mount."""

import json
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from robot_side.commissioning.checklist import Check
from robot_side.commissioning.depth_figures import Look
from robot_side.commissioning.mount_solving import WAYS, Refused, solve_mount
from robot_side.depth.camera_settings import LinkMount
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot

_ENOUGH_POSES: Final = 3


def mount_check(
    name: str, looks: Sequence[Look], mount: LinkMount, robot: PosedRobot, *, arm_known: bool
) -> tuple[Check, str | None]:
    """Solve a mount; return the check, and the lines of the right mount. arm_known: as for `depth_checks`."""
    what = f"{name}: solved mount"
    found = solve_mount(looks, robot) if looks else Refused("the arm was never at rest", "let it rest for a second")
    if isinstance(found, Refused):
        return Check(what, False, found.why, found.remedy), None
    sds_m = np.sqrt(np.diag(found.covariance)[3:]).tolist()
    sds = ", ".join(f"{1e3 * sd_m:.1f} mm {way}" for sd_m, way in zip(sds_m, WAYS, strict=True))
    worst_m, _, worst_rad, _ = found.worst()
    said = (
        f"{len(looks)} poses, {found.points} points: {1e3 * found.before_m:.1f} mm off before,"
        f" {1e3 * found.after_m:.1f} mm now; moved by {1e3 * math.hypot(*found.shift_m):.1f} mm and"
        f" {math.degrees(Rotation.from_matrix(found.turn).magnitude()):.1f}°; standard deviations at the arm {sds};"
        f" at worst {1e3 * worst_m:.1f} mm and {math.degrees(worst_rad):.2f}°"
    )
    remedy = None if len(looks) >= _ENOUGH_POSES else "more poses: move the arm by its own pendant, and --seconds 60"
    if not arm_known:
        said, remedy = f"{said}; the arm is taken to stand as its model starts", "give --arm"
    return Check(what, None if remedy else True, said, remedy), mount_lines(name, found.corrected(mount))


def mount_lines(name: str, mount: LinkMount) -> str:
    """Return the lines of a camera's mount for the --config file."""
    place, turn = (", ".join(f"{value:.6f}" for value in some) for some in (mount.position_m, mount.quaternion))
    key, link = (json.dumps(text, ensure_ascii=False) for text in (name, mount.link))
    return f"[depth.mounts.{key}]\nlink = {link}\nposition_m = [{place}]\nquaternion = [{turn}]"
