"""Emulated links: a profile in netem's words, and the line that delays messages by it.

`LinkProfile` is one bare profile, `LinkSpec` tells directions and streams apart, `DelayLine` delays.
"""

import heapq
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Generic, Literal, TypeVar, cast, get_args

import numpy as np

from common.delay_distribution import Distribution, draw_delays
from common.errors import ConfigurationError
from common.statistics import RunningStatistics
from common.units import parse_duration

LinkModel = Literal["datagram", "stream"]
Direction = Literal["to_robot", "to_operator"]
Stream = Literal["haptics", "telemetry", "video"]

QUEUE_LIMIT = 1000
"""netem's own limit, in messages: what comes on top is dropped."""

_DRAWN_AT_ONCE = 256
_GRAMMAR = "delay TIME [JITTER] [distribution uniform|normal], or nothing for no delay"

Item = TypeVar("Item")


@dataclass(frozen=True)
class LinkProfile:
    """The delay of one direction of one stream.

    `datagram` delivers each message when it is due, so that jitter reorders; `stream` keeps the order, as TCP
    does: nothing is due before what was sent earlier.
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    """Half the range (uniform) or the standard deviation (normal)."""
    distribution: Distribution = "uniform"
    seed: int = 0
    model: LinkModel = "datagram"

    def __post_init__(self) -> None:
        for name, seconds in (("delay_s", self.delay_s), ("jitter_s", self.jitter_s)):
            if not (math.isfinite(seconds) and seconds >= 0.0):
                raise ValueError(f"{name} = {seconds} is negative or not finite; valid: 0 or more seconds")
        if self.distribution not in get_args(Distribution):
            raise ValueError(f"distribution = {self.distribution!r}; valid: {_choices(Distribution)}")
        _check_seed_and_model(self.seed, self.model)

    @classmethod
    def parse(cls, spec: str, seed: int = 0, model: LinkModel = "datagram") -> "LinkProfile":
        """Read one bare profile such as `delay 50ms 10ms distribution normal`; empty means no delay.

        ConfigurationError, in one line, for whatever is unknown, not supported yet, negative or without unit.
        """
        _check_seed_and_model(seed, model)
        return _parse_profile(spec, spec, seed, model)


@dataclass(frozen=True)
class LinkSpec:
    """Profiles by direction and stream: a stream's clause wins over a direction's, and that over the bare one."""

    clauses: Mapping[str, LinkProfile] = field(default_factory=dict)
    """By direction or stream; the bare profile under the empty name. Their seeds are not used."""
    seed: int = 0
    model: LinkModel = "datagram"

    @classmethod
    def parse(cls, spec: str, seed: int = 0, model: LinkModel = "datagram") -> "LinkSpec":
        """Read `[PROFILE;] [to_robot|to_operator|haptics|telemetry|video: PROFILE;] ...`.

        ConfigurationError, in one line, for an unknown or repeated name and for a bad profile.
        """
        _check_seed_and_model(seed, model)
        clauses: dict[str, LinkProfile] = {}
        for clause in filter(str.strip, spec.split(";")):
            before, colon, after = clause.partition(":")
            name, profile = (before.strip(), after) if colon else ("", clause)
            valid = get_args(Direction) + get_args(Stream)
            if colon and name not in valid:
                raise ConfigurationError(f"link {spec!r}: unknown name {name!r}; valid: {', '.join(valid)}")
            if name in clauses:
                what = repr(name) if name else "a profile without a name"
                raise ConfigurationError(
                    f"link {spec!r}: {what} stands there twice; "
                    f"valid: one profile without a name and one for each of {', '.join(valid)}"
                )
            clauses[name] = _parse_profile(profile, spec, seed, model)
        return cls(clauses, seed, model)

    def profile(self, direction: Direction, stream: Stream = "haptics") -> LinkProfile:
        """The profile of `stream` in `direction`, with a seed of its own so that no two are correlated."""
        directions, streams = get_args(Direction), get_args(Stream)
        if direction not in directions:
            raise ValueError(f"direction = {direction!r}; valid: {_choices(Direction)}")
        if stream not in streams:
            raise ValueError(f"stream = {stream!r}; valid: {_choices(Stream)}")
        key = (directions.index(direction), streams.index(stream))
        seed = int(np.random.SeedSequence(self.seed, spawn_key=key).generate_state(1, np.uint64)[0])
        for name in (stream, direction, ""):
            if (chosen := self.clauses.get(name)) is not None:
                return LinkProfile(chosen.delay_s, chosen.jitter_s, chosen.distribution, seed, self.model)
        return LinkProfile(seed=seed, model=self.model)


class DelayLine(Generic[Item]):
    """Holds each message until it is due.

    It never runs by itself: ask `next_due` when to call `pop`. The same profile, pushes and times give the
    same deliveries.
    """

    def __init__(self, profile: LinkProfile) -> None:
        self.dropped = 0
        """Messages refused because `QUEUE_LIMIT` were waiting already."""
        self._in_order = profile.model == "stream"
        self._delays_s = _endless_delays(profile)
        self._queue: list[tuple[float, int, Item]] = []
        self._pushed = 0
        self._last_due_s = -math.inf
        self._given = RunningStatistics(profile.seed)

    def push(self, now_s: float, item: Item) -> None:
        """Take `item` in at `now_s`; ValueError when that is not finite."""
        if not math.isfinite(now_s):
            raise ValueError(f"now_s = {now_s}; valid: finite seconds")
        if len(self._queue) >= QUEUE_LIMIT:
            self.dropped += 1
            return
        delay_s = next(self._delays_s)
        if self._in_order:
            delay_s = max(delay_s, self._last_due_s - now_s)
        due_s = now_s + delay_s
        if self._in_order:
            due_s = self._last_due_s = max(due_s, self._last_due_s)
        self._given.add(delay_s)
        heapq.heappush(self._queue, (due_s, self._pushed, item))
        self._pushed += 1

    def pop(self, now_s: float) -> list[Item]:
        """Everything due by `now_s`, in order of due time; at the same due time, in order of `push`."""
        due: list[Item] = []
        while self._queue and self._queue[0][0] <= now_s:
            due.append(heapq.heappop(self._queue)[2])
        return due

    def next_due(self) -> float | None:
        """When the next message is due, in seconds on the clock of `push`; None while nothing waits."""
        return self._queue[0][0] if self._queue else None

    def achieved(self) -> dict[str, float | None]:
        """`count`, and `mean_s` and `sd_s` of the delays given so far, None before there are any."""
        return {"count": self._given.count, "mean_s": self._given.mean, "sd_s": self._given.sd}


def _endless_delays(profile: LinkProfile) -> Iterator[float]:
    generator = np.random.default_rng(profile.seed)
    while True:
        yield from draw_delays(
            generator, _DRAWN_AT_ONCE, profile.delay_s, profile.jitter_s, profile.distribution
        ).tolist()


def _parse_profile(profile: str, spec: str, seed: int, model: LinkModel) -> LinkProfile:
    """Read `profile`, which is `spec` or a clause of it."""
    words = profile.split()
    if not words:
        return LinkProfile(seed=seed, model=model)
    if words[0] != "delay":
        raise _unexpected(words[0], spec)
    if len(words) == 1:
        raise ConfigurationError(f"link {spec!r}: 'delay' without a time; valid: {_GRAMMAR}")
    delay_s = parse_duration(words[1], f"link {spec!r}: delay")
    rest = words[2:]
    jitter_s: float | None = None
    if rest and _begins_a_number(rest[0]) and not rest[0].endswith("%"):
        jitter_s = parse_duration(rest.pop(0), f"link {spec!r}: jitter")
    distribution: Distribution = "uniform"
    if rest and rest[0] == "distribution":
        if jitter_s is None:
            raise ConfigurationError(f"link {spec!r}: 'distribution' without a jitter to shape; valid: {_GRAMMAR}")
        distribution = _parse_distribution(rest[1] if len(rest) > 1 else "", spec)
        rest = rest[2:]
    if rest:
        raise _unexpected(rest[0], spec)
    return LinkProfile(delay_s, jitter_s or 0.0, distribution, seed, model)


def _parse_distribution(name: str, spec: str) -> Distribution:
    for known in get_args(Distribution):
        if name == known:
            return cast(Distribution, known)
    raise ConfigurationError(
        f"link {spec!r}: distribution {name!r} is unknown or not supported yet; valid: {_choices(Distribution)}"
    )


def _begins_a_number(word: str) -> bool:
    return word[0].isdigit() or word[0] in "+-."


def _unexpected(word: str, spec: str) -> ConfigurationError:
    return ConfigurationError(f"link {spec!r}: {word!r} is unknown there or not supported yet; valid: {_GRAMMAR}")


def _check_seed_and_model(seed: int, model: LinkModel) -> None:
    if seed < 0:
        raise ConfigurationError(f"seed = {seed} is negative; valid: 0 or a positive whole number")
    if model not in get_args(LinkModel):
        raise ConfigurationError(f"link model {model!r} is unknown; valid: {_choices(LinkModel)}")


def _choices(literal: object) -> str:
    return ", ".join(get_args(literal))
