"""One operator as the robot side knows it: its end of the link, where it can be reached, and its session."""

import math

from common.protocol.link_end import LinkEnd
from common.protocol.messages import MotionState
from common.protocol.session import Session, SessionState


class Participant:
    """One epoch of one operator side."""

    def __init__(self, epoch: int, peer: bytes, link: LinkEnd, now_s: float) -> None:
        self.epoch = epoch
        self.link = link
        self.session = Session()
        self.peer = peer
        """The connection that its newest message came over."""
        self.heard_s = now_s
        self.waiting_since_s = now_s
        """Since when it observes; the longest is the next to own."""
        self.answered_s = -math.inf
        """When its Hello was answered last."""
        self.next_target_was_down = True
        self.hand_over_was_down = True
        self.told_state: MotionState | None = None
        """The arm's, as it was told last with a stiffness."""
        self.noticed: list[object] = []
        """What it was told last of the lease."""
        self.tuned = 0
        """The number of its newest wish to tune."""

    @property
    def state(self) -> SessionState:
        """Its session's."""
        return self.session.state
