"""Role of an object in the task."""

from enum import Enum
from typing import Final


class Role(Enum):
    """Role of an object in the task; on the wire a role is the index in ROLES."""

    OBSTACLE = "obstacle"
    TARGET = "target"
    SUPPORT = "support"
    IGNORED = "ignored"


ROLES: Final = tuple(Role)
