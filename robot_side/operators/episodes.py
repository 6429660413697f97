"""Marks of episodes by the owner, and putting the scene back to its start."""

from collections import Counter, deque
from collections.abc import Callable
from typing import Final

from common.episode import EpisodeMark

_MOST: Final = 16
"""Most marks that wait to be taken."""


class Episodes:
    """Judge of marks, each of which is answered once."""

    def __init__(
        self, put_back: Callable[[], None] | None = None, refuses: str = "nothing here can be put back"
    ) -> None:
        """put_back: puts arm and objects back to their start. refuses: reason without it, in one line."""
        self._put_back, self._refuses = put_back, refuses
        self._accepted: deque[EpisodeMark] = deque(maxlen=_MOST)
        self._notes: deque[str] = deque(maxlen=_MOST)
        self._counts: Counter[str] = Counter()

    def mark(self, kind: EpisodeMark, *, owns: bool, armed: bool) -> str:
        """Take a mark, and put the scene back for `reset`; return why it is refused, empty if it is accepted.

        owns: it is the owner's.
        """
        why = "" if owns else "only the owner may"
        if kind == "reset":
            why = why or ("the arm is armed; valid while it is disarmed or stopped" if armed else "")
            why = why or (self._refuses if self._put_back is None else "")
            self._notes.append(f"reset refused: {why}" if why else "the scene was put back")
            if not why and self._put_back is not None:
                self._put_back()
        if not why:
            self._accepted.append(kind)
            self._counts[kind] += 1
        return why

    def take_accepted(self) -> list[EpisodeMark]:
        """Return the marks accepted since the last call."""
        accepted = list(self._accepted)
        self._accepted.clear()
        return accepted

    def take_notes(self) -> list[str]:
        """Return the notes for a person since the last call."""
        notes = list(self._notes)
        self._notes.clear()
        return notes

    def summary(self) -> dict[str, int]:
        """Return how many marks of each kind were accepted."""
        return dict(self._counts)
