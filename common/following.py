"""The model of an arm that both sides reckon with: it goes towards a commanded speed at a bounded acceleration."""

import math


def follow(way_m: float, speed: float, target: float, acceleration: float, duration_s: float) -> tuple[float, float]:
    """Way and speed after `duration_s` towards the speed `target`, changing by at most `acceleration`."""
    changing_s = abs(target - speed) / acceleration
    if changing_s > duration_s:
        after = speed + math.copysign(acceleration * duration_s, target - speed)
        return way_m + 0.5 * (speed + after) * duration_s, after
    return way_m + 0.5 * (speed + target) * changing_s + target * (duration_s - changing_s), target
