"""Model of an arm that both sides use: it approaches a commanded speed at a bounded acceleration."""

import math

import numpy as np

from common.arrays import FloatArray


def follow(
    displacement_m: float, speed: float, target: float, acceleration: float, duration_s: float
) -> tuple[float, float]:
    """Return position and speed after `duration_s` towards the speed `target`, at most at `acceleration`."""
    changing_s = abs(target - speed) / acceleration
    if changing_s > duration_s:
        after = speed + math.copysign(acceleration * duration_s, target - speed)
        return displacement_m + 0.5 * (speed + after) * duration_s, after
    return displacement_m + 0.5 * (speed + target) * changing_s + target * (duration_s - changing_s), target


def follow_together(
    followed: FloatArray, target: FloatArray, changes_s: FloatArray, duration_s: float
) -> tuple[FloatArray, FloatArray]:
    """Integrate and return trigger and sticks (5,) as the arm follows them from `followed` towards `target`, both (5,).

    changes_s: K (n, 5). A change Δ takes the time max |K Δ|, linearly: the slowest joint limits all.
    """
    change = target - followed
    takes_s = float(np.abs(changes_s @ change).max())
    if takes_s > duration_s:
        then = followed + duration_s / takes_s * change
        return 0.5 * duration_s * (followed + then), then
    return duration_s * target - 0.5 * takes_s * change, target
