"""Settings of the scripted person: abilities, errors and beliefs, all of them assumptions."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from common.limits import Limited, Share

_Usual = Annotated[float, Meta(ge=0.0, lt=10.0)]
"""Metres or seconds in a range that is plausible for a person"""


@dataclass(frozen=True)
class PersonSettings(Limited):
    """Abilities, errors and beliefs of the scripted person; every default is an assumption."""

    visual_reaction_s: _Usual = 0.25
    """Delay from the screen to the hand in continuous tracking, in seconds (τ of McRuer's crossover model)."""
    touch_reaction_s: Annotated[float, Meta(gt=0.0, lt=10.0)] = 0.30
    """Mean delay from a cue at the finger to the hand's reaction, in seconds; drawn for each cue, lognormal."""
    touch_reaction_sd_s: _Usual = 0.05
    """Standard deviation of the delay from a cue to the hand's reaction, in seconds."""
    noticeable_force: Share = 0.07
    """Share of a finger's force above which resistance is noticed (Pang, Tan and Durlach 1991)."""
    trust: Share = 1.0
    """Share of cues (stiff triggers, rumble) that the person believes and slows down for. At 0, haptics act only
    through the trigger's mechanics."""
    phase_margin_rad: Annotated[float, Meta(ge=0.0, lt=math.pi / 2)] = math.radians(65)
    """Phase margin, in rad, with which the person steers: the larger, the more cautious. 45° is usual in tracking. 69°
    (gain times lag = 1/e) aims without overshoot. At 90° a seen error would not be corrected."""
    adapts_to_delay: bool = True
    """Whether the person adapts to the link's delay, or steers as if there were none."""
    aiming: Literal["servo", "move-and-wait"] = "servo"
    """Way to approach the target. servo: correct continuously. move-and-wait: make single moves, and wait after each
    until the screen shows its outcome (Ferrell 1965)."""
    depth_error_sd_m: _Usual = 0.008
    """Standard deviation, in metres, of the error in judging a distance: to the target along the tool axis, and down to
    where a carried object will stand. Drawn at each attempt."""
    depth_error_mean_m: Annotated[float, Meta(ge=-1.0, le=1.0)] = 0.0
    """Mean error in judging a distance, in metres; above 0, objects seem farther away than they are."""
    attempts: Annotated[int, Meta(ge=1)] = 3
    """Number of failed grasps after which the person gives up."""
    grasp_depth_m: _Usual = 0.02
    """Distance, in metres, of the target's centre past the point between the fingertips when the gripper closes."""
    lift_m: _Usual = 0.1
    """Distance by which the person lifts the object, in metres."""
    carry_m: _Usual = 0.06
    """Distance by which the person carries the object back towards the robot before setting it down, in metres."""
    marks: bool = False
    """Whether the person marks the run as an episode: start once armed, then success, or failure if the object was
    dropped or never grasped."""
