"""Lease and link as the robot side last reported them, until they expire."""

import math
from typing import Any, Final

from common.protocol.messages import LeaseNotice, LinkReport
from common.protocol.session import NOT_ARMED, OWNING, SessionState
from common.status.codes import LinkState
from operator_side.robot_link.newest import overtakes

NOTICE_EXPIRES_S: Final = 0.5
"""Age at which a LeaseNotice expires, in seconds"""
REPORT_EXPIRES_S: Final = 2.0
"""Age at which a LinkReport expires, in seconds"""
_NEW_EPOCH_S: Final = 5.0
"""Seconds after we begin an epoch in which a notice that the session has ended may be about the epoch before"""
_REMEMBERED: Final = 100
"""Maximum length of the history"""


class LeaseState:
    """Lease and link as the robot side last reported them."""

    def __init__(self) -> None:
        self.lease: LeaseNotice | None = None
        """Newest LeaseNotice; None before the first and once it has expired."""
        self.stop_reason: str | None = None
        """Reason in the newest notice that the arm is stopped or disarmed; None before the first such notice."""
        self.history: list[str] = []
        """Latest session states of this operator, oldest first; "owner" while it had the lease"""
        self.other_version: str | None = None
        """Error text while the robot side's messages have another protocol version; else None"""
        self._heard_s = self._reported_s = 0.0
        self._report: LinkReport | None = None
        self._anew_s = -math.inf

    @property
    def owns(self) -> bool:
        """Whether we have the lease, so that our commands count."""
        return self.lease is not None and self.lease.session in OWNING

    @property
    def was_not_armed(self) -> bool:
        """Whether `stop_reason` says why a press of the arming button did not arm."""
        return self.stop_reason is not None and self.stop_reason.startswith(NOT_ARMED)

    def read(self, notice: LeaseNotice, now_s: float) -> bool:
        """Take a notice; return whether we must begin a new epoch, because the robot side has ended our session."""
        restarted = now_s - self._anew_s < _NEW_EPOCH_S
        known = None if self.lease is None else self.lease.session
        if restarted and notice.session is SessionState.ENDED and known not in (None, SessionState.ENDED):
            return False  # about the epoch before: it came over a slower connection
        standing = "owner" if notice.session in OWNING else str(notice.session)
        if not self.history or self.history[-1] != standing:
            self.history = [*self.history, standing][-_REMEMBERED:]
        self.lease, self._heard_s = notice, now_s
        if notice.session in (SessionState.DISARMED, SessionState.STOPPED):
            self.stop_reason = notice.why
        elif self.was_not_armed:
            self.stop_reason = None
        if notice.session is not SessionState.ENDED or restarted:
            return False
        self._anew_s = now_s
        return True

    def note(self, report: LinkReport, now_s: float) -> None:
        """Take a LinkReport; drop it if a newer one has arrived."""
        if overtakes(report.header, None if self._report is None else self._report.header):
            self._report, self._reported_s = report, now_s

    def status_fields(self, now_s: float, *, linked: bool, heard: bool) -> dict[str, Any]:
        """Return the fields of OperatorStatus about the link.

        linked: stiffness messages arrive. heard: at least one has arrived before.
        """
        link, reason = self._link(linked=linked, heard=heard)
        fields: dict[str, Any] = {"link": link, "link_reason": reason}
        if self.lease is not None:
            lease = self.lease
            fields |= {"owner": lease.session, "place": lease.place, "waiting": lease.waiting}
        if self._report is not None and now_s - self._reported_s <= REPORT_EXPIRES_S:
            fields |= self._report.values()
        return fields

    def _link(self, *, linked: bool, heard: bool) -> tuple[LinkState, str | None]:
        lease = self.lease
        if self.other_version is not None:
            return LinkState.REFUSED, self.other_version
        if lease is not None and lease.session is SessionState.OBSERVING:
            return LinkState.OBSERVING, None
        if lease is not None and lease.session not in OWNING:
            return LinkState.REFUSED, lease.why
        if linked and lease is not None:
            return LinkState.UP, None
        return LinkState.LOST if heard else LinkState.WAITING, None

    def expire(self, now_s: float) -> None:
        """Forget the lease if the newest notice has expired."""
        if now_s - self._heard_s > NOTICE_EXPIRES_S:
            self.lease = None

    def forget(self) -> None:
        """Forget the lease, as the robot side has restarted."""
        self.lease = self.stop_reason = None
