"""Frozen, validated profile of one direction of one stream."""

import math
from dataclasses import dataclass, field
from typing import Annotated, get_args

from msgspec import Meta

from common.emulation.clauses import QUEUE_LIMIT, Chance, LinkModel, Outage, Rate
from common.emulation.distribution import Distribution, moments
from common.emulation.grammar import read_fields
from common.emulation.loss import LossModel
from common.emulation.trace import Trace
from common.errors import ConfigurationError
from common.limits import check_limits

_SHORTEST_RECOVERY_S = 1e-3
_RECOVERY_ROUND_TRIPS = 1.25
_MOST_RETRANSMITTED = 0.99

_LONGEST_S = 1e6
"""Longest delay or jitter, in seconds: eleven days."""
_Delay = Annotated[float, Meta(ge=0.0, le=_LONGEST_S)]
_Recovery = Annotated[float, Meta(ge=0.0, le=4.0 * _LONGEST_S)]
_Count = Annotated[int, Meta(ge=1)]


@dataclass(frozen=True)
class LinkProfile:
    """Effects of one direction of one stream on messages, after netem.

    The model `datagram` loses, duplicates and reorders messages, as UDP sees it. `stream` delivers every message that
    its queue accepts, once and in order, as TCP does. No message is due before an earlier one. A lost or corrupted
    message is sent again every `recovery_s` until it arrives; duplicates and reordering do not show.
    """

    delay_s: _Delay = 0.0
    jitter_s: _Delay = 0.0
    """Half range (uniform), standard deviation (normal), or scale of another shape."""
    distribution: Distribution = "uniform"
    seed: int = 0
    model: LinkModel = "datagram"
    loss: LossModel | None = None
    duplicate: Chance | None = None
    corrupt: Chance | None = None
    reorder: Chance | None = None
    """Share of messages sent at once, ahead of delayed ones."""
    gap: _Count = 1
    """Least number of messages from one reordered message to the next."""
    rate: Rate | None = None
    limit: _Count = QUEUE_LIMIT
    """Messages that may wait; surplus ones are dropped."""
    outages: tuple[Outage, ...] = ()
    trace: Trace | None = None
    """Recorded delays instead of delay, jitter and loss."""
    retransmit_s: _Recovery | None = None
    """Time until a stream sends a lost message again; None: see `recovery_s`."""
    round_trip_s: _Recovery | None = field(default=None, compare=False)
    """Sum of both directions' mean delays; None if the other is unknown: twice this one."""
    words: str = field(default="", compare=False)
    """Profile in the grammar's words, as given."""

    def __post_init__(self) -> None:
        check_limits(self)
        if self.distribution not in get_args(Distribution):
            raise ValueError(f"distribution = {self.distribution!r}; valid: {choices(Distribution)}")
        if self.model == "stream" and self.retransmitted_share() > _MOST_RETRANSMITTED:
            raise ValueError("loss of all messages; valid in a stream, which sends lost ones again: below 99%")
        check_seed_and_model(self.seed, self.model)

    @classmethod
    def parse(cls, spec: str, seed: int = 0, model: LinkModel = "datagram") -> "LinkProfile":
        """Read one bare profile such as `delay 50ms 10ms distribution normal loss 1%`; empty means no delay.

        Raises ConfigurationError, in one line, for unknown, malformed, contradictory or out-of-range words.
        """
        return cls.parse_within(spec, spec, seed, model)

    @classmethod
    def parse_within(cls, profile: str, spec: str, seed: int, model: LinkModel) -> "LinkProfile":
        """Read `profile`, which is `spec` or a clause of it; raises ConfigurationError, which quotes `spec`."""
        check_seed_and_model(seed, model)
        fields = read_fields(profile, spec, model)
        try:
            return cls(**fields, seed=seed, model=model, words=" ".join(profile.split()))
        except ValueError as error:
            raise ConfigurationError(f"link {spec!r}: {error}") from error

    def mean_delay_s(self) -> float:
        """Return the mean delay asked for, without rate and retransmission."""
        if self.trace is not None:
            known_s = [delay_s for delay_s in self.trace.delays_s if delay_s is not None]
            return math.fsum(known_s) / len(known_s)
        return moments(self.delay_s, self.jitter_s, self.distribution)[0]

    def recovery_s(self) -> float:
        """Return the time until a stream sends a lost message again, in seconds.

        `retransmit_s`; by default 5/4 of the round trip, at least 1 ms. That is RACK's recovery (RFC 8985): the
        acknowledgement of a later message shows that one is missing, a quarter of the least round trip is granted for
        reordering, and lost retransmissions are found likewise. It assumes a steady flow: the last message before a
        silence would wait for a time-out, on Linux 200 ms or more. Congestion control is left out: bursts of loss
        shrink TCP's window and add more delay than this.
        """
        if self.retransmit_s is not None:
            return self.retransmit_s
        round_trip_s = 2.0 * self.mean_delay_s() if self.round_trip_s is None else self.round_trip_s
        return max(_RECOVERY_ROUND_TRIPS * round_trip_s, _SHORTEST_RECOVERY_S)

    def retransmitted_share(self) -> float:
        """Return the share of a stream's transmissions that are repeated because of loss or corruption."""
        arrives = 1.0
        if self.loss is not None:
            arrives -= self.loss.share()
        if self.corrupt is not None:
            arrives *= 1.0 - self.corrupt.share
        if self.trace is not None:
            arrives *= 1.0 - self.trace.delays_s.count(None) / len(self.trace.delays_s)
        return 1.0 - arrives


def check_seed_and_model(seed: int, model: LinkModel) -> None:
    """Raise ConfigurationError for a negative seed or an unknown model."""
    if seed < 0:
        raise ConfigurationError(f"seed = {seed} is negative; valid: 0 or a positive whole number")
    if model not in get_args(LinkModel):
        raise ConfigurationError(f"link model {model!r} is unknown; valid: {choices(LinkModel)}")


def choices(literal: object) -> str:
    """Join the values of a Literal, for messages."""
    return ", ".join(get_args(literal))
