"""Whether nothing is near: then looks from waypoints and probes would find nothing, and none are made.

One bound holds for all of these looks: gripper, its path and the stick's, the distance examined, and errors.
"""

import math

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray
from common.reaction import HORIZON_S
from robot_side.enlargement.distance import Uncertainty
from robot_side.field.look import MARGIN_M
from robot_side.field.object_class import SKIPPED
from robot_side.field.object_errors import largest_errors, object_errors
from robot_side.laws.gripper_motion import GripperMotion
from robot_side.laws.prospect import BETWEEN_S, BEYOND_M, Assumed
from robot_side.surroundings.blocks import TOGETHER
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable
from robot_side.tick.situation import Situation

_MOST_BLOCKS = 8
"""Number of near blocks of objects from which on something counts as near without a test of each object"""
_LATER = 1.06
"""Factor of T, the time until the arm stands, because probes are kept while T changes by 5 %"""


def farthest_m(situation: Situation, motion: GripperMotion, assumed: Assumed, encoder_sigma_rad: FloatArray) -> float:
    """Return a distance from the tool; objects at rest beyond it have no effect on a look from any waypoint or probe.

    It is a sum of upper bounds, for any direction. encoder_sigma_rad (n,): σ_θ.
    """
    pose, age_s, limits, speeds = situation.pose, situation.loop_age_s, assumed.limits, assumed.motion
    full_speed_m_s, jacobian = speeds.trigger_speed_m_s, pose.tool_jacobian
    # No joint moves faster than at its limit, so none needs longer to change its speed.
    change_s = float((limits.velocity_rad_s / limits.acceleration_rad_s2).max())
    until_s = _LATER * (age_s + HORIZON_S + change_s)
    fingers_m_s = 0.0 if motion.fingers_m_s is None else _longest(motion.fingers_m_s)
    levers_m = _longest(pose.sphere_centers_m - pose.tool_position_m) + until_s * fingers_m_s
    turned_rad_s = math.sqrt(motion.turning_rad_s @ motion.turning_rad_s)
    path_m = until_s * (motion.speed_m_s + fingers_m_s + turned_rad_s * levers_m)
    to_probe_m = until_s * max(speeds.stick_speed_m_s, speeds.turn_speed_rad_s * levers_m)
    examined_m = full_speed_m_s * (age_s + HORIZON_S + 0.5 * change_s + BETWEEN_S) + BEYOND_M
    by_trigger_m = max(examined_m, abs(motion.ahead_m_s) * age_s)
    per_rad_m = np.sqrt((jacobian[:3] ** 2).sum(axis=0)) + levers_m * np.sqrt((jacobian[3:] ** 2).sum(axis=0))
    missed = assumed.uncertainty
    mean_m, sd_m = missed.prediction.at(situation.compensation, age_s, full_speed_m_s)
    late_m = abs(situation.astray_m_s) * (age_s + change_s) + situation.later_s * full_speed_m_s
    unseen_m, variance_m2 = largest_errors(object_errors(situation.objects, missed), missed)
    mean_m = unseen_m + abs(mean_m) + math.hypot(*missed.mean_m) + late_m
    sd_m = math.hypot(_length(encoder_sigma_rad * per_rad_m), math.sqrt(variance_m2), sd_m)
    # Twice: errors inflate the spheres, and those along the motion shorten the way.
    errors_m = 2.0 * (mean_m + abs(missed.quantile) * sd_m)
    radius_m = float(pose.sphere_radii_m.max(initial=0.0))
    return levers_m + radius_m + max(path_m, to_probe_m) + by_trigger_m + MARGIN_M + errors_m


def misplaced_m(objects: PerceivedObjects, uncertainty: Uncertainty) -> float:
    """Return a distance by which objects may be nearer than they are perceived: errors of camera and kinematics."""
    unseen_m, variance_m2 = largest_errors(object_errors(objects, uncertainty), uncertainty)
    return (
        float(np.linalg.norm(uncertainty.mean_m)) + unseen_m + max(uncertainty.quantile, 0.0) * math.sqrt(variance_m2)
    )


def nothing_within(scene: SceneTable, classes: IntArray, center_m: FloatArray, reach_m: float) -> bool:
    """Return whether no object that is felt lies within `reach_m` of a point, and none moves.

    classes (k,): the objects'. A crowd may count as near though it is not.
    """
    velocities_m_s = scene.objects.velocities_m_s
    if velocities_m_s is not None and velocities_m_s.any():
        return False
    blocks = np.flatnonzero(_near(scene.block_bounds, center_m, reach_m))
    if len(blocks) == 0 or len(blocks) > _MOST_BLOCKS:
        return len(blocks) == 0
    places = (blocks[:, None] * TOGETHER + np.arange(TOGETHER)).ravel()
    places = places[places < len(scene.object_order)]
    felt = classes[scene.object_order[places]] != SKIPPED
    return not (felt & _near(scene.ordered_bounds[places], center_m, reach_m)).any()


def _near(bounds: FloatArray, center_m: FloatArray, reach_m: float) -> BoolArray:
    offsets_m = bounds[:, :3] - center_m
    # What is not a number is near.
    far: BoolArray = np.einsum("bi,bi->b", offsets_m, offsets_m) > (1.0 + 1e-9) * (bounds[:, 3] + reach_m) ** 2
    return ~far


def _length(vector: FloatArray) -> float:
    return math.sqrt(float(vector @ vector))


def _longest(vectors: FloatArray) -> float:
    return math.sqrt(float(np.einsum("mi,mi->m", vectors, vectors).max(initial=0.0)))
