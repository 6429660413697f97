"""What is true in the simulation, from turn to turn, for a recording: distances, hits, impulse, placing.

No controller knows any of it, and no side uses it.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from common.episode import EpisodeMark
from common.protocol.messages import Vector3
from common.recording.entries import Kind
from common.recording.topics import Truth
from common.roles import Role
from robot_side.outcome.figures import TRUTH_PERIOD_S, Observer
from robot_side.outcome.hits import Hits
from robot_side.outcome.placing import Placing
from robot_side.recording.recorder import RobotRecorder
from robot_side.tick.events import Listener, Tick
from robot_side.tick.truth import ContactOnset


class Witness(Protocol):
    """Port of a simulation that is recorded."""

    @property
    def roles(self) -> Mapping[str, Role]:
        """Roles of the objects, by name"""
        ...

    def own_name(self, held: str) -> str | None:
        """Return the simulation's name of a held object that is perceived by this name; None if it is not known."""
        ...

    def touches(self, held: str | None) -> ContactOnset | None:
        """Return the fastest contact that began since the last call. held: object that the gripper holds."""
        ...

    @property
    def impulse_n_s(self) -> float:
        """Impulse of all hits so far"""
        ...

    @property
    def tool_m(self) -> Vector3:
        """True position of the tool, in the world frame"""
        ...


class TrueStates(Listener):
    """Gives the function `note` a `Truth` every TRUTH_PERIOD_S."""

    def __init__(self, witness: Witness, observer: Observer, note: Callable[[object], None]) -> None:
        self._witness, self._observer, self._note = witness, observer, note
        self._hits, self._placing = Hits(), Placing()
        self._tick: Tick | None = None
        self._next_s = -math.inf

    def on_episode(self, mark: EpisodeMark, now_s: float) -> None:
        """Forget the placing once the scene was put back: the target is where it began."""
        del now_s
        if mark == "reset":
            self._placing = Placing()

    def on_tick(self, tick: Tick) -> None:
        """Keep the newest tick, for what is held and whether the arm is armed."""
        self._tick = tick

    def on_sent(self, now_s: float) -> None:
        """Look at the simulation."""
        found = None if self._tick is None else self._tick.found
        if found is None:
            return
        situation = found.situation
        held = None if situation.held is None else self._witness.own_name(situation.objects.names[situation.held])
        roles = self._witness.roles
        self._hits.take(self._witness.touches(held), roles, now_s)
        if now_s < self._next_s:
            return
        self._next_s = now_s + TRUTH_PERIOD_S - 1e-9
        truth = self._observer.observe()
        if truth.target is not None:
            self._placing.observe(truth.target, found.holds_target, False, now_s)
        nearest_m, fastest_m_s = truth.min_obstacle_distance_m, self._hits.fastest_m_s
        self._note(
            (
                Kind.TRUTH,
                now_s,
                Truth(
                    time_s=now_s,
                    armed=found.motion_state == "armed",
                    tool_m=self._witness.tool_m,
                    obstacle_mm=None if nearest_m is None else 1e3 * nearest_m,
                    held=held,
                    hits=self._hits.count,
                    hit_first=self._hits.first,
                    fastest_hit_mm_s=None if fastest_m_s is None else 1e3 * fastest_m_s,
                    impulse_n_s=self._witness.impulse_n_s,
                    placed=self._placing.placed,
                ),
            )
        )


def recorders(witness: Witness | None, observer: Observer | None, note: Callable[[Any], None]) -> list[Listener]:
    """Return the listeners that give a recording what they note of a run; without a witness, no truth is recorded."""
    truth = [] if witness is None or observer is None else [TrueStates(witness, observer, note)]
    return [RobotRecorder(note), *truth]
