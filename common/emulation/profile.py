"""What one direction of one stream does to messages: a frozen, validated profile."""

import math
from dataclasses import dataclass, field
from typing import Literal, get_args

from common.emulation.distribution import DelayTable, Distribution, moments
from common.emulation.loss import LossModel
from common.emulation.randomness import CorrelationModel
from common.emulation.slots import Slot
from common.emulation.trace import Trace
from common.errors import ConfigurationError

LinkModel = Literal["datagram", "stream"]

QUEUE_LIMIT = 1000
"""netem's own limit, in messages: what comes on top is dropped."""
_SHORTEST_RECOVERY_S = 1e-3
_RECOVERY_ROUND_TRIPS = 1.25
_MOST_RETRANSMITTED = 0.99

LONGEST_S = 1e6
"""No delay or jitter is longer: eleven days."""


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


@dataclass(frozen=True)
class LinkProfile:
    """Everything that one direction of one stream does to messages, after netem.

    The model `datagram` loses, doubles and reorders messages, as UDP sees it. `stream` delivers every message that
    its queue has room for, once and in order, as TCP does: nothing is due before what was sent earlier; a lost or
    corrupted message is sent again `recovery_s` later, as often as it takes; duplicates and reordering do not show.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    """Half the range (uniform), the standard deviation (normal), or the scale of another shape."""
    distribution: Distribution | DelayTable = "uniform"
    seed: int = 0
    model: LinkModel = "datagram"
    delay_correlation: float = 0.0
    correlation_model: CorrelationModel = "netem"
    loss: LossModel | None = None
    duplicate: Chance | None = None
    corrupt: Chance | None = None
    reorder: Chance | None = None
    """At once, ahead of what is being delayed."""
    gap: int = 1
    """At most one in so many is reordered."""
    rate: Rate | None = None
    limit: int = QUEUE_LIMIT
    """Messages that may wait; what comes on top is dropped."""
    slot: Slot | None = None
    outages: tuple[Outage, ...] = ()
    trace: Trace | None = None
    """Recorded delays instead of delay, jitter and loss."""
    retransmit_s: float | None = None
    """In a stream, how long until a lost message is sent again; None: see `recovery_s`."""
    round_trip_s: float | None = field(default=None, compare=False)
    """Of both directions, where the other one is known; None: twice this one."""

    def __post_init__(self) -> None:
        for name in ("delay_s", "jitter_s"):
            seconds = getattr(self, name)
            if not 0.0 <= seconds <= LONGEST_S:
                raise ValueError(f"{name} = {seconds} is negative, too long or no number; valid: 0 to {LONGEST_S:g} s")
        if not (isinstance(self.distribution, DelayTable) or self.distribution in get_args(Distribution)):
            raise ValueError(f"distribution = {self.distribution!r}; valid: {choices(Distribution)}, or a table")
        for name in ("gap", "limit"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} = {getattr(self, name)}; valid: 1 or more")
        if not 0.0 <= self.delay_correlation <= 1.0:
            raise ValueError(f"delay_correlation = {self.delay_correlation}; valid: 0 to 1")
        for name in ("retransmit_s", "round_trip_s"):
            optional_s: float | None = getattr(self, name)
            if optional_s is not None and not 0.0 <= optional_s <= 4.0 * LONGEST_S:
                raise ValueError(f"{name} = {optional_s}; valid: 0 to {4.0 * LONGEST_S:g} s, or None")
        if self.model == "stream" and self.retransmitted_share() > _MOST_RETRANSMITTED:
            raise ValueError("loss of all messages; valid in a stream, which sends lost ones again: below 99%")
        check_seed_and_models(self.seed, self.model, self.correlation_model)

    @classmethod
    def parse(
        cls,
        spec: str,
        seed: int = 0,
        model: LinkModel = "datagram",
        correlation_model: CorrelationModel = "netem",
    ) -> "LinkProfile":
        """Read one bare profile such as `delay 50ms 10ms distribution normal loss 1%`; empty means no delay.

        ConfigurationError, in one line, for whatever is unknown, malformed, out of range or contradictory.
        """
        # The grammar builds profiles, so that it cannot be imported before there are any.
        from common.emulation.grammar import parse_profile  # noqa: PLC0415

        check_seed_and_models(seed, model, correlation_model)
        return parse_profile(spec, spec, seed, model, correlation_model)

    def words(self) -> str:
        """The profile in the words that `parse` reads; empty where nothing is asked for."""
        from common.emulation.words import format_profile  # noqa: PLC0415

        return format_profile(self)

    def mean_delay_s(self) -> float:
        """Of the delay asked for, without what rate, slots and retransmission add."""
        if self.trace is not None:
            known_s = [delay_s for delay_s in self.trace.delays_s if delay_s is not None]
            return math.fsum(known_s) / len(known_s)
        return moments(self.delay_s, self.jitter_s, self.distribution)[0]

    def recovery_s(self) -> float:
        """In a stream, how long after it was sent a lost message is sent again.

        `retransmit_s`; without it 5/4 of the round trip, at least 1 ms. That is recovery as RACK does it
        (RFC 8985): the acknowledgement of a later message tells that one is missing, a quarter of the least
        round trip is granted for reordering, and lost retransmissions are found alike. It takes a steady
        flow: the last message before a silence would wait for a time-out, on Linux 200 ms or more. Nor is
        congestion control in it: bursts of loss shrink TCP's window and delay it more than this.
        """
        if self.retransmit_s is not None:
            return self.retransmit_s
        round_trip_s = 2.0 * self.mean_delay_s() if self.round_trip_s is None else self.round_trip_s
        return max(_RECOVERY_ROUND_TRIPS * round_trip_s, _SHORTEST_RECOVERY_S)

    def retransmitted_share(self) -> float:
        """In a stream, the share of sendings that have to be repeated, because of loss or corruption."""
        arrives = 1.0
        if self.loss is not None:
            arrives -= self.loss.share()
        if self.corrupt is not None:
            arrives *= 1.0 - self.corrupt.share
        if self.trace is not None:
            arrives *= 1.0 - self.trace.delays_s.count(None) / len(self.trace.delays_s)
        return 1.0 - arrives


def check_seed_and_models(seed: int, model: LinkModel, correlation_model: CorrelationModel) -> None:
    """ConfigurationError for a negative seed and for unknown models."""
    if seed < 0:
        raise ConfigurationError(f"seed = {seed} is negative; valid: 0 or a positive whole number")
    if model not in get_args(LinkModel):
        raise ConfigurationError(f"link model {model!r} is unknown; valid: {choices(LinkModel)}")
    if correlation_model not in get_args(CorrelationModel):
        raise ConfigurationError(
            f"link correlation {correlation_model!r} is unknown; valid: {choices(CorrelationModel)}"
        )


def choices(literal: object) -> str:
    """The values of a Literal, for messages."""
    return ", ".join(get_args(literal))
