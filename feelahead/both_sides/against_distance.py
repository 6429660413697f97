"""Strength under the finger against the distance to what is ahead, for any law: the figure of every paper on haptics.

The gripper moves at a constant speed along its approach axis. Camera and encoders are right here; the law assumes their
usual errors all the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import Header, StiffnessUpdate
from feelahead.both_sides.episode import Episode
from operator_side.dualsense.simulated.trigger_model import zone_of
from operator_side.feel.rendering import RenderingSettings, TriggerRendering
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from robot_side.arm.port import GripperPose
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.laws.paper_settings import PAPERS
from robot_side.parts import as_loaded
from robot_side.surroundings.perceived import displaced
from robot_side.tick.situation import Situation

_APART_S: Final = 1.0
"""Time from one distance to the next, in seconds: nothing that a law or a trigger remembers lasts so long"""
_COLOURS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#000000")
_LINES: Final = ("-", "--", ":", "-.")


@dataclass(frozen=True)
class Course:
    """Strength of one law at one speed."""

    law: str
    """Name of the law, or of its file; the paper's with its settings"""
    speed_m_s: float
    distance_m: FloatArray
    """(n,) way along the approach axis to the first contact"""
    strength: FloatArray
    """(n,) strength, 0 to 8, of R2's zone that commands this speed"""


def strength_against_distance(
    law: str,
    speeds_m_s: Sequence[float],
    *,
    loop_age_s: float,
    farthest_m: float = 0.15,
    step_m: float = 0.001,
    **place: Any,
) -> list[Course]:
    """Return a course for each speed. place: scene, or model, site and site_axis, as for an Episode.

    loop_age_s: t_d of eq. 8, which is known. ConfigurationError if nothing is ahead within a metre.
    """
    episode = Episode(law=law, sampled=False, **place)
    parts, scene, v_max_m_s = episode.parts, episode.scene, episode.settings.motion.trigger_speed_m_s
    pose: GripperPose = parts.kinematics.pose(parts.arm.state(0.0))
    axis = pose.tool_rotation[:, 2]
    way_m = TrueContact(scene).way_left_m(axis, None)
    objects = as_loaded(scene, scene.roles)
    across = np.linalg.pinv(pose.tool_jacobian)
    distances_m = np.arange(farthest_m, -0.5 * step_m, -step_m)
    courses, now_s = [], 0.0
    named = f"{law} ({episode.settings.paper})" if law in PAPERS else Path(law).stem
    for speed_m_s in speeds_m_s:
        rates_rad_s = np.ascontiguousarray(across @ np.concatenate([speed_m_s * axis, np.zeros(3)]))
        rendering, travel = TriggerRendering(RenderingSettings(), TravelCalibration()), min(speed_m_s / v_max_m_s, 1.0)
        strengths = []
        for distance_m in distances_m:
            now_s += _APART_S
            there = displaced(objects, (distance_m - way_m) * axis)
            known = loop_age_s, True, True
            situation = Situation(pose, rates_rad_s, there, *known, "robot", None, None, (0.0, 0.0))
            sensed = parts.law.sense(situation, now_s)
            field = sensed.l2, sensed.r2, sensed.speed_m_s, sensed.horizon_m, sensed.rumble
            header = Header(epoch=1, sequence=0, sent_s=0.0)
            feel = rendering.render(StiffnessUpdate(header, *field, "armed"), (0.0, travel), None, now_s)
            raw = TriggerTravel().raw(travel)
            strengths.append(0 if feel.r2 is None else feel.r2[zone_of(raw)])
        courses.append(Course(named, speed_m_s, distances_m, np.array(strengths, dtype=float)))
    return courses


def draw_courses(courses: dict[str, list[Course]], out: Path) -> None:
    """Draw a panel for each place, a colour for each law, a line style for each speed, into `out`."""
    import matplotlib as mpl  # noqa: PLC0415

    mpl.use("Agg")
    from matplotlib import pyplot  # noqa: PLC0415

    columns = min(len(courses), 4)
    rows = -(-len(courses) // columns)
    laws = list(dict.fromkeys(one.law for found in courses.values() for one in found))
    speeds = list(dict.fromkeys(one.speed_m_s for found in courses.values() for one in found))
    layout: dict[str, Any] = {"figsize": (3.2 * columns + 0.6, 2.6 * rows + 0.6), "layout": "constrained"}
    figure, axes = pyplot.subplots(rows, columns, sharex=True, sharey=True, squeeze=False, **layout)
    for axis in axes.flat[len(courses) :]:
        axis.set_visible(False)
    for axis, (place, found) in zip(axes.flat, courses.items(), strict=False):
        for one in found:
            looks = _COLOURS[laws.index(one.law) % len(_COLOURS)], _LINES[speeds.index(one.speed_m_s) % len(_LINES)]
            label = f"{one.law}, {1e3 * one.speed_m_s:.0f} mm/s"
            axis.step(1e3 * one.distance_m, one.strength, color=looks[0], linestyle=looks[1], where="post", label=label)
        axis.set(title=place, ylim=(-0.3, 8.3))
        axis.tick_params(labelbottom=True)
    axes.flat[0].invert_xaxis()  # of all, as they share it
    figure.supxlabel("way to the contact (mm)")
    figure.supylabel("strength under the finger (of 8)")
    axes.flat[0].legend(fontsize=7)
    figure.savefig(out, dpi=110, metadata={"Software": None} if out.suffix == ".png" else None)
    pyplot.close(figure)
