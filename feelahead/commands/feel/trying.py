"""Patterns in the hand, with the zones' strengths and the travel of both triggers on the terminal or as a story."""

from collections.abc import Callable
from typing import Final, get_args

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.text import Text

from feelahead.commands.feel.patterns import PatternName, Walk
from operator_side.calibration.forces import ControllerForces, TriggerForces, load_forces
from operator_side.controller.feel import SENSED_TRAVEL, ZONE_COUNT, Feel, met
from operator_side.controller.port import OpenController
from operator_side.controller.state import ControllerState

_SHOW_S: Final = 0.05
_KEYS: Final[dict[str, PatternName]] = {str(n): name for n, name in enumerate(get_args(PatternName), start=1)}
HELP: Final = f"keys: {'  '.join(f'{key} {name}' for key, name in _KEYS.items())}  space next  q end"
_PULLED, _LET_GO = 0.2, 0.1
_BAR: Final = 20


class Trying:
    """Activity of the loop: walks through patterns, and shows what both triggers do."""

    def __init__(self, walk: Walk, console: Console, *, until: Callable[[float, Walk], bool], keys: bool) -> None:
        """until: function of the time and the walk that returns whether it ends. keys: whether keys are read."""
        self._walk, self._console, self._until = walk, console, until
        self._help = HELP if keys else "simulated, faster than real time; no key is read"
        self._forces = ControllerForces()
        self._live = Live(console=console, auto_refresh=False) if console.is_terminal else None
        self._shown_s, self._start_s = -1.0, 0.0
        self._state: ControllerState | None = None
        self._said: str | None = None
        self._peaks = {"L2": (0.0, ""), "R2": (0.0, "")}
        """Largest travel of each pull, and what was met there"""

    def __enter__(self) -> "Trying":
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    @property
    def feel(self) -> Feel:
        """Strengths of the present stage, on both triggers."""
        return Feel(l2=self._walk.stage.strengths, r2=self._walk.stage.strengths)

    def found(self, controller: OpenController) -> None:
        """Load the forces that were measured for this controller."""
        self._forces = ControllerForces() if controller.address is None else load_forces(controller.address)

    def turn(self, state: ControllerState | None, typed: str | None, now_s: float) -> bool:
        """Follow the keys and the time, and show the state."""
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
        if self._until(now_s - self._start_s, self._walk):
            return False
        if state is not None:
            self._state = state
            if self._live is None:
                self._tell(state, now_s - self._start_s)
            elif now_s >= self._shown_s + _SHOW_S:
                self._shown_s = now_s
                self._live.update(self._drawing(state), refresh=True)
        return True

    def note(self, text: str) -> None:
        """Print a line above the drawing."""
        self._console.print(text, markup=False, highlight=False, soft_wrap=not self._console.is_terminal)

    def _tell(self, state: ControllerState, now_s: float) -> None:
        stage = self._walk.stage
        if (said := f"{self._headline()}: {' '.join(map(str, stage.strengths))}") != self._said:
            self._said = said
            self.note(f"{now_s:7.1f} s  {said}")
        for name, travel in (("L2", state.l2), ("R2", state.r2)):
            here = (travel, f"zone {_zone(travel)}, strength {met(stage.strengths, travel)}")
            peak = self._peaks[name] = max(self._peaks[name], here)
            if travel < _LET_GO:
                self._peaks[name] = here
                if peak[0] > _PULLED:
                    self.note(f"{now_s:7.1f} s  {name} was pulled to {peak[0]:.2f}: {peak[1]}")

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
        return Group(*lines, Text(self._help, style="dim"))


def _newtons(forces: TriggerForces, strength: int) -> str:
    return f"{forces.pulls_n[0]:.1f} {forces.added_n(strength):+.1f} N" if strength else f"{forces.pulls_n[0]:.1f} N"


def _zone(travel: float) -> int:
    return min(int(ZONE_COUNT * SENSED_TRAVEL * travel), ZONE_COUNT - 1)
