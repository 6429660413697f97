"""Patterns in the hand, with the zones' strengths and the travel of both triggers on the terminal or as a story."""

import math
from typing import Final, get_args

from rich.console import Group, RenderableType
from rich.text import Text

from feelahead.commands.controller.loop import Screen
from feelahead.commands.controller.patterns import PatternName, Walk
from feelahead.commands.virtual_dualsense import pulling
from operator_side.calibration.forces import ControllerForces, TriggerForces, load_forces
from operator_side.controller.feel import SENSED_TRAVEL, ZONE_COUNT, Feel, met
from operator_side.controller.port import OpenController
from operator_side.controller.state import ControllerState
from operator_side.dualsense.simulated.controller import SimulatedDualSense

_KEYS: Final[dict[str, PatternName]] = {str(n): name for n, name in enumerate(get_args(PatternName), start=1)}
HELP: Final = f"keys: {'  '.join(f'{key} {name}' for key, name in _KEYS.items())}  space next  q end"
_PULLED, _LET_GO = 0.2, 0.1
_BAR: Final = 20


class Trying:
    """Activity of the loop: walks through patterns, and shows what both triggers do."""

    def __init__(
        self, walk: Walk, screen: Screen, simulated: SimulatedDualSense | None, duration_s: float | None
    ) -> None:
        """duration_s: None for one round of a simulated controller, and no end of a real one."""
        self._walk, self._screen, self._simulated = walk, screen, simulated
        self._duration_s = math.inf if duration_s is None else duration_s
        self._rounds = 1 if simulated is not None and duration_s is None else math.inf
        self._forces = ControllerForces()
        self._start_s = 0.0
        self._state: ControllerState | None = None
        self._said: str | None = None
        self._peaks = {"L2": (0.0, ""), "R2": (0.0, "")}
        """Largest travel of each pull, and what was met there"""

    @property
    def feel(self) -> Feel:
        """Strengths of the present stage, on both triggers."""
        return Feel(l2=self._walk.stage.strengths, r2=self._walk.stage.strengths)

    def found(self, controller: OpenController) -> None:
        """Load the forces that were measured for this controller."""
        self._forces = ControllerForces() if controller.address is None else load_forces(controller.address)

    def turn(self, state: ControllerState | None, typed: str | None, now_s: float) -> bool:
        """Follow the keys and the time, and show the state."""
        if self._simulated is not None:
            self._simulated.set_finger_force(*pulling(now_s)[:2])
        if self._state is None:  # the walk begins with the controller
            self._start_s = now_s
            self._state = state
            return "q" not in (typed or "")
        for key in typed or "":
            if key == "q":
                return False
            if key == " ":
                self._walk.skip()
            elif key in _KEYS:
                self._walk.choose(_KEYS[key])
        self._walk.advance(now_s)
        if now_s - self._start_s >= self._duration_s or self._walk.rounds >= self._rounds:
            return False
        if state is not None:
            self._state = state
            if not self._screen.draws:
                self._tell(state, now_s - self._start_s)
            self._screen.draw(lambda: self._drawing(state), now_s)
        return True

    def finish(self) -> list[str]:
        """Return no result."""
        return []

    def _tell(self, state: ControllerState, now_s: float) -> None:
        stage = self._walk.stage
        if (said := f"{self._headline()}: {' '.join(map(str, stage.strengths))}") != self._said:
            self._said = said
            self._screen.say(f"{now_s:7.1f} s  {said}")
        for name, travel in (("L2", state.l2), ("R2", state.r2)):
            here = (travel, f"zone {_zone(travel)}, strength {met(stage.strengths, travel)}")
            peak = self._peaks[name] = max(self._peaks[name], here)
            if travel < _LET_GO:
                self._peaks[name] = here
                if peak[0] > _PULLED:
                    self._screen.say(f"{now_s:7.1f} s  {name} was pulled to {peak[0]:.2f}: {peak[1]}")

    def _headline(self) -> str:
        stage = self._walk.stage
        measured = [("L2", self._forces.l2), ("R2", self._forces.r2)]
        newtons = [
            f"{name} {_newtons(forces, max(stage.strengths))}" for name, forces in measured if forces is not None
        ]
        return stage.words + (f" ({', '.join(newtons)})" if newtons else "")

    def _drawing(self, state: ControllerState) -> RenderableType:
        strengths = self._walk.stage.strengths
        lines = [Text(self._headline(), style="bold")]
        for name, travel in (("L2", state.l2), ("R2", state.r2)):
            here = _zone(travel)
            zones = Text(f"{name}  zones ")
            for zone, strength in enumerate(strengths):
                zones.append(f" {strength}", style="reverse" if zone == here else "")
            filled = round(travel * _BAR)
            zones.append(
                f"   pulled {'█' * filled}{'·' * (_BAR - filled)} {travel:.2f}, meets {met(strengths, travel)}"
            )
            lines.append(zones)
        words = HELP if self._simulated is None else "simulated, faster than real time; no key is read"
        return Group(*lines, Text(words, style="dim"))


def _newtons(forces: TriggerForces, strength: int) -> str:
    return f"{forces.pulls_n[0]:.1f} {forces.added_n(strength):+.1f} N" if strength else f"{forces.pulls_n[0]:.1f} N"


def _zone(travel: float) -> int:
    return min(int(ZONE_COUNT * SENSED_TRAVEL * travel), ZONE_COUNT - 1)
