"""Marks of episodes, of which a recording may have many."""

from typing import Literal

EpisodeMark = Literal["start", "success", "failure", "discard", "reset"]
"""Start of an episode; its end, by result, or because it is not to be kept; or the scene was put back to its start."""
