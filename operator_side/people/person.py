"""Scripted person who sees with delay, steers with a person's limits, and feels the triggers with their fingers.

They see only the screen, `visual_reaction_s` late, and the controller's warning light. They act only through the
controller: a finger applies a force, and spring and strengths decide how far the trigger yields. So haptics act on this
person mechanically and at once: a stiff trigger travels less under the same force. The person pushes harder only to set
an object down, as they want that contact: while a stiff trigger stops the object above the table, in steps, to 2 N.
They may also believe cues: a trigger that yields less than usual, and rumble. One reaction after such a cue they go on
gently. One reaction after a pulse that signals that the held object stands, they release the object.
Sources of the figures: McRuer's crossover model; measured reaction times.

    rest ─▶ arm ─▶ advance ─▶ grasp ─▶ lift ─▶ carry ─▶ lower ─▶ let go ─▶ draw back ─▶ done
                     ▲          │ nothing held
                     └─ retreat ◀
"""

import math
from collections import deque
from typing import Final

import numpy as np

from common.protocol.messages import Telemetry, Vector2, Vector3
from common.status.codes import Doing
from operator_side.controller.feel import HINDERED_DRIVE, STANDS_DRIVE, WARNING_LIGHT
from operator_side.controller.state import Button
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.hands.button_map import BUTTON_OF, Action
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.fingers import Cue, Fingers, within_unit_circle
from operator_side.people.glances import Glance, StalledApproach, StalledDescent
from operator_side.people.settings import PersonSettings
from operator_side.people.submove import MoveAndWait

FULL_TRIGGER_M_S = 0.25
"""Speed that full travel of a trigger commands, as the person has learnt"""
FULL_STICK_M_S = 0.1
"""Speed that full deflection of a stick commands, as the person has learnt"""
GENTLY_M_S: Final = 0.025
"""Speed after a cue, and when an object is set down"""
_PRESSES_M_S: Final = 0.125
"""Speed that 2 N command with a free trigger: the hardest press when a stiff trigger stops an object above the table"""
_CARRY_M_S: Final = 0.05
"""Maximum speed with a held object"""
_PEAK_M_S: Final = 0.2
_PEAK_ACROSS_M_S: Final = 0.08
"""Maximum speeds of a move in move-and-wait: along the tool axis (first) and across it (second)"""
_DROPPED_S = 0.5
"""Seconds without a held object on the screen after which the person believes that it was dropped"""
_CALM_S = 0.5
"""Seconds for which the person keeps triggers and sticks at rest after the controller's warning light"""
_PRESSES_S: Final = 0.2
"""Time in seconds for which the person presses the button that arms, or that marks an episode"""
_CLEAR_M: Final = 0.01
_CLEARS_S: Final = 3.0
"""Rise before the person draws back (first, in metres), and maximum time for it (second, in seconds)"""
_FROM_ABOVE: Final = -0.5
"""Part of the upward direction along the tool, below which the tool comes from above"""
_HARD: Final = 0.5 * (HINDERED_DRIVE + STANDS_DRIVE)
"""Drive of the right motor above which the person takes a pulse for the one of a held object that stands"""
_BACK_M: Final = 0.1
"""Distance by which the person draws back from an object that was set down, in metres"""

_REST: Final[Vector2] = (0.0, 0.0)


def _marked(before: Doing, after: Doing) -> Action | None:
    """Return the mark of an episode that belongs to a change of phase, if any."""
    if after is Doing.DONE:
        return Action.SUCCESS if before is Doing.DRAWING_BACK else Action.FAILURE
    return Action.START if (before, after) == (Doing.ARMING, Doing.ADVANCING) else None


