"""Contacts that a person should have avoided, counted from the simulation's truth."""

import math
from collections.abc import Mapping
from typing import Final

from common.roles import Role
from robot_side.tick.truth import ContactOnset, is_hit

SAME_CONTACT_S: Final = 0.1
"""Time in seconds after a contact within which another contact with the same object counts as the same one"""


class Hits:
    """Hits of one run: contacts of the gripper with all but the target, and of what it holds with obstacles."""

    def __init__(self) -> None:
        self.count = 0
        self.first: str | None = None
        """Object that was hit first"""
        self.fastest_m_s: float | None = None
        """Greatest closing speed"""
        self._hit_s: dict[str, float] = {}

    def take(self, onset: ContactOnset | None, roles: Mapping[str, Role], now_s: float) -> None:
        """Take what began to touch at `now_s`, if anything did."""
        if onset is None or not is_hit(roles[onset.thing], by_held=onset.by_held):
            return
        if now_s - self._hit_s.get(onset.thing, -math.inf) > SAME_CONTACT_S:
            self.count += 1
            self.first = self.first or onset.thing
        self._hit_s[onset.thing] = now_s
        self.fastest_m_s = max(onset.closing_speed_m_s, self.fastest_m_s or 0.0)
