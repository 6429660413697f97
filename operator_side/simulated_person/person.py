"""A scripted person who sees late, steers with a person's limits, and feels the triggers with their fingers.

They see only what the screen shows, `visual_reaction_s` after it was shown, and the controller's warning light, and
act only through the controller: a finger pushes with a force, and how far the trigger yields is up to its spring and
its effect. So haptics act on this person mechanically and at once: where the trigger stiffens, the same force travels
less, and they never push harder for it. Figures: the operator's table of facts (McRuer's crossover model; reaction
times).

    wait ─▶ arm ─▶ advance ─▶ close ─▶ lift ─▶ done
                     ▲          │ nothing held
                     └─ retreat ◀
"""

import math
from collections import deque
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from common.protocol.messages import Telemetry, Vector2, Vector3
from operator_side.dualsense.reports.controller_state import SENSED_TRAVEL, Button
from operator_side.dualsense.reports.output_report import WARNING_LIGHT
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.dualsense.simulated.trigger_model import (
    NORMAL_FINGER_FORCE_N,
    SPRING_PRELOAD_N,
    SPRING_RISE_N,
)
from operator_side.hands.button_map import Action, button_of
from operator_side.hands.travel_calibration import TravelCalibration

FULL_TRIGGER_M_S = 0.25
"""What a person has learnt a fully pulled trigger to do."""
FULL_STICK_M_S = 0.1
"""And a fully deflected stick."""
_DROPPED_S = 0.5
"""After so long without the target in the fingers they believe it."""
_CALM_S = 0.5
"""So long after the controller's warning light they let their hands rest."""

Phase = Literal["wait", "arm", "advance", "close", "retreat", "lift", "done"]
_DOING: Final[dict[Phase, str]] = {
    "wait": "resting",
    "arm": "arming",
    "advance": "advancing",
    "close": "grasping",
    "retreat": "retreating",
    "lift": "lifting",
    "done": "done",
}


@dataclass(frozen=True)
class PersonSettings:
    """A person's limits; every value is an assumption that can be set."""

    visual_reaction_s: float = 0.25
    """From the screen to the hand in continuous tracking (the crossover model's τ)."""
    phase_margin_rad: float = math.radians(65)
    """How cautiously the person tunes themselves to the delay that they experience: 45° is tracking, and 69°
    (gain times lag 1/e) aims without any overshoot."""
    adapts_to_delay: bool = True
    """Whether they tune themselves to the link's delay at all, or act as they would without one."""
    depth_error_sd_m: float = 0.008
    """Misjudged distance to the target along the line of sight, drawn anew at each attempt."""
    attempts: int = 3
    """How often they try to grasp before they give up."""
    grasp_depth_m: float = 0.02
    """How far past the point between the fingertips they bring the target's centre: well in, up to the palm."""
    lift_m: float = 0.1

    def __post_init__(self) -> None:
        for name in ("visual_reaction_s", "depth_error_sd_m", "grasp_depth_m", "lift_m"):
            if not 0.0 <= getattr(self, name) < 10.0:
                raise ValueError(f"{name} = {getattr(self, name)}; valid: 0 to below 10")
        # From 90° on a person would not correct what they see, or make it worse.
        if not 0.0 <= self.phase_margin_rad < math.pi / 2:
            raise ValueError(f"phase_margin_rad = {self.phase_margin_rad}; valid: 0 to below pi / 2")
        if self.attempts < 1:
            raise ValueError(f"attempts = {self.attempts}; valid: 1 or more")


@dataclass(frozen=True)
class Glance:
    """What a phase decides on."""

    now_s: float
    view: Telemetry
    gain: float
    """How fast to correct a seen error, in 1/s."""


