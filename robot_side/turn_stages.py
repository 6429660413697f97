"""Count the time of a turn's steps to its stages."""

from typing import Final

from common.realtime.stages import Stages
from robot_side.events import Listener, Step

STAGES: Final = ("sockets", "messages", "physics", "sensing")
"""Of a turn: sending and receiving; decoding and judging what arrived; the arm's state, for which a simulation
advances; the law. All else of a tick is the rest."""
HELPS: Final = {
    "sockets": "fewer views and observers",
    "messages": "fewer observers",
    "physics": 'fewer free bodies, a longer timestep or <flag sleep="enable"/> in the model',
    "sensing": "fewer or simpler objects, or a coarser cover (cover_m)",
    "": "fewer views, or a faster machine",
}
"""What makes each of them shorter."""
_OF_STEPS: Final[dict[Step, str]] = {"arm": "physics", "law": "sensing"}


class StageTiming(Listener):
    """Tells `stages` where each step belongs."""

    def __init__(self, stages: Stages) -> None:
        self._stages = stages

    steps = ("arm", "pose", "law", "messages")

    def on_step(self, step: Step) -> None:
        """Begin the step's stage, or end the one before."""
        if self._stages.looks:
            self._stages.begin(_OF_STEPS.get(step))
