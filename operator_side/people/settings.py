"""Abilities, errors and beliefs of a scripted person: every value is an assumption that can be set."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from common.limits import Limited, Share

_Usual = Annotated[float, Meta(ge=0.0, lt=10.0)]
"""Metres or seconds in a person's range"""


@dataclass(frozen=True)
class PersonSettings(Limited):
    """Limits of a person; every value is an assumption that can be set."""

    visual_reaction_s: _Usual = 0.25
    """Delay from the screen to the hand in continuous tracking (the crossover model's τ)."""
    touch_reaction_s: Annotated[float, Meta(gt=0.0, lt=10.0)] = 0.30
    """Mean delay from the finger's sensation to the hand; drawn for each cue, lognormal."""
    touch_reaction_sd_s: _Usual = 0.05
    """Standard deviation of that delay."""
    noticeable_force: Share = 0.07
    """Least share of a finger's force at which resistance is noticed (Pang, Tan and Durlach 1991)."""
    trust: Share = 1.0
    """Share of cues, stiff triggers and rumble, that they believe and slow down for; at 0 only the trigger's mechanics
    act."""
    phase_margin_rad: Annotated[float, Meta(ge=0.0, lt=math.pi / 2)] = math.radians(65)
    """Caution in adapting to the delay that they experience: 45° is tracking; 69° (gain times lag 1/e) aims without
    overshoot. From 90° on they would not correct what they see."""
    adapts_to_delay: bool = True
    """Whether they adapt to the link's delay, or act as without one."""
    aiming: Literal["servo", "move-and-wait"] = "servo"
    """Approach to the target: servo corrects all the time; move-and-wait makes single moves and waits until the screen
    shows each outcome (Ferrell 1965)."""
    depth_error_sd_m: _Usual = 0.008
    """Standard deviation of judged distances: to the target along the line of sight, and to the place where a carried
    object will stand; drawn at each attempt."""
    depth_error_mean_m: Annotated[float, Meta(ge=-1.0, le=1.0)] = 0.0
    """Mean error in judging distance; above 0 objects seem farther away than they are."""
    attempts: Annotated[int, Meta(ge=1)] = 3
    """Number of grasps before they give up."""
    grasp_depth_m: _Usual = 0.02
    """Distance of the target's centre past the point between the fingertips: well in, up to the palm."""
    lift_m: _Usual = 0.1
    carry_m: _Usual = 0.06
    """Distance back, towards the robot, before they set it down."""
    pull_n: Annotated[float, Meta(ge=0.0, le=20.0)] | None = None
    """Force on R2, in N: arm, then pull with it for good, instead of all other behaviour. 2 N is a light pull, 3.7 N a
    normal one."""