class SimulatedOperator:
    """Scripted person who drives the gripper to the target, grasps it, lifts it, carries it and sets it down."""

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
        self.phase = Doing.RESTING
        self._device = device
        self._settings = settings
        self._generator = np.random.default_rng(np.random.SeedSequence([seed, 0x0B5E]))
        feeling = np.random.default_rng(np.random.SeedSequence([seed, 0xFEE1]))
        self._stiff, self._rumble, self._pulse = (Cue(settings, feeling) for _ in range(3))
        self._fingers = Fingers(device, calibration or TravelCalibration(), swap_sides=swap_sides)
        self._seen: deque[tuple[float, Telemetry]] = deque()
        self._view: Telemetry | None = None
        self._attempt = 0
        self._depth_error_m = 0.0
        self._from: Vector3 = (0.0, 0.0, 0.0)
        self._gripped_height_m = self._holding_s = self._since_s = 0.0
        self._moves = MoveAndWait()
        self._warned_s = self._marked_s = -math.inf
        self._enter(Doing.RESTING, math.nan)

    @property
    def doing(self) -> Doing:
        """Present phase; NO_TARGET while the person would advance but sees no target."""
        aimless = self.phase is Doing.ADVANCING and self._view is not None and self._view.target_in_tool_m is None
        return Doing.NO_TARGET if aimless else self.phase

    def tick(self, now_s: float, screen: Telemetry | None, delay_s: float) -> None:
        """See the screen, and operate the controller. delay_s: round trip to which the person has adapted."""
        if screen is not None and (not self._seen or self._seen[-1][1] is not screen):
            self._seen.append((now_s, screen))
        while self._seen and self._seen[0][0] <= now_s - self._settings.visual_reaction_s:
            self._view = self._seen.popleft()[1]
        self._feel(now_s)
        if now_s - self._marked_s > _PRESSES_S:
            self._fingers.also = frozenset()
        view = None if now_s - self._warned_s < _CALM_S else self._view
        if math.isnan(self._since_s) or (view is None and self.phase in (Doing.RESTING, Doing.ARMING)):
            self._enter(Doing.RESTING, now_s)
        if view is None:
            self._fingers.do(0.0, _REST)
            return
        if view.state != "armed" and self.phase not in (Doing.RESTING, Doing.ARMING, Doing.DONE):
            self._enter(Doing.RESTING, now_s)
        lag_s = self._settings.visual_reaction_s + (delay_s if self._settings.adapts_to_delay else 0.0)
        # Crossover frequency in 1/s: as high as the delay in the loop allows, at most 4.5.
        gain = min(4.5, (math.pi / 2 - self._settings.phase_margin_rad) / lag_s) if lag_s > 0.0 else 4.5
        getattr(self, f"_{self.phase}")(Glance(now_s, view, gain, lag_s))

    def _feel(self, now_s: float) -> None:
        """Feel the cues. One reaction after a cue the person goes gently until the next phase.

        Stiffness makes them go gently along the tool axis, rumble across it.
        """
        self._fingers.let_pass(now_s)
        stiff = self._stiff.acted_on(now_s, self._fingers.resisted_share() > self._settings.noticeable_force)
        rumbles = self._rumble.acted_on(now_s, self._device.rumble.left > 0.0)
        if (stiff and not self._gently_along) or (rumbles and not self._gently_across):
            self._moves.break_off(now_s)
        self._gently_along |= stiff
        self._gently_across |= rumbles
        seeing = self._device.commanded.light != WARNING_LIGHT
        self._warned_s = self._warned_s if seeing else now_s
        self._stands |= self._pulse.acted_on(now_s, seeing and self._device.rumble.right > _HARD)

    def _enter(self, phase: Doing, now_s: float) -> None:
        if self._settings.marks and (action := _marked(self.phase, phase)):
            self._fingers.also, self._marked_s = {BUTTON_OF[action]}, now_s
        self.phase = phase
        self._since_s = now_s
        self._gently_along = self._gently_across = self._stands = False
        self._gently_m_s = GENTLY_M_S
        self._moves.forget()
        self._nearing, self._sinking = StalledApproach(now_s), StalledDescent(now_s)

    def _elapsed_s(self, glance: Glance) -> float:
        return glance.now_s - self._since_s

    def _resting(self, glance: Glance) -> None:
        """Keep all inputs at rest for the second that arming requires, once the screen shows something."""
        self._fingers.do(0.0, _REST)
        if self._elapsed_s(glance) > 1.2:
            self._enter(Doing.ARMING, glance.now_s)

    def _arming(self, glance: Glance) -> None:
        pressing = self._elapsed_s(glance) < _PRESSES_S
        self._fingers.do(0.0, _REST, {Button.OPTIONS} if pressing else set())
        if glance.view.state == "armed":
            self._aim(glance.now_s)
        elif self._elapsed_s(glance) > 2.0:
            self._enter(Doing.RESTING, glance.now_s)

    def _aim(self, now_s: float) -> None:
        self._judge_depth()
        self._enter(Doing.ADVANCING, now_s)

    def _judge_depth(self) -> None:
        settings = self._settings
        self._depth_error_m = float(self._generator.normal(settings.depth_error_mean_m, settings.depth_error_sd_m))

    def _advancing(self, glance: Glance) -> None:
        """Centre the target with the stick, then pull R2 until it seems to be between the fingers."""
        if glance.view.target_in_tool_m is None:
            self._fingers.do(0.0, _REST)
            return
        across = glance.view.target_in_tool_m[:2]
        # From above they grasp above the centre, so that what they lift does not tip over.
        past_m = self._settings.grasp_depth_m * (-1.0 if glance.view.up_in_tool[2] < _FROM_ABOVE else 1.0)
        depth_m = glance.view.target_in_tool_m[2] + past_m + self._depth_error_m
        off_m = math.hypot(*across)
        aligned = off_m < self._ALIGNED_M
        settled = self._settings.aiming == "servo" or self._moves.free(glance.now_s, glance.lag_s)
        if settled and aligned and (abs(depth_m) < self._REACHED_M or self._nearing.see(depth_m, glance)):
            self._enter(Doing.GRASPING, glance.now_s)
            return
        # The farther the target is off the tool axis, the slower the approach; far off, they only centre it.
        eagerness = max(0.0, 1.0 - off_m / (3 * self._ALIGNED_M))
        if self._settings.aiming == "move-and-wait":
            if self._moves.free(glance.now_s, glance.lag_s):
                by_m = (across[0], across[1], depth_m if eagerness > 0.0 else 0.0)
                across_m_s = GENTLY_M_S if self._gently_across else _PEAK_ACROSS_M_S
                self._moves.begin(glance.now_s, by_m, across_m_s, GENTLY_M_S if self._gently_along else _PEAK_M_S)
            self._go(self._moves.velocity_m_s(glance.now_s))
            return
        x, y = (glance.gain * component for component in across)
        self._go((x, y, eagerness * glance.gain * depth_m))

    def _grasping(self, glance: Glance) -> None:
        self._fingers.do(0.0, _REST, {Button.CROSS})
        if glance.view.holding and self._elapsed_s(glance) > 0.3:
            self._from, self._holding_s = glance.view.tool_position_m, glance.now_s
            self._gripped_height_m = glance.view.tool_position_m[2]
            self._enter(Doing.LIFTING, glance.now_s)
        elif self._elapsed_s(glance) > 2.5 + 2 * self._settings.visual_reaction_s:
            self._attempt += 1
            self._enter(Doing.RETREATING if self._attempt < self._settings.attempts else Doing.DONE, glance.now_s)

    def _retreating(self, glance: Glance) -> None:
        """Open the gripper, draw back a little, and aim again."""
        self._fingers.do(-0.4, _REST, {Button.SQUARE})
        if self._elapsed_s(glance) > 1.0:
            self._aim(glance.now_s)

    def _dropped(self, glance: Glance) -> bool:
        """Return whether the person has given up the object, because it is no longer held."""
        if glance.view.holding:
            self._holding_s = glance.now_s
        if glance.now_s - self._holding_s <= _DROPPED_S:
            return False
        self._enter(Doing.DONE, glance.now_s)
        return True

    def _lifting(self, glance: Glance) -> None:
        """Move upwards, whatever the direction of the tool is."""
        up = glance.view.up_in_tool
        if not self._dropped(glance) and math.dist(glance.view.tool_position_m, self._from) > self._settings.lift_m:
            self._from = glance.view.tool_position_m
            self._enter(Doing.CARRYING, glance.now_s)
        # At half speed, for care.
        self._fingers.do(0.5 * up[2], (0.5 * up[0], -0.5 * up[1]), {Button.CROSS})

    def _carrying(self, glance: Glance) -> None:
        """Move back towards the robot, horizontally; do not move if the tool points straight up or down."""
        if self._dropped(glance):
            return
        up = glance.view.up_in_tool
        back = (up[2] * up[0], up[2] * up[1], up[2] * up[2] - 1.0)
        level = math.hypot(*back)
        left_m = level * self._settings.carry_m - math.dist(glance.view.tool_position_m[:2], self._from[:2])
        if left_m < self._REACHED_M:
            self._judge_depth()
            self._from = glance.view.tool_position_m
            self._enter(Doing.LOWERING, glance.now_s)
            left_m = 0.0
        speed = min(_CARRY_M_S, max(glance.gain * left_m, 0.0)) / max(level, self._REACHED_M)
        self._go((speed * back[0], speed * back[1], speed * back[2]), {Button.CROSS})

    def _lowering(self, glance: Glance) -> None:
        """Lower the object until it is felt or seen to stand: gently after a cue and near the expected height.

        If a stiff trigger stops it, as it may from above, press that alone, harder step by step, and rest the stick.
        """
        if self._dropped(glance):
            return
        stalled = self._sinking.see(glance.view.tool_position_m[2], GENTLY_M_S, glance)
        stiff = self._fingers.resisted_share() > self._settings.noticeable_force
        stiff &= glance.view.up_in_tool[2] < _FROM_ABOVE
        if stalled and stiff and not self._stands and self._gently_m_s < _PRESSES_M_S:
            self._gently_m_s += GENTLY_M_S
            self._sinking.presses(glance.now_s)
        elif stalled or self._stands:
            self._from = glance.view.tool_position_m
            self._enter(Doing.LETTING_GO, glance.now_s)
        left_m = glance.view.tool_position_m[2] - self._gripped_height_m + self._depth_error_m
        speed = max(min(_CARRY_M_S, glance.gain * left_m), self._gently_m_s)
        x, y, z = (-speed * part for part in glance.view.up_in_tool)
        self._go((0.0, 0.0, z) if stiff else (x, y, z), {Button.CROSS})

    def _letting_go(self, glance: Glance) -> None:
        """Open the gripper, and rise a little, as the person has pressed the object down."""
        risen_m = glance.view.tool_position_m[2] - self._from[2]
        if not glance.view.holding and (risen_m > _CLEAR_M or self._elapsed_s(glance) > _CLEARS_S + glance.lag_s):
            self._from = glance.view.tool_position_m
            self._enter(Doing.DRAWING_BACK, glance.now_s)
        rises = 0.0 if glance.view.holding or self._elapsed_s(glance) < 0.6 else GENTLY_M_S
        x, y, z = (rises * part for part in glance.view.up_in_tool)
        self._go((x, y, z), {Button.SQUARE})

    def _drawing_back(self, glance: Glance) -> None:
        back_m = math.dist(glance.view.tool_position_m, self._from)
        if back_m > _BACK_M or self._nearing.see(_BACK_M - back_m, glance):
            self._enter(Doing.DONE, glance.now_s)
        self._go((0.0, 0.0, -_CARRY_M_S), {Button.SQUARE} if back_m < 0.5 * _BACK_M else set())

    def _done(self, glance: Glance) -> None:
        self._fingers.do(0.0, _REST, {Button.CROSS} if glance.view.holding else set())

    def _go(self, velocity_m_s: Vector3, buttons: set[Button] | None = None) -> None:
        """Move the tool at this velocity, limited where the person goes gently.

        The velocity is in the tool's frame, whose y axis points down on the screen.
        """
        across = self._gently_m_s if self._gently_across else math.inf
        along = self._gently_m_s if self._gently_along else math.inf
        x, y, z = (min(max(v, -most), most) for v, most in zip(velocity_m_s, (across, across, along), strict=True))
        stick = within_unit_circle(x / FULL_STICK_M_S, -y / FULL_STICK_M_S)
        self._fingers.do(z / FULL_TRIGGER_M_S, stick, buttons or set())
