"""Tuning requests of this operator (another P or link), repeated until the robot side has received them."""

import math
from collections import deque
from typing import Any, Final

from common.emulation.tuned import tunable_profile
from common.errors import ConfigurationError
from common.protocol.link_end import LinkEnd
from common.protocol.messages import LeaseNotice, Tune
from operator_side.robot_link.lease_state import LeaseState

_REPEATED_S: Final = 0.1
"""Seconds between repetitions of a request"""
_REMEMBERED: Final = 1000
"""Maximum number of requests in the summary"""


class Tuner:
    """Newest tuning request. Requests for P and for the link that are both still unreceived are merged."""

    def __init__(self) -> None:
        self.refused = 0
        """Number of refused requests."""
        self.why = ""
        """Reason why the last request was refused, in one line; empty if it was accepted."""
        self.link: str | None = None
        """Link in the last accepted request that had one; None before the first."""
        self._number = 0
        self._probability: float | None = None
        self._words: str | None = None
        self._own: str | None = None
        self._sent_s = -math.inf
        self._asked: deque[dict[str, Any]] = deque(maxlen=_REMEMBERED)

    def ask(self, probability: float | None, link: str | None, standing: LeaseState, now_s: float) -> None:
        """Take a request for another P or link; None leaves a value unchanged.

        The whole request is refused if the run does not permit tuning, or if P or link is invalid.
        """
        lease = standing.lease
        try:
            if lease is None or not standing.owns or not lease.may_tune:
                why = "the run does not permit it (--permit-tuning)" if standing.owns else "only the owner may"
                raise ConfigurationError(f"tuning refused: {why}")
            if probability is not None and not 0.0 < probability < 1.0:
                raise ConfigurationError(f"probability = {probability}; valid: above 0 to below 1")
            if link is not None:
                tunable_profile(link)
        except ConfigurationError as error:
            self.refused += 1
            self.why = str(error)
            return
        if self._number <= lease.tuned:
            self._probability = self._words = None
        self._probability = self._probability if probability is None else probability
        self._words = self._words if link is None else link
        self._number, self._sent_s = max(self._number, lease.tuned) + 1, -math.inf
        if link is not None:
            self._own = self.link = link
        self.why = ""
        self._asked.append({"at_s": now_s, "probability": probability, "link": link})

    def due(self, lease: LeaseNotice | None, link_end: LinkEnd, now_s: float) -> Tune | None:
        """Return the message to send now; None if none is due, or the robot side has received the request."""
        if lease is None or not lease.may_tune or self._number <= lease.tuned or now_s - self._sent_s < _REPEATED_S:
            return None
        self._sent_s = now_s
        return Tune(link_end.stamp(now_s), self._number, self._probability, self._words)

    def take_link(self) -> str | None:
        """Return the link requested since the last call, for this side to emulate; None if none was."""
        words, self._own = self._own, None
        return words

    def summary(self) -> dict[str, Any]:
        """Return the accepted requests, with their times on this machine's clock, and the number of refused ones."""
        return {"asked": list(self._asked), "refused": self.refused}
