"""How others estimate a clock's offset from four stamps, to compare with: all of one end's exchanges at once."""

from dataclasses import dataclass

import numpy as np

from common.arrays import FloatArray


@dataclass(frozen=True)
class Stamps:
    """(n,) stamps in seconds of n exchanges in the order of their arrival, ours by our clock, the peer's by its own."""

    local_sent_s: FloatArray
    peer_received_s: FloatArray
    peer_sent_s: FloatArray
    local_received_s: FloatArray

    @property
    def offsets_s(self) -> FloatArray:
        """(n,) offsets, each from one exchange (RFC 5905)."""
        offsets_s: FloatArray = (
            (self.peer_received_s - self.local_sent_s) + (self.peer_sent_s - self.local_received_s)
        ) / 2.0
        return offsets_s

    @property
    def round_trips_s(self) -> FloatArray:
        """(n,) round trips without the peer's holding time."""
        round_trips_s: FloatArray = (self.local_received_s - self.local_sent_s) - (
            self.peer_sent_s - self.peer_received_s
        )
        return round_trips_s


def mean_of_offsets(stamps: Stamps) -> float:
    """The average over all exchanges."""
    return float(stamps.offsets_s.mean())


def best_of_eight(stamps: Stamps) -> float:
    """The offset of the least round trip among the newest eight: NTP's clock filter (RFC 5905, section 10)."""
    return float(stamps.offsets_s[-8:][np.argmin(stamps.round_trips_s[-8:])])


def line_through_least_round_trips(stamps: Stamps) -> float:
    """A least-squares line through the exchanges with the least 5 % of round trips, at the newest arrival."""
    count = max(2, stamps.offsets_s.size // 20)
    chosen = np.argpartition(stamps.round_trips_s, count - 1)[:count]
    times_s = stamps.local_received_s[chosen] - stamps.local_received_s[-1]
    offsets_s = stamps.offsets_s[chosen]
    mean_s = float(offsets_s.mean())
    slope, level_s = np.polyfit(times_s, offsets_s - mean_s, 1)
    del slope  # at the newest arrival the time is 0
    return mean_s + float(level_s)


def least_both_ways(stamps: Stamps) -> float:
    """Half the difference of the least clock differences of each direction, without a skew."""
    there_s = float((stamps.peer_received_s - stamps.local_sent_s).min())
    back_s = float((stamps.local_received_s - stamps.peer_sent_s).min())
    return (there_s - back_s) / 2.0


PEERS = {
    "mean of offsets": mean_of_offsets,
    "best round trip of 8": best_of_eight,
    "least 5 % of round trips, line": line_through_least_round_trips,
    "least both ways, no skew": least_both_ways,
}
"""Each gives the offset in seconds at the newest arrival."""
