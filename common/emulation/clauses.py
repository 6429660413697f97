"""Clauses of a link profile that have more than one number, as frozen, validated dataclasses."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from common.limits import Limited, Share, check_limits

LinkModel = Literal["datagram", "stream"]

QUEUE_LIMIT = 1000
"""netem's default for the maximum length of the queue, in messages; further messages are dropped."""


@dataclass(frozen=True)
class Chance(Limited):
    """Probability (`share`) of an event for each message, and netem's correlation between successive messages."""

    share: Share
    correlation: Share = 0.0


@dataclass(frozen=True)
class Rate(Limited):
    """Bottleneck of the link, which sends one message after the other at this rate."""

    bits_per_second: Annotated[float, Meta(ge=1.0)]
    overhead_bytes: int = 0
    """Bytes added to the size of each message, as for headers; may be negative."""

    def transmission_s(self, size_bytes: int) -> float:
        """Return the transmission time of a message of `size_bytes`, in seconds."""
        return 8.0 * max(0, size_bytes + self.overhead_bytes) / self.bits_per_second


@dataclass(frozen=True)
class Outage:
    """Outage of the link, once or periodically; times count from the start of the delay line."""

    duration_s: Annotated[float, Meta(gt=0.0)]
    at_s: Annotated[float, Meta(ge=0.0)]
    every_s: float | None = None
    """Period with which the outage is repeated; None: it happens once."""

    def __post_init__(self) -> None:
        check_limits(self)
        if self.every_s is not None and not self.duration_s < self.every_s < math.inf:
            raise ValueError(f"every {self.every_s} s; valid: longer than the {self.duration_s:g} s that it lasts")

    def end_s(self, elapsed_s: float) -> float | None:
        """Return the end of the outage that contains the time `elapsed_s`; None outside of an outage.

        Both times are in seconds since the delay line's start.
        """
        since_s = elapsed_s - self.at_s
        if since_s < 0.0:
            return None
        begun_s = self.at_s + (0.0 if self.every_s is None else math.floor(since_s / self.every_s) * self.every_s)
        end_s = begun_s + self.duration_s
        return end_s if elapsed_s < end_s else None
