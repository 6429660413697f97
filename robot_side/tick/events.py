"""Events of each turn, for listeners: recording, timing, figures, experiments.

A listener must change nothing, because it gets the core's own values, not copies.
"""

from collections.abc import Callable, Collection, Sequence
from typing import Final, Literal, NamedTuple, get_args

from common.arrays import FloatArray
from common.episode import EpisodeMark
from common.protocol.messages import MotionState
from robot_side.arm.port import ArmState
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.tick.outgoing import Outgoing
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation

Step = Literal["arm", "pose", "grip", "motion", "law", "messages", "listeners", "frame", "end"]
"""Steps of a tick, in their order. A simulated arm advances its physics in `arm`. In `frame`, after the messages to
operators have left, telemetry is made and the camera read. `end`: no step runs until the next one begins."""


class Found(NamedTuple):
    """Results of a tick that did not fail."""

    motion_state: MotionState
    commanded_rad_s: FloatArray | None
    """(n,) commanded joint velocities; None: the arm is to stand still"""
    state: ArmState
    """Measured state, with estimated joint positions"""
    situation: Situation
    sensed: Sensed
    holds_target: bool
    target_m: FloatArray | None
    """(3,) centre of the target as perceived"""
    held: FloatArray | None
    """(k, 4) spheres of the held object in the tool's frame: centres and radii; None if nothing is held"""


class Tick(NamedTuple):
    """Inputs, results and messages of one tick."""

    now_s: float
    measured: ArmState | None
    frame: PerceivedObjects | None
    command_sent_s: float
    """Time at which the newest accepted command was sent, on its sender's clock; NaN without a command"""
    outgoing: Sequence[Outgoing]
    found: Found | None
    """Results of the tick; None if it failed"""


class Listener:
    """Base class of receivers of a core's events; a method that a derived class does not override costs nothing."""

    steps: Collection[Step] = ()
    """Steps for which `on_step` is called"""

    def on_received(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """Take a control payload, before it is validated."""

    def on_episode(self, mark: EpisodeMark, now_s: float) -> None:
        """Take an accepted mark of an episode; after `reset` the scene is as at its start."""

    def on_step(self, step: Step) -> None:
        """Take the step of the turn that begins now, one of `steps`."""

    def on_tick(self, tick: Tick) -> None:
        """Take the data of a tick, before the tick's messages leave."""

    def on_sent(self, now_s: float) -> None:
        """Receive the event that the messages of the tick at `now_s` have left."""


class Listeners(Listener):
    """Dispatcher of events to several listeners: calls each listener only for the methods that it overrides."""

    def __init__(self, listeners: Sequence[Listener]) -> None:
        own: Final = {
            name: [getattr(one, name) for one in listeners if getattr(type(one), name) is not getattr(Listener, name)]
            for name in ("on_received", "on_episode", "on_tick", "on_sent")
        }
        self._received, self._episodes, self._ticks, self._sent = (tuple(found) for found in own.values())
        self._steps: dict[str, list[Callable[[Step], None]]] = {name: [] for name in get_args(Step)}
        for one in listeners:
            for name in one.steps:
                self._steps[name].append(one.on_step)

    def on_received(self, peer: bytes, payload: bytes, now_s: float) -> None:
        """Pass the event on to the listeners."""
        for hear in self._received:
            hear(peer, payload, now_s)

    def on_episode(self, mark: EpisodeMark, now_s: float) -> None:
        """Pass it on."""
        for hear in self._episodes:
            hear(mark, now_s)

    def on_step(self, step: Step) -> None:
        """Pass the event on to the listeners."""
        for hear in self._steps[step]:
            hear(step)

    def on_tick(self, tick: Tick) -> None:
        """Pass the event on to the listeners."""
        for hear in self._ticks:
            hear(tick)

    def on_sent(self, now_s: float) -> None:
        """Pass the event on to the listeners."""
        for hear in self._sent:
            hear(now_s)
