"""Attribution of a turn's steps to its timed stages."""

from typing import Final

from common.realtime.stages import Stages
from robot_side.events import Listener, Step

STAGES: Final = ("sockets", "messages", "physics", "sensing")
"""Stages of a turn: sending and receiving; decoding and judging messages; the arm's state, which advances a
simulation; the law. Everything else in a tick is the rest."""
REMEDIES: Final = {
    "sockets": "fewer views and observers",
    "messages": "fewer observers",
    "physics": 'fewer free bodies, a longer timestep or <flag sleep="enable"/> in the model',
    "sensing": "fewer or simpler objects, or a coarser cover (cover_m)",
    "": "fewer views, or a faster machine",
}
"""Advice that shortens each stage; the empty name is the rest."""
_OF_STEPS: Final[dict[Step, str]] = {"arm": "physics", "law": "sensing"}


class StageTiming(Listener):
    """Listener that begins the stage of each step in `stages`."""

    def __init__(self, stages: Stages) -> None:
        self._stages = stages

    steps = ("arm", "pose", "law", "messages")

    def on_step(self, step: Step) -> None:
        """Begin the step's stage, or end the one before."""
        if self._stages.looks:
            self._stages.begin(_OF_STEPS.get(step))
