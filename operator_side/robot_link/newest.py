"""Newest stiffness message from the robot side, and the order of messages."""

from typing import Final

from common.protocol.link_end import Arrival
from common.protocol.messages import Header, StiffnessUpdate
from common.statistics import RunningStatistics

STIFFNESS_EXPIRES_S: Final = 0.2
"""Age of the newest stiffness message, in seconds, above which triggers are released and inputs move nothing"""


class NewestStiffness:
    """Newest stiffness message, until it expires."""

    def __init__(self, seed: int = 0) -> None:
        self.update: StiffnessUpdate | None = None
        """Newest stiffness message; None before the first and once it has expired"""
        self.received_s = 0.0
        self.count = 0
        self.has_been_armed = False
        self.driving_delay = RunningStatistics(seed)
        """One-way delay, in seconds, of stiffness messages sent while the arm was armed, where known"""
        self.applied_age = RunningStatistics(seed)

    def note(self, update: StiffnessUpdate, arrival: Arrival) -> None:
        """Count a stiffness message; call it once for each, not for its copies over other connections."""
        self.count += 1
        if update.state == "armed" and arrival.one_way_s is not None:
            self.driving_delay.add(arrival.one_way_s)

    def apply(self, update: StiffnessUpdate, arrival: Arrival, now_s: float) -> None:
        """Keep `update` as the newest stiffness message."""
        self.update, self.received_s = update, now_s
        self.has_been_armed |= update.state == "armed"
        if arrival.one_way_s is not None:
            self.applied_age.add(arrival.one_way_s)

    def expired(self, now_s: float) -> bool:
        """Forget the stiffness message if it has become too old; return whether it expired in this call."""
        if self.update is None or now_s - self.received_s <= STIFFNESS_EXPIRES_S:
            return False
        self.update = None
        return True

    @property
    def stopped(self) -> bool:
        """Whether the arm was armed before and, as far as is known, is not armed now."""
        return self.has_been_armed and (self.update is None or self.update.state != "armed")

    def within(self, age_s: float, now_s: float) -> bool:
        """Return whether there is a stiffness message at most `age_s` old."""
        return self.update is not None and now_s - self.received_s <= age_s


def overtakes(header: Header, known: Header | None) -> bool:
    """Return whether the message with `header` is newer than the one with `known`, or of another epoch."""
    return known is None or header.epoch != known.epoch or header.sequence > known.sequence
