"""Assignment of a turn's steps to the stages that are timed."""

from typing import Final

from common.realtime.stages import Stages
from robot_side.events import Listener, Step

STAGES: Final = ("sockets", "messages", "physics", "sensing")
"""Stages of a turn. sockets: sending and receiving. messages: decoding and judging messages. physics: reading the arm's
state, which advances a simulation. sensing: the law. Everything else in a tick is the rest."""
REMEDIES: Final = {
    "sockets": "fewer views and observers",
    "messages": "fewer observers",
    "physics": 'fewer free bodies, a longer timestep or <flag sleep="enable"/> in the model',
    "sensing": "fewer or simpler objects, or a coarser cover (cover_m)",
    "": "fewer views, or a faster machine",
}
"""Advice by which each stage becomes shorter; the empty name stands for the rest."""
_OF_STEPS: Final[dict[Step, str]] = {"arm": "physics", "law": "sensing"}


class StageTiming(Listener):
    """Listener that begins in `stages` the stage of each step."""

    def __init__(self, stages: Stages) -> None:
        self._stages = stages

    steps = ("arm", "pose", "law", "messages")

    def on_step(self, step: Step) -> None:
        """Begin the stage of this step; a step without a stage ends the stage before."""
        if self._stages.looks:
            self._stages.begin(_OF_STEPS.get(step))
