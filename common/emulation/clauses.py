"""Clauses of a link profile that are more than a number: frozen and validated."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from common.limits import Limited, Share, check_limits

LinkModel = Literal["datagram", "stream"]

QUEUE_LIMIT = 1000
"""netem's default limit of the queue, in messages: surplus ones are dropped."""


@dataclass(frozen=True)
class Chance(Limited):
    """Probability of an event per message, with netem's correlation."""

    share: Share
    correlation: Share = 0.0


@dataclass(frozen=True)
class Rate(Limited):
    """Bottleneck that sends one message after the other."""

    bits_per_second: Annotated[float, Meta(ge=1.0)]
    overhead_bytes: int = 0
    """Bytes added to each message, such as headers; negative ones are subtracted."""

    def transmission_s(self, size_bytes: int) -> float:
        """Return the transmission time of `size_bytes`, in seconds."""
        return 8.0 * max(0, size_bytes + self.overhead_bytes) / self.bits_per_second


@dataclass(frozen=True)
class Outage:
    """Time without a link, counted from the line's start."""

    duration_s: Annotated[float, Meta(gt=0.0)]
    at_s: Annotated[float, Meta(ge=0.0)]
    every_s: float | None = None
    """Period of repetition; None: once."""

    def __post_init__(self) -> None:
        check_limits(self)
        if self.every_s is not None and not self.duration_s < self.every_s < math.inf:
            raise ValueError(f"every {self.every_s} s; valid: longer than the {self.duration_s:g} s that it lasts")

    def end_s(self, elapsed_s: float) -> float | None:
        """Return the end of the outage that contains `elapsed_s`, both since the line's start; None outside of any."""
        since_s = elapsed_s - self.at_s
        if since_s < 0.0:
            return None
        begun_s = self.at_s + (0.0 if self.every_s is None else math.floor(since_s / self.every_s) * self.every_s)
        end_s = begun_s + self.duration_s
        return end_s if elapsed_s < end_s else None
