"""One direction of the wide area: loses, queues and delays packets, and counts them. It has no clock."""

import random
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from common.limits import Limited, Share

Direction = Literal["to_operator", "to_robot"]


@dataclass(frozen=True)
class DirectionSettings(Limited):
    """Delay, loss, rate and queue of one direction; the forwarder gets them as JSON."""

    delay_s: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    """Delay of each packet, after the queue."""
    loss: Share = 0.0
    """Share of packets lost, each independently."""
    burst_s: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    """Time in which all packets are lost, at the end of each `burst_every_s`."""
    burst_every_s: Annotated[float, Meta(gt=0.0, le=1000.0)] = 5.0
    rate_bit_s: Annotated[float, Meta(ge=0.0, le=1e11)] = 0.0
    """Rate of the link; 0: unlimited."""
    queue_s: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.2
    """Longest wait; a packet that would wait longer is dropped."""


@dataclass
class Counts:
    """Packets of one direction, as they came from the sender."""

    packets: int = 0
    bytes: int = 0
    lost: int = 0
    dropped: int = 0
    """Number of packets that met a full queue."""
    queued_s: list[float] = field(default_factory=list)
    """Waiting time of each packet for the rate."""

    def summary(self) -> dict[str, float]:
        """Return `packets`, `bytes`, `lost`, `dropped` and `queue_p95_ms`."""
        p95 = 1e3 * float(np.quantile(self.queued_s, 0.95)) if self.queued_s else 0.0
        counted = {name: getattr(self, name) for name in ("packets", "bytes", "lost", "dropped")}
        return counted | {"queue_p95_ms": p95}


class Wire:
    """Drop-tail queue before a rate, and a delay behind it. The order is netem's: lose, drop, delay."""

    def __init__(self, words: DirectionSettings, seed: int, direction: Direction, began_s: float) -> None:
        self.counts = Counts()
        self._words = words
        self._random = random.Random(f"{seed} {direction}")  # noqa: S311  # reproducible, no secret
        self._began_s = self._free_s = began_s

    def change(self, words: DirectionSettings, now_s: float) -> None:
        """Change the words from now on; waiting bits leave at the new rate."""
        if self._words.rate_bit_s and words.rate_bit_s:
            waiting_s = max(0.0, self._free_s - now_s)
            self._free_s = now_s + waiting_s * self._words.rate_bit_s / words.rate_bit_s
        self._words = words

    def take(self, size_bytes: int, now_s: float) -> float | None:
        """Return when a packet of this size arrives, on the caller's clock in seconds; None if lost or dropped."""
        words, counts = self._words, self.counts
        counts.packets += 1
        counts.bytes += size_bytes
        in_burst = (now_s - self._began_s) % words.burst_every_s >= words.burst_every_s - words.burst_s
        if self._random.random() < words.loss or in_burst:
            counts.lost += 1
            return None
        start_s = max(now_s, self._free_s)
        if words.rate_bit_s:
            if start_s - now_s > words.queue_s:
                counts.dropped += 1
                return None
            self._free_s = start_s + 8.0 * size_bytes / words.rate_bit_s
            counts.queued_s.append(start_s - now_s)
            start_s = self._free_s
        return start_s + words.delay_s
