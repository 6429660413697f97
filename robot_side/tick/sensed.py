"""Result of one tick of a law: a field along each trigger, the rumble, and figures for display."""

import math
from dataclasses import dataclass
from typing import Final

from common.protocol.messages import TriggerField

R2, L2, STICK = range(3)
"""Numbers of the sides along which a law looks: the directions of both triggers and of the deflected stick"""
STRENGTHS: Final = 8


@dataclass(frozen=True, kw_only=True, slots=True)
class Sensed:
    """Result of one tick of a law; ValueError for a figure that is not finite."""

    l2: TriggerField
    """Field for L2: onset distances along its direction, with displacement, stiffness and speeds"""
    r2: TriggerField
    """Field for R2"""
    speed_m_s: float = 0.0
    """Tool's speed along the direction in which R2 advances; negative while it retreats"""
    horizon_m: float = 0.0
    """Distance ahead that is known; both triggers' onset distances are cut to it"""
    rumble: float = 0.0
    """Rumble, 0 to 1 in eighths: the share of strengths that begin within the stopping distance along the stick"""
    enlargement_m: float = 0.0
    """D_incr of eq. 10 along the motion, |v| t_d + D_σ; for the sphere with the largest"""
    tool_speed_m_s: float = 0.0
    """Speed |v| of the tool's point in any direction"""
    cut: bool = False
    """Whether there was too much to look at, so that all strengths begin at once"""

    def __post_init__(self) -> None:
        for name in ("speed_m_s", "horizon_m", "rumble", "enlargement_m", "tool_speed_m_s"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} = {getattr(self, name)}; valid: a finite number")
