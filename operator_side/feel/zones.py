"""Strength of each of a trigger's ten zones, from the distance in which the gripper can stop at that zone (§4.2).

A zone z commands the speed u. D_z is the distance to standstill if the operator feels the zone, and releases the
trigger one reaction h later:

    u = (x_z - x_other) v_max                                  x_z: calibrated travel at the zone's middle
    D_z = δ + u h + u²/2a + max(0, w - u)²/2a                  δ, w: Displacement along the trigger's direction

A zone's strength is the number of onset distances that are at most D_z, and never less than the strength of the zone
before. So the first stiff zone shows how far the trigger may be pulled before the gripper comes too near.
"""

from bisect import bisect_right
from collections.abc import Sequence
from typing import Final, NamedTuple

from common.protocol.messages import StiffnessUpdate, TriggerField
from common.reaction import HORIZON_S
from common.touch_speed import touch_speed_m_s
from operator_side.controller.feel import FREE_TRIGGER, MAX_STRENGTH, SENSED_TRAVEL, ZONE_COUNT, Strengths
from operator_side.feel.commands_under_way import Displacement
from operator_side.hands.travel_calibration import TriggerTravel


class Zones(NamedTuple):
    """Strengths of one trigger's ten zones."""

    strengths: Strengths
    """Strength of each zone, 0 to 8; it never falls from a zone to the next"""
    beyond_horizon: int
    """Number of zones with full strength because D_z exceeds the horizon."""

    def at_least(self, others: "Zones", most: int) -> "Zones":
        """Raise each zone's strength to its strength in `others` or to `most`, whichever is lower; never reduce it."""
        strengths = (max(mine, min(other, most)) for mine, other in zip(self.strengths, others.strengths, strict=True))
        return Zones(tuple(strengths), max(self.beyond_horizon, others.beyond_horizon))


FREE: Final = Zones(FREE_TRIGGER, 0)


def zone_travels(travel: TriggerTravel) -> tuple[float, ...]:
    """Return the calibrated travel at the middle of each zone; 1 for zones beyond a full pull."""
    middles = ((zone + 0.5) / ZONE_COUNT for zone in range(ZONE_COUNT))
    return tuple(travel.travel(min(middle / SENSED_TRAVEL, 1.0)) for middle in middles)


def moving_along(update: StiffnessUpdate, known: Displacement | None) -> tuple[Displacement, Displacement]:
    """Return the Displacement along L2's direction and along R2's.

    known: Displacement along R2's direction by our commands; None to use the robot side's in `update`.
    """
    if known is None:
        speed_m_s = update.speed_m_s
        return Displacement(update.l2.displacement_m, -speed_m_s), Displacement(update.r2.displacement_m, speed_m_s)
    return Displacement(-known.displacement_m, -known.speed_m_s), known


def needed_m(field: TriggerField, speed_m_s: float, moving: Displacement, horizon_s: float = HORIZON_S) -> float:
    """Compute D_z of this file for a zone that commands `speed_m_s`, 0 or more."""
    excess_m_s = max(0.0, moving.speed_m_s - speed_m_s)
    stopping_m = (speed_m_s**2 + excess_m_s**2) / (2.0 * field.acceleration_m_s2)
    return moving.displacement_m + speed_m_s * horizon_s + stopping_m


def zone_strengths(
    field: TriggerField,
    horizon_m: float,
    travels: Sequence[float],
    other_travel: float,
    moving: Displacement,
    horizon_s: float = HORIZON_S,
) -> Zones:
    """Compute the strengths of the zones.

    travels: calibrated travel at the middle of each zone. other_travel: that of the other trigger; zones up to it
    command no motion along this trigger's direction and are free. horizon_m: horizon of `field`; a zone whose D_z
    exceeds it has full strength. horizon_s: reaction h.
    """
    full_m_s = field.full_speed_m_s
    fastest_m_s = max(0.0, (travels[-1] - other_travel) * full_m_s)
    excess_m_s = max(0.0, moving.speed_m_s)
    # No zone's D_z exceeds the one with the fastest zone's speed and the whole excess speed together.
    most_m = moving.displacement_m + fastest_m_s * horizon_s
    most_m += (fastest_m_s**2 + excess_m_s**2) / (2.0 * field.acceleration_m_s2)
    if most_m <= horizon_m and most_m < field.fast_m[0] and most_m < field.slow_m[0]:
        return FREE
    touch_m_s = touch_speed_m_s(full_m_s)
    strengths: list[int] = []
    strength = beyond = 0
    first = True
    for travel in travels:
        speed_m_s = (travel - other_travel) * full_m_s
        if speed_m_s > 0.0:
            onsets = field.slow_m if first or speed_m_s < touch_m_s else field.fast_m
            first = False
            ahead_m = needed_m(field, speed_m_s, moving, horizon_s)
            if ahead_m > horizon_m:
                beyond += 1
                strength = MAX_STRENGTH
            else:
                strength = max(strength, bisect_right(onsets, ahead_m))
        strengths.append(strength)
    return Zones(tuple(strengths), beyond)
