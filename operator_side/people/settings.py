"""A scripted person's abilities, errors and beliefs: every value is an assumption that can be set."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from common.limits import Limited, Share

_Usual = Annotated[float, Meta(ge=0.0, lt=10.0)]
"""Metres or seconds, as people have them."""


@dataclass(frozen=True)
class PersonSettings(Limited):
    """A person's limits; every value is an assumption that can be set."""

    visual_reaction_s: _Usual = 0.25
    """Delay from the screen to the hand in continuous tracking (the crossover model's τ)."""
    touch_reaction_s: Annotated[float, Meta(gt=0.0, lt=10.0)] = 0.30
    """Mean delay from the finger's feeling to the hand; drawn for each cue, lognormal."""
    touch_reaction_sd_s: _Usual = 0.05
    """Standard deviation of that delay."""
    noticeable_force: Share = 0.07
    """The least share of a finger's force that is noticed when a trigger resists by it (Pang, Tan and Durlach 1991)."""
    trust: Share = 1.0
    """The share of cues, stiff triggers and rumble, that they believe and slow down for; with 0 only the mechanics of
    the trigger act."""
    phase_margin_rad: Annotated[float, Meta(ge=0.0, lt=math.pi / 2)] = math.radians(65)
    """Caution in tuning themselves to the delay that they experience: 45° is tracking, and 69°
    (gain times lag 1/e) aims without any overshoot. From 90° on they would not correct what they see."""
    adapts_to_delay: bool = True
    """Whether they tune themselves to the link's delay at all, or act as they would without one."""
    aiming: Literal["servo", "move-and-wait"] = "servo"
    """Way of getting to the target: correcting all the time, or single moves, waiting after each until the screen
    shows what came of it (Ferrell 1965)."""
    depth_error_sd_m: _Usual = 0.008
    """Misjudged distance to the target along the line of sight, and of the height at which a carried thing will stand;
    drawn at each attempt."""
    depth_error_mean_m: Annotated[float, Meta(ge=-1.0, le=1.0)] = 0.0
    """Above 0: things seem farther away than they are."""
    attempts: Annotated[int, Meta(ge=1)] = 3
    """Attempts to grasp before they give up."""
    grasp_depth_m: _Usual = 0.02
    """Distance past the point between the fingertips they bring the target's centre: well in, up to the palm."""
    lift_m: _Usual = 0.1
    carry_m: _Usual = 0.06
    """Distance back, towards the robot, that they carry it before they set it down."""
    pull_n: Annotated[float, Meta(ge=0.0, le=20.0)] | None = None
    """Instead of all this: arm, then pull R2 with this force and go on, whatever is felt or seen. 2 N is a light pull,
    3.7 N a normal one."""
