"""Profile of an emulated link for one stream of messages in one direction, frozen and validated."""

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
    """Effects of an emulated link on the messages of one stream in one direction, after netem.

    The model `datagram` loses, duplicates and reorders messages, as a link does with UDP. The model `stream` delivers
    every message that its queue accepts once and in order, as TCP does: no message is due before an earlier one. A lost
    or corrupted message is sent again every `recovery_s` until it arrives. Duplicates and reordering have no effect.
    """

    delay_s: _Delay = 0.0
    jitter_s: _Delay = 0.0
    """Half the range of a uniform distribution, standard deviation of a normal one, scale of another shape."""
    distribution: Distribution = "uniform"
    seed: int = 0
    model: LinkModel = "datagram"
    loss: LossModel | None = None
    duplicate: Chance | None = None
    corrupt: Chance | None = None
    reorder: Chance | None = None
    """Probability with which a message is sent at once, and so overtakes delayed ones."""
    gap: _Count = 1
    """Least number of messages from one reordered message to the next."""
    rate: Rate | None = None
    limit: _Count = QUEUE_LIMIT
    """Maximum number of waiting messages; further ones are dropped."""
    outages: tuple[Outage, ...] = ()
    trace: Trace | None = None
    """Recorded delays and losses, used instead of delay, jitter and loss."""
    retransmit_s: _Recovery | None = None
    """Time after which a lost message is sent again in the model `stream`; None: as `recovery_s` computes it."""
    round_trip_s: _Recovery | None = field(default=None, compare=False)
    """Sum of both directions' mean delays. None: the other direction is unknown, and counts as equal to this one."""
    words: str = field(default="", compare=False)
    """Words from which the profile was parsed."""

    def __post_init__(self) -> None:
        check_limits(self)
        if self.distribution not in get_args(Distribution):
            raise ValueError(f"distribution = {self.distribution!r}; valid: {choices(Distribution)}")
        if self.model == "stream" and self.retransmitted_share() > _MOST_RETRANSMITTED:
            raise ValueError("loss of all messages; valid in a stream, which sends lost ones again: below 99%")
        check_seed_and_model(self.seed, self.model)

    @classmethod
    def parse(cls, spec: str, seed: int = 0, model: LinkModel = "datagram") -> "LinkProfile":
        """Parse one profile such as `delay 50ms 10ms distribution normal loss 1%`; empty means no emulation.

        Raises ConfigurationError, in one line, for unknown, malformed, contradictory or out-of-range words.
        """
        return cls.parse_within(spec, spec, seed, model)

    @classmethod
    def parse_within(cls, profile: str, spec: str, seed: int, model: LinkModel) -> "LinkProfile":
        """Parse `profile`, which is `spec` or a clause of it; raises ConfigurationError, which quotes `spec`."""
        check_seed_and_model(seed, model)
        fields = read_fields(profile, spec, model)
        try:
            return cls(**fields, seed=seed, model=model, words=" ".join(profile.split()))
        except ValueError as error:
            raise ConfigurationError(f"link {spec!r}: {error}") from error

    def mean_delay_s(self) -> float:
        """Return the mean delay of the profile in seconds, without the effects of rate and retransmission."""
        if self.trace is not None:
            known_s = [delay_s for delay_s in self.trace.delays_s if delay_s is not None]
            return math.fsum(known_s) / len(known_s)
        return moments(self.delay_s, self.jitter_s, self.distribution)[0]

    def recovery_s(self) -> float:
        """Return the time after which a lost message is sent again in the model `stream`, in seconds.

        It is `retransmit_s` or, if that is None, 5/4 of the round trip, but at least 1 ms. That is the recovery of
        TCP's RACK (RFC 8985): the acknowledgement of a later message shows that a message is missing, and a quarter of
        the least round trip is allowed for reordering. Lost retransmissions are found likewise. The time holds for a
        steady flow: the last message before a silence would wait for a time-out, on Linux 200 ms or more. Congestion
        control is not emulated: bursts of loss shrink TCP's window and add more delay than this.
        """
        if self.retransmit_s is not None:
            return self.retransmit_s
        round_trip_s = 2.0 * self.mean_delay_s() if self.round_trip_s is None else self.round_trip_s
        return max(_RECOVERY_ROUND_TRIPS * round_trip_s, _SHORTEST_RECOVERY_S)

    def retransmitted_share(self) -> float:
        """Return the share of transmissions that are lost or corrupted, and so repeated in the model `stream`."""
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
    """Return the values of the Literal type `literal`, joined by commas, for messages."""
    return ", ".join(get_args(literal))
