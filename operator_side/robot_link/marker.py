"""Marks of episodes on their way to the robot side, each repeated until a notice answers it."""

import math
from collections import deque
from typing import Any, Final

from common.protocol.link_end import LinkEnd
from common.protocol.messages import EpisodeMark, LeaseNotice, Mark
from operator_side.robot_link.lease_state import LeaseState

_REPEATED_S: Final = 0.1
"""Seconds between repetitions of a mark"""
_GIVEN_UP_S: Final = 2.0
"""Seconds without an answer after which a mark is no longer sent: later it would come as a surprise"""
_MOST: Final = 16
"""Maximum number of marks that wait, and of notes"""


class Marker:
    """Marks that wait for an answer, and whether an episode is open."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}
        self._open = False
        self._held: EpisodeMark | None = None
        self._number = 0
        self._waiting: deque[tuple[int, EpisodeMark, float]] = deque(maxlen=_MOST)
        self._sent_s = -math.inf
        self._notes: deque[str] = deque(maxlen=_MOST)

    def pressed(self, held: EpisodeMark | None) -> EpisodeMark | None:
        """Take the mark whose button is held; return it if it was not held before."""
        before, self._held = self._held, held
        return None if held == before else held

    def ask(self, kind: EpisodeMark, standing: LeaseState, now_s: float) -> bool:
        """Take a mark; return whether it counts now. A reset counts only once the scene was put back."""
        if standing.lease is None or not standing.owns:
            return self._refuse(kind, "only the owner may")
        if kind not in ("start", "reset") and not self._open:
            return self._refuse(kind, "no episode has begun; valid after: start")
        self._number = max(self._number, standing.lease.marked) + 1
        self._waiting.append((self._number, kind, now_s))
        return kind != "reset" and self._count(kind)

    def due(self, standing: LeaseState, link_end: LinkEnd, now_s: float) -> Mark | None:
        """Return the oldest mark without an answer, if it is due."""
        while self._waiting and now_s - self._waiting[0][2] > _GIVEN_UP_S:
            self._refuse(self._waiting.popleft()[1], "the robot side did not answer")
        if not self._waiting or not standing.owns or now_s - self._sent_s < _REPEATED_S:
            return None
        self._sent_s = now_s
        number, kind, _ = self._waiting[0]
        return Mark(link_end.stamp(now_s), number, kind)

    def answered(self, notice: LeaseNotice) -> bool:
        """Take a notice; return whether it says that the scene was put back."""
        if not self._waiting or notice.marked != self._waiting[0][0]:
            return False
        kind = self._waiting.popleft()[1]
        self._sent_s = -math.inf
        if notice.mark_refused:
            return self._refuse(kind, notice.mark_refused)
        return kind == "reset" and self._count(kind)

    def forget(self) -> None:
        """Drop the marks without an answer, as the robot side has restarted."""
        self._waiting.clear()

    def take_notes(self) -> list[str]:
        """Return the notes for a person since the last call."""
        notes = list(self._notes)
        self._notes.clear()
        return notes

    def summary(self) -> dict[str, Any]:
        """Return how many marks of each kind counted."""
        return dict(self._counts)

    def _count(self, kind: EpisodeMark) -> bool:
        self._open = kind == "start"
        self._counts[kind] = self._counts.get(kind, 0) + 1
        self._notes.append("the scene was put back" if kind == "reset" else f"episode: {kind}")
        return True

    def _refuse(self, kind: EpisodeMark, why: str) -> bool:
        self._notes.append(f"{kind} refused: {why}")
        return False
