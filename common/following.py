"""Model, for both sides, of an arm that follows commands: its speed changes at a bounded acceleration."""

import math

import numpy as np

from common.arrays import FloatArray


def follow(
    displacement_m: float, speed: float, target: float, acceleration: float, duration_s: float
) -> tuple[float, float]:
    """Return displacement and speed after the speed has approached `target` for `duration_s`, at `acceleration`.

    `displacement_m` and `speed` are the values before, in m and m/s.
    """
    changing_s = abs(target - speed) / acceleration
    if changing_s > duration_s:
        after = speed + math.copysign(acceleration * duration_s, target - speed)
        return displacement_m + 0.5 * (speed + after) * duration_s, after
    return displacement_m + 0.5 * (speed + target) * changing_s + target * (duration_s - changing_s), target


def follow_together(
    followed: FloatArray, target: FloatArray, changes_s: FloatArray, duration_s: float
) -> tuple[FloatArray, FloatArray]:
    """Model the arm as it follows trigger and sticks (5,) from `followed` towards `target` for `duration_s`.

    Return the followed trigger and sticks (5,) integrated over that time, and their values at its end (5,). changes_s:
    K (n, 5), for n joints. A change Δ takes the time max |K Δ| and is linear: the slowest joint limits all.
    """
    change = target - followed
    takes_s = float(np.abs(changes_s @ change).max())
    if takes_s > duration_s:
        then = followed + duration_s / takes_s * change
        return 0.5 * duration_s * (followed + then), then
    return duration_s * target - 0.5 * takes_s * change, target
