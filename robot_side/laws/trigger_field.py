"""Field along one trigger, and the rumble, from onset distances."""

from bisect import bisect_right

import numpy as np

from common.arrays import FloatArray
from common.protocol.messages import TriggerField
from common.reaction import HORIZON_S
from robot_side.arm.ability import Ability
from robot_side.laws.law import MOST_M
from robot_side.tick.sensed import STRENGTHS


def trigger_field(onsets_m: FloatArray, able: Ability, displacement_m: float, horizon_m: float) -> TriggerField:
    """Return the field of onset distances (2, 8), fast and slow list, which are cut to the horizon.

    displacement_m: δ, along this trigger, as the robot side computes it.
    """
    fast_m, slow_m = np.maximum(np.minimum(onsets_m, min(horizon_m, MOST_M)), -MOST_M).tolist()
    displacement_m = min(max(displacement_m, -MOST_M), MOST_M)
    return TriggerField(
        fast_m=tuple(fast_m),
        slow_m=tuple(slow_m),
        full_speed_m_s=able.full_speed_m_s,
        acceleration_m_s2=able.acceleration_m_s2,
        displacement_m=displacement_m,
        course_stiffness=bisect_right(fast_m, displacement_m) / STRENGTHS,
    )


def rumble(onsets_m: FloatArray, able: Ability, speed_m_s: float, touch_speed_m_s: float, loop_age_s: float) -> float:
    """Return the share of strengths that begin within D = u (t_d + h) + u²/2a along the stick (eq. 8).

    onsets_m (2, 8): those along the stick. speed_m_s: u, which the stick commands. Below the touch speed the slow list
    counts.
    """
    reach_m = speed_m_s * (loop_age_s + HORIZON_S) + speed_m_s * speed_m_s / (2.0 * able.acceleration_m_s2)
    begun = onsets_m[1 if speed_m_s < touch_speed_m_s else 0] <= reach_m
    return float(np.count_nonzero(begun)) / STRENGTHS
