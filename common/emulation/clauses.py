"""The clauses of a link profile that are more than a number: frozen and validated."""

import math
from dataclasses import dataclass
from typing import Literal

LinkModel = Literal["datagram", "stream"]

QUEUE_LIMIT = 1000
"""netem's own limit, in messages: what comes on top is dropped."""


@dataclass(frozen=True)
class Chance:
    """Something that happens to a share of the messages."""

    share: float
    correlation: float = 0.0

    def __post_init__(self) -> None:
        for name in ("share", "correlation"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} = {getattr(self, name)}; valid: 0 to 1")


@dataclass(frozen=True)
class Rate:
    """A bottleneck that takes one message after the other."""

    bits_per_second: float
    overhead_bytes: int = 0
    """On each message, such as headers; negative takes away."""
    cell_bytes: int = 0
    """Messages travel in whole cells of this payload, as on ATM; 0: they do not."""
    cell_overhead_bytes: int = 0

    def __post_init__(self) -> None:
        if not 1.0 <= self.bits_per_second < math.inf:
            raise ValueError(f"bits_per_second = {self.bits_per_second}; valid: 1 or more")
        if self.cell_bytes < 0 or self.cell_bytes + self.cell_overhead_bytes < 0:
            raise ValueError(f"cell_bytes = {self.cell_bytes}, cell_overhead_bytes = {self.cell_overhead_bytes}")

    def transmission_s(self, size_bytes: int) -> float:
        """How long a message of `size_bytes` takes."""
        size_bytes = max(0, size_bytes + self.overhead_bytes)
        if self.cell_bytes:
            cells = -(-size_bytes // self.cell_bytes)
            size_bytes = cells * (self.cell_bytes + self.cell_overhead_bytes)
        return 8.0 * size_bytes / self.bits_per_second


@dataclass(frozen=True)
class Outage:
    """A time without a link, counted from the line's start."""

    duration_s: float
    at_s: float
    every_s: float | None = None
    """It comes again after so long; None: once."""

    def __post_init__(self) -> None:
        if not 0.0 < self.duration_s < math.inf:
            raise ValueError(f"of {self.duration_s} s; valid: above 0")
        if not 0.0 <= self.at_s < math.inf:
            raise ValueError(f"at {self.at_s} s; valid: 0 or more")
        if self.every_s is not None and not self.duration_s < self.every_s < math.inf:
            raise ValueError(f"every {self.every_s} s; valid: longer than the {self.duration_s:g} s that it lasts")

    def end_s(self, elapsed_s: float) -> float | None:
        """When the outage ends in which `elapsed_s` lies, both since the line's start; None outside of any."""
        since_s = elapsed_s - self.at_s
        if since_s < 0.0:
            return None
        begun_s = self.at_s
        if self.every_s is not None:
            times = math.floor(since_s / self.every_s)
            begun_s += times * self.every_s
        end_s = begun_s + self.duration_s
        return end_s if elapsed_s < end_s else None