class SimulatedOperator:
    """Drives a `SimulatedDualSense` towards the target, grasps it and lifts it."""

    _ALIGNED_M = 0.006
    _REACHED_M = 0.008

    def __init__(
        self,
        device: SimulatedDualSense,
        settings: PersonSettings,
        seed: int,
        calibration: TravelCalibration | None = None,
        *,
        swap_sides: bool = False,
    ) -> None:
        self.phase: Phase = "wait"
        self._device = device
        self._settings = settings
        self._generator = np.random.default_rng(np.random.SeedSequence([seed, 0x0B5E]))
        self._seen: deque[tuple[float, Telemetry]] = deque()
        self._view: Telemetry | None = None
        self._since_s = 0.0
        self._attempt = 0
        self._depth_error_m = 0.0
        self._lift_from: Vector3 | None = None
        self._holding_s = 0.0
        self._calibration = calibration or TravelCalibration()
        self._swap_sides = swap_sides
        self._began = False
        self._warned_s = -math.inf

    @property
    def doing(self) -> str:
        """Their phase in a word for people; without a target they do not seem to advance."""
        aimless = self.phase == "advance" and self._view is not None and self._view.target_in_tool_m is None
        return "no target" if aimless else _DOING[self.phase]

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """Look at the screen and move the hands; `delay_s` is the round trip that the person has got used to."""
        if not self._began:
            self._began, self._since_s = True, now_s
        if screen is not None and (not self._seen or self._seen[-1][1] is not screen):
            self._seen.append((now_s, screen))
        while self._seen and self._seen[0][0] <= now_s - self._settings.visual_reaction_s:
            self._view = self._seen.popleft()[1]
        if self._device.output.lightbar == WARNING_LIGHT:
            self._warned_s = now_s
        if self._view is None or now_s - self._warned_s < _CALM_S:
            self._hands(0.0, (0.0, 0.0))
            return
        if self._view.state != "armed" and self.phase not in ("wait", "arm", "done"):
            self._enter("wait", now_s)
        getattr(self, f"_{self.phase}")(Glance(now_s, self._view, self._gain(delay_s)))

    def _gain(self, delay_s: float) -> float:
        """Crossover frequency in 1/s: as fast as the delay in the loop allows, at most 4.5."""
        lag_s = self._settings.visual_reaction_s + (delay_s if self._settings.adapts_to_delay else 0.0)
        if lag_s <= 0.0:
            return 4.5
        return min(4.5, (math.pi / 2 - self._settings.phase_margin_rad) / lag_s)

    def _enter(self, phase: Phase, now_s: float) -> None:
        self.phase = phase
        self._since_s = now_s

    def _wait(self, look: Glance) -> None:
        """Rest the hands for the healthy second that arming asks for."""
        self._hands(0.0, (0.0, 0.0))
        if look.now_s - self._since_s > 1.2 + self._settings.visual_reaction_s:
            self._enter("arm", look.now_s)

    def _arm(self, look: Glance) -> None:
        pressing = look.now_s - self._since_s < 0.2
        self._hands(0.0, (0.0, 0.0), {Button.OPTIONS} if pressing else set())
        if look.view.state == "armed":
            self._judge_depth()
            self._enter("advance", look.now_s)
        elif look.now_s - self._since_s > 2.0:
            self._enter("wait", look.now_s)

    def _judge_depth(self) -> None:
        self._depth_error_m = float(self._generator.normal(0.0, self._settings.depth_error_sd_m))

    def _advance(self, look: Glance) -> None:
        """Centre the target with the stick, then pull R2 until it seems to lie between the fingers."""
        if look.view.target_in_tool_m is None:
            self._hands(0.0, (0.0, 0.0))
            return
        across = look.view.target_in_tool_m[:2]
        depth_m = look.view.target_in_tool_m[2] + self._settings.grasp_depth_m + self._depth_error_m
        off_m = math.hypot(*across)
        stick = self._deflection(across, look.gain)
        aligned = off_m < self._ALIGNED_M
        if aligned and abs(depth_m) < self._REACHED_M:
            self._enter("close", look.now_s)
        # Off the line a person slows down; far off, they centre first.
        eagerness = max(0.0, 1.0 - off_m / (3 * self._ALIGNED_M))
        self._hands(eagerness * look.gain * depth_m / FULL_TRIGGER_M_S, stick)

    def _close(self, look: Glance) -> None:
        self._hands(0.0, (0.0, 0.0), {Button.CROSS})
        if look.view.holding and look.now_s - self._since_s > 0.3:
            self._lift_from, self._holding_s = look.view.tool_position_m, look.now_s
            self._enter("lift", look.now_s)
        elif look.now_s - self._since_s > 2.5 + 2 * self._settings.visual_reaction_s:
            self._attempt += 1
            self._enter("retreat" if self._attempt < self._settings.attempts else "done", look.now_s)

    def _retreat(self, look: Glance) -> None:
        """Open, draw back a little, and look again."""
        self._hands(-0.4, (0.0, 0.0), {Button.SQUARE})
        if look.now_s - self._since_s > 1.0:
            self._judge_depth()
            self._enter("advance", look.now_s)

    def _lift(self, look: Glance) -> None:
        """Move against gravity, whichever way the tool points."""
        up = look.view.up_in_tool
        risen_m = 0.0
        if self._lift_from is not None:
            risen_m = math.dist(look.view.tool_position_m, self._lift_from)
        if look.view.holding:
            self._holding_s = look.now_s
        dropped = look.now_s - self._holding_s > _DROPPED_S
        if risen_m > self._settings.lift_m or dropped:
            self._enter("done", look.now_s)
        # Half speed: a person carries with care.
        self._hands(0.5 * up[2], (0.5 * up[0], -0.5 * up[1]), {Button.CROSS})

    def _done(self, look: Glance) -> None:
        self._hands(0.0, (0.0, 0.0), {Button.CROSS} if look.view.holding else set())

    @staticmethod
    def _deflection(across_m: tuple[float, ...], gain: float) -> Vector2:
        """The stick that centres a target seen at `across_m`; the tool's y axis points down the screen."""
        x, y = (gain * component / FULL_STICK_M_S for component in across_m)
        return _within_unit_circle(x, -y)

    def _hands(self, advance: float, stick: Vector2, buttons: AbstractSet[Button] = frozenset()) -> None:
        """Pull R2 (advance > 0) or L2 as far as the person means to, 0 to 1; hold-to-run is always held.

        With the sides swapped, it is the other one of everything. They know by habit which force that takes on a free
        trigger, and push with that one, whatever the trigger does.
        """
        meant = min(1.0, abs(advance))
        trigger = int((advance > 0) != self._swap_sides)
        force_n = 0.0
        if meant > 0.0:
            calibrated = self._calibration.r2 if trigger == 1 else self._calibration.l2
            force_n = SPRING_PRELOAD_N + SPRING_RISE_N * SENSED_TRAVEL * calibrated.raw(meant)
            force_n = min(force_n, NORMAL_FINGER_FORCE_N)
        self._device.set_finger_force(force_n if trigger == 0 else 0.0, force_n if trigger == 1 else 0.0)
        across = self._beyond_dead_zone(stick)
        if self._swap_sides:
            self._device.set_sticks(right=across)
        else:
            self._device.set_sticks(left=across)
        run = button_of(swap_sides=self._swap_sides)[Action.RUN]
        self._device.set_buttons(frozenset({run, *buttons}))

    def _beyond_dead_zone(self, stick: Vector2) -> Vector2:
        """A hand learns where a stick begins to act."""
        radius = math.hypot(*stick)
        if radius < 1e-3:
            return (0.0, 0.0)
        dead = (self._calibration.right_stick if self._swap_sides else self._calibration.left_stick).dead_zone
        scale = (dead + (1.0 - dead) * radius) / radius
        return _within_unit_circle(stick[0] * scale, stick[1] * scale)


def _within_unit_circle(x: float, y: float) -> Vector2:
    radius = max(1.0, math.hypot(x, y))
    return (x / radius, y / radius)
