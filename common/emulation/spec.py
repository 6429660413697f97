"""Profiles of the emulated link for each direction and stream, parsed from one specification."""

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from common.emulation.clauses import LinkModel
from common.emulation.grammar import GRAMMAR
from common.emulation.named_links import NAMED_LINKS, with_names_spelled_out
from common.emulation.profile import LinkProfile, check_seed_and_model, choices
from common.errors import ConfigurationError

Direction = Literal["to_robot", "to_operator"]
Stream = Literal["haptics", "telemetry", "video", "scene"]


@dataclass(frozen=True)
class LinkSpec:
    """Profiles of the emulated link for each direction and stream.

    For a stream in a direction the first of these clauses applies: that of both (`to_operator.video`), of the stream
    (`video`), of the direction (`to_operator`), without a name.
    """

    clauses: Mapping[str, LinkProfile] = field(default_factory=dict)
    """Profiles, keyed by the clause's name, which is empty for the clause without one. Their seeds are not used."""
    seed: int = 0
    model: LinkModel = "datagram"

    @classmethod
    def parse(cls, spec: str, seed: int = 0, model: LinkModel = "datagram") -> "LinkSpec":
        """Parse `[PROFILE;] [NAME: PROFILE;] ...`; NAME is a direction, a stream or `DIRECTION.STREAM`.

        A link's name, such as `wifi`, is replaced by the link's words. Raises ConfigurationError, in one line, for an
        unknown or repeated name and for a bad profile.
        """
        check_seed_and_model(seed, model)
        clauses: dict[str, LinkProfile] = {}
        for clause in filter(str.strip, with_names_spelled_out(spec).split(";")):
            if (word := clause.strip()).replace("-", "").isalpha() and word not in GRAMMAR:
                raise ConfigurationError(
                    f"link {spec!r}: {word!r} is neither a link's name nor a clause; valid: {', '.join(NAMED_LINKS)},"
                    " or netem's words, such as 'delay 50ms 10ms distribution normal loss 1%'"
                )
            before, colon, after = clause.partition(":")
            # A later colon belongs to a file's name.
            named = bool(colon) and len(before.split()) <= 1
            name, profile = (before.strip(), after) if named else ("", clause)
            if named and name not in _names():
                raise ConfigurationError(f"link {spec!r}: unknown name {name!r}; valid: {_valid_names()}")
            if name in clauses:
                what = repr(name) if name else "a profile without a name"
                raise ConfigurationError(
                    f"link {spec!r}: {what} is given twice; "
                    f"valid: one profile without a name and one for each of {_valid_names()}"
                )
            clauses[name] = LinkProfile.parse_within(profile, spec, seed, model)
        return cls(clauses, seed, model)

    def profile(self, direction: Direction, stream: Stream = "haptics") -> LinkProfile:
        """Return the profile of `stream` in `direction`. Each has its own seed, so that no two are correlated."""
        directions, streams = get_args(Direction), get_args(Stream)
        if direction not in directions:
            raise ValueError(f"direction = {direction!r}; valid: {choices(Direction)}")
        if stream not in streams:
            raise ValueError(f"stream = {stream!r}; valid: {choices(Stream)}")
        key = (directions.index(direction), streams.index(stream))
        seed = int(np.random.SeedSequence(self.seed, spawn_key=key).generate_state(1, np.uint64)[0])
        back: Direction = "to_operator" if direction == "to_robot" else "to_robot"
        there = self._clause(direction, stream)
        round_trip_s = there.mean_delay_s() + self._clause(back, stream).mean_delay_s()
        return dataclasses.replace(there, seed=seed, round_trip_s=round_trip_s)

    def unused(self, carried: Iterable[tuple[Direction, Stream]]) -> list[str]:
        """Return the names of clauses that apply to none of `carried`, the (direction, stream) pairs that are sent.

        Where another clause applies, those for the other direction are none of them: both sides may be given the same
        specification, and a link's name, such as `lte`, has a clause for each direction.
        """
        pairs = list(carried)
        used = {self._clause_name(direction, stream) for direction, stream in pairs} - {None}
        elsewhere = set(get_args(Direction)) - {direction for direction, _ in pairs} if used else set()
        return [name for name in self.clauses if name not in used and name.partition(".")[0] not in elsewhere]

    def _clause_name(self, direction: Direction, stream: Stream) -> str | None:
        for name in (f"{direction}.{stream}", stream, direction, ""):
            if name in self.clauses:
                return name
        return None

    def _clause(self, direction: Direction, stream: Stream) -> LinkProfile:
        name = self._clause_name(direction, stream)
        nothing = LinkProfile(model=self.model)
        return nothing if name is None else self.clauses[name]


def unused_clauses(link: LinkSpec, carried: Iterable[tuple[Direction, Stream]]) -> list[str]:
    """Return a line to show for each clause of `link` that applies to none of `carried`, the pairs that are sent."""
    return [
        f"--link: {f'{name!r}' if name else 'the profile without a name'} changes nothing:"
        f" {'this side sends no such messages' if name else 'each stream that this side sends has its own'}"
        for name in link.unused(carried)
    ]


def clause_names() -> list[str]:
    """Return the names that clauses may have; a clause without a name has the empty one."""
    return ["", *_names()]


def _names() -> list[str]:
    directions, streams = get_args(Direction), get_args(Stream)
    return [*directions, *streams, *(f"{direction}.{stream}" for direction in directions for stream in streams)]


def _valid_names() -> str:
    first_direction, first_stream = get_args(Direction)[0], get_args(Stream)[0]
    return f"{', '.join([*get_args(Direction), *get_args(Stream)])}, or both as {first_direction}.{first_stream}"
