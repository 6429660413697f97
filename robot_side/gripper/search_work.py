"""Work of a search for a cover, counted and not timed, so that a busy machine searches as far as a fast one."""

from collections.abc import Callable

MOST_WORK = 20_000_000_000
"""Limit of the work of all searches for one gripper, meant for 20 s of two processors. Those of published grippers
that search longest spent up to 11e9, in 9 s."""
SPHERE_TEST, FACE_TEST, CHOICE = 5, 2, 3
"""Work of testing a point and a sphere, or a point and a face, and of choosing one sphere, for each point in each
candidate: about the nanoseconds of a processor"""


class SearchWork:
    """Work and progress of one search. A search whose work is spent no longer tries to save spheres."""

    def __init__(self, limit: float = MOST_WORK / 8.0, told: Callable[[float], None] | None = None) -> None:
        """told: called often during the search, with the share of the surface that is covered."""
        self.covered = 0.0
        """Share of the surface that is covered, from 0 to 1"""
        self.done = 0
        """Work until now"""
        self._limit, self._told = limit, told

    @property
    def spent(self) -> bool:
        """Whether the work has reached the limit."""
        return self.done >= self._limit

    def add(self, work: int) -> None:
        """Count work that comes next."""
        self.done += work
        if self._told is not None:
            self._told(self.covered)
