"""Where we stand with the robot side: the notice that came last, and whether it still counts."""

import math
from typing import Final

from common.protocol.messages import LeaseNotice
from common.protocol.session import OWNING, SessionState

NOTICE_EXPIRES_S: Final = 0.5
"""Without a notice for this long nobody knows whose lease it is."""
_ANEW_PERIOD_S: Final = 5.0
"""What is said of an ended epoch for so long after another began may still be about the one before."""
_REMEMBERED: Final = 100


class Standing:
    """Whose lease it is, as last heard."""

    def __init__(self) -> None:
        self.lease: LeaseNotice | None = None
        """None before the first notice and once it has expired."""
        self.history: list[str] = []
        """Each standing that we had in turn, the latest ones."""
        self._heard_s = 0.0
        self._anew_s = -math.inf

    @property
    def owns(self) -> bool:
        """Whether our commands are the ones that count."""
        return self.lease is not None and self.lease.session in OWNING

    def follow(self, notice: LeaseNotice, now_s: float) -> bool:
        """Another notice arrived; whether it asks us to start anew, because the robot side forgot us."""
        standing = "owner" if notice.session in OWNING else str(notice.session)
        if not self.history or self.history[-1] != standing:
            self.history = [*self.history, standing][-_REMEMBERED:]
        self.lease, self._heard_s = notice, now_s
        if notice.session is not SessionState.ENDED or now_s - self._anew_s < _ANEW_PERIOD_S:
            return False
        self._anew_s = now_s
        return True

    def expire(self, now_s: float) -> None:
        """Nothing is known any more once the last notice is too old."""
        if now_s - self._heard_s > NOTICE_EXPIRES_S:
            self.lease = None

    def forget(self) -> None:
        """The lease was another robot side's."""
        self.lease = None
