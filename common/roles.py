"""Roles that objects may have in the task."""

from enum import Enum
from typing import Final


class Role(Enum):
    """Role of an object in the task. Messages contain its index in ROLES."""

    OBSTACLE = "obstacle"
    TARGET = "target"
    SUPPORT = "support"
    IGNORED = "ignored"


ROLES: Final = tuple(Role)
