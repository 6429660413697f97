"""What a scripted person can do, sees wrongly and believes: every value is an assumption that can be set."""

import math
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class PersonSettings:
    """A person's limits; every value is an assumption that can be set."""

    visual_reaction_s: float = 0.25
    """From the screen to the hand in continuous tracking (the crossover model's τ)."""
    touch_reaction_s: float = 0.30
    """From what a finger feels to the hand, the mean; drawn anew for each cue, lognormal."""
    touch_reaction_sd_s: float = 0.05
    """Its standard deviation."""
    noticeable_force: float = 0.07
    """The least share of a finger's force that is noticed when a trigger resists by it (Pang, Tan and Durlach 1991)."""
    trust: float = 1.0
    """The share of cues, stiff triggers and rumble, that they believe and slow down for; with 0 only the mechanics of
    the trigger act."""
    phase_margin_rad: float = math.radians(65)
    """How cautiously the person tunes themselves to the delay that they experience: 45° is tracking, and 69°
    (gain times lag 1/e) aims without any overshoot."""
    adapts_to_delay: bool = True
    """Whether they tune themselves to the link's delay at all, or act as they would without one."""
    aiming: Literal["servo", "move-and-wait"] = "servo"
    """How they get to the target: by correcting all the time, or in single moves, waiting after each until the screen
    shows what came of it (Ferrell 1965)."""
    depth_error_sd_m: float = 0.008
    """Misjudged distance to the target along the line of sight, and of the height at which a carried thing will stand;
    drawn anew at each attempt."""
    depth_error_mean_m: float = 0.0
    """Above 0: things seem farther away than they are."""
    attempts: int = 3
    """How often they try to grasp before they give up."""
    grasp_depth_m: float = 0.02
    """How far past the point between the fingertips they bring the target's centre: well in, up to the palm."""
    lift_m: float = 0.1
    carry_m: float = 0.06
    """How far back, towards the robot, they carry it before they set it down."""
    pull_n: float | None = None
    """Instead of all this: arm, then pull R2 with so many newtons and go on, whatever is felt or seen. 2 is a light
    pull, 3.7 a normal one."""

    def __post_init__(self) -> None:
        lengths = ("depth_error_sd_m", "grasp_depth_m", "lift_m", "carry_m")
        for name in ("visual_reaction_s", "touch_reaction_sd_s", *lengths):
            if not 0.0 <= getattr(self, name) < 10.0:
                raise ValueError(f"{name} = {getattr(self, name)}; valid: 0 to below 10")
        if not 0.0 < self.touch_reaction_s < 10.0:
            raise ValueError(f"touch_reaction_s = {self.touch_reaction_s}; valid: above 0 to below 10")
        if not -1.0 <= self.depth_error_mean_m <= 1.0:
            raise ValueError(f"depth_error_mean_m = {self.depth_error_mean_m}; valid: -1 to 1")
        for name in ("noticeable_force", "trust"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} = {getattr(self, name)}; valid: 0 to 1")
        # From 90° on a person would not correct what they see, or make it worse.
        if not 0.0 <= self.phase_margin_rad < math.pi / 2:
            raise ValueError(f"phase_margin_rad = {self.phase_margin_rad}; valid: 0 to below pi / 2")
        if self.pull_n is not None and not 0.0 <= self.pull_n <= 20.0:
            raise ValueError(f"pull_n = {self.pull_n}; valid: 0 to 20")
        if self.attempts < 1:
            raise ValueError(f"attempts = {self.attempts}; valid: 1 or more")
