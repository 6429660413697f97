"""One direction of the wide area: loses, queues, delays and counts packets. The caller gives the time."""

import random
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from common.limits import Limited, Share

Direction = Literal["to_operator", "to_robot"]


@dataclass(frozen=True)
class DirectionSettings(Limited):
    """Delay, loss, rate and queue of one direction; sent to the forwarder as JSON."""

    delay_s: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    """Delay of each packet, after the queue, in seconds"""
    loss: Share = 0.0
    """Share of packets that are lost, each independently of the others"""
    burst_s: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.0
    """Seconds at the end of each `burst_every_s` in which all packets are lost"""
    burst_every_s: Annotated[float, Meta(gt=0.0, le=1000.0)] = 5.0
    rate_bit_s: Annotated[float, Meta(ge=0.0, le=1e11)] = 0.0
    """Rate of the link in bit/s; 0: unlimited"""
    queue_s: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.2
    """Longest waiting time in the queue, in seconds; a packet that would wait longer is dropped"""


@dataclass
class Counts:
    """Counts of the packets that the sender gave to one direction."""

    packets: int = 0
    bytes: int = 0
    lost: int = 0
    dropped: int = 0
    """Number of packets dropped because the queue was full"""
    queued_s: list[float] = field(default_factory=list)
    """Waiting time of each packet in the queue, in seconds"""

    def summary(self) -> dict[str, float]:
        """Return the counts `packets`, `bytes`, `lost`, `dropped`, and `queue_p95_ms`, a quantile of waiting times."""
        p95 = 1e3 * float(np.quantile(self.queued_s, 0.95)) if self.queued_s else 0.0
        counted = {name: getattr(self, name) for name in ("packets", "bytes", "lost", "dropped")}
        return counted | {"queue_p95_ms": p95}


class Wire:
    """Loss, then a drop-tail queue before a limited rate, then a delay: the order of netem."""

    def __init__(self, words: DirectionSettings, seed: int, direction: Direction, began_s: float) -> None:
        self.counts = Counts()
        self._words = words
        self._random = random.Random(f"{seed} {direction}")  # noqa: S311  # reproducible, no secret
        self._began_s = self._free_s = began_s

    def take(self, size_bytes: int, now_s: float) -> float | None:
        """Return when a packet sent at `now_s` arrives, by the same clock; None if it is lost or dropped."""
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
