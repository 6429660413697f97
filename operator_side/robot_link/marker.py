"""Marks of episodes on their way to the robot side, each repeated until a notice answers it."""

import math
from collections import deque
from collections.abc import Callable
from typing import Any, Final, Literal

from common.episode import EpisodeMark
from common.protocol.link_end import LinkEnd
from common.protocol.messages import LeaseNotice, Mark
from operator_side.robot_link.lease_state import LeaseState

_REPEATED_S: Final = 0.1
"""Seconds between repetitions of a mark"""
_GIVEN_UP_S: Final = 2.0
"""Seconds without an answer after which a mark is no longer sent: later it would come as a surprise"""
_MOST: Final = 16
"""Maximum number of marks that wait, and of notes"""


class Marker:
    """Marks that wait for an answer, and whether an episode is open."""

    def __init__(
        self,
        standing: LeaseState,
        hear: Callable[[Literal["marked", "episode"], EpisodeMark, float], None],
        *,
        fixed_task: bool = False,
    ) -> None:
        """hear: called with each mark made away from the controller (marked), and with each that counts (episode).

        fixed_task: whether every mark is refused.
        """
        self._standing, self._hear, self._fixed_task = standing, hear, fixed_task
        self._counts: dict[str, int] = {}
        self._open = False
        self._held: EpisodeMark | None = None
        self._number = 0
        self._waiting: deque[tuple[int, EpisodeMark, float]] = deque(maxlen=_MOST)
        self._sent_s = -math.inf
        self._notes: deque[str] = deque(maxlen=_MOST)

    def press(self, held: EpisodeMark | None, now_s: float) -> None:
        """Take the mark whose button is held; it is made if it was not held before."""
        before, self._held = self._held, held
        if held is not None and held != before:
            self._ask(held, now_s)

    def mark(self, kind: EpisodeMark, now_s: float) -> None:
        """Take a mark that was made elsewhere than on the controller."""
        self._hear("marked", kind, now_s)
        self._ask(kind, now_s)

    def _ask(self, kind: EpisodeMark, now_s: float) -> None:
        """Count a mark and send it, or refuse it. A reset counts only once the scene was put back."""
        lease = self._standing.lease
        if self._fixed_task:
            self._refuse(kind, "the task is fixed")
        elif lease is None or not self._standing.owns:
            self._refuse(kind, "only the owner may")
        elif kind not in ("start", "reset") and not self._open:
            self._refuse(kind, "no episode has begun; valid after: start")
        else:
            self._number = max(self._number, lease.marked) + 1
            self._waiting.append((self._number, kind, now_s))
            if kind != "reset":
                self._count(kind, now_s)

    def due(self, link_end: LinkEnd, now_s: float) -> Mark | None:
        """Return the oldest mark without an answer, if it is due."""
        while self._waiting and now_s - self._waiting[0][2] > _GIVEN_UP_S:
            self._refuse(self._waiting.popleft()[1], "the robot side did not answer")
        if not self._waiting or not self._standing.owns or now_s - self._sent_s < _REPEATED_S:
            return None
        self._sent_s = now_s
        number, kind, _ = self._waiting[0]
        return Mark(link_end.stamp(now_s), number, kind)

    def read(self, notice: LeaseNotice, now_s: float) -> None:
        """Take a notice, which may answer the oldest mark."""
        if not self._waiting or notice.marked != self._waiting[0][0]:
            return
        kind = self._waiting.popleft()[1]
        self._sent_s = -math.inf
        if notice.mark_refused:
            self._refuse(kind, notice.mark_refused)
        elif kind == "reset":
            self._count(kind, now_s)

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

    def _count(self, kind: EpisodeMark, now_s: float) -> None:
        self._open = kind == "start"
        self._counts[kind] = self._counts.get(kind, 0) + 1
        self._notes.append("the scene was put back" if kind == "reset" else f"episode: {kind}")
        self._hear("episode", kind, now_s)

    def _refuse(self, kind: EpisodeMark, why: str) -> None:
        self._notes.append(f"{kind} refused: {why}")
