"""What an object is to the task."""

from enum import Enum
from typing import Final


class Role(Enum):
    """What an object is to the task; on the wire a role is its place here."""

    OBSTACLE = "obstacle"
    TARGET = "target"
    SUPPORT = "support"
    IGNORED = "ignored"


ROLES: Final = tuple(Role)
