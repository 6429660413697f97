"""Compare the output that a core computes again with the recorded output: equal bit for bit, or how far apart."""

import contextlib
import math
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from common.errors import ConfigurationError, RemoteProtocolError
from common.protocol.codec import decode
from common.protocol.messages import StiffnessUpdate
from common.recording.entries import Block, Entry, unpack_block
from common.recording.reading import Recording
from feelahead.recordings.controller import read_value
from operator_side.controller.feel import Feel

WITHIN_EIGHTHS = 1.0
WITHIN_M = 1e-12
_NEEDED: Final = ("settings", "epoch", "clock_domain")


@dataclass
class Comparison:
    """Counts and largest differences between one side's recorded and recomputed output."""

    side: str
    counted: str
    """Name, in words, of the items that `made` counts"""
    made: int = 0
    equal: int = 0
    others: int = 0
    """Number of other messages; `others_equal` of them were equal"""
    others_equal: int = 0
    worst_eighths: float = 0.0
    """Largest difference of a strength, in eighths; infinite if a message is missing, or differs in anything else"""
    worst_m: float = 0.0
    """Largest difference of a distance, in metres"""
    notes: list[str] = field(default_factory=list)
    """Remarks for the person who compares"""

    @property
    def within(self) -> bool:
        """Whether the differences are no larger than those between two kinds of processor."""
        return self.worst_eighths <= WITHIN_EIGHTHS and self.worst_m <= WITHIN_M

    def compare(self, first: bytes | None, second: bytes | None, *, feel: bool = False) -> None:
        """Compare the recorded message `first` with the recomputed `second`; None for a missing one.

        feel: whether the two are effects for the controller instead.
        """
        counts = feel or _is_stiffness(first if second is None else second) or self.side == "operator"
        same = first == second
        if counts:
            self.made += second is not None
            self.equal += same
        else:
            self.others += 1
            self.others_equal += same
        if same:
            return
        eighths, metres = math.inf, 0.0
        if first is not None and second is not None:
            eighths, metres = _difference(first, second, feel=feel)
        self.worst_eighths = max(self.worst_eighths, eighths)
        self.worst_m = max(self.worst_m, metres)

    def missed(self, made: deque[bytes], *, feel: bool = False) -> None:
        """Count each recomputed item left in `made` as missing in the recording, and remove it."""
        while made:
            self.compare(None, made.popleft(), feel=feel)

    def lines(self) -> list[str]:
        """Return the lines that report the comparison."""
        difference = "none"
        if not math.isfinite(self.worst_eighths):
            difference = "messages are missing, or differ in more than strengths and distances"
        elif self.worst_eighths or self.worst_m or self.equal < self.made:
            difference = f"{self.worst_eighths:g} of 8 in strength, {self.worst_m:.3g} m in distances"
        lines = [
            f"{self.side}: {self.made} {self.counted} recomputed, {self.equal} of them equal bit for bit;"
            f" largest difference: {difference}"
        ]
        if self.others:
            lines.append(f"{self.side}: {self.others} other messages, {self.others_equal} of them equal bit for bit")
        return [*lines, *(f"{self.side}: {note}" for note in self.notes)]


def recorded_entries(recording: Recording, side: str, notes: list[str]) -> Iterator[Entry]:
    """Yield a side's recorded entries in order, up to the first gap, beyond which a core cannot be replayed.

    A reason for an early end is appended to `notes`.
    """
    began_s = None
    for expected, message in enumerate(recording.messages([f"/{side}/inputs"])):
        block: Block = unpack_block(message.content)
        began_s = block.first_s if began_s is None else began_s
        if block.number != expected:
            notes.append(
                f"{block.number - expected} blocks of inputs are missing after {block.first_s - began_s:.1f} s, as the"
                " recorder did not keep up: the comparison ends there"
            )
            return
        yield from block.unpacked()
    if recording.damaged:
        notes.append("the file is damaged: the comparison ends at the damage")
    elif not recording.whole:
        notes.append("the file was cut off: the comparison ends at its last complete second")


def differing_origin(recorded: Mapping[str, object], present: Mapping[str, object]) -> list[str]:
    """Return a line for each difference of processor or kernels between `recorded` and `present`: bits may differ."""
    said = []
    for name, here in present.items():
        there = recorded.get(name)
        if isinstance(there, Mapping) and isinstance(here, Mapping):
            if others := [key for key in there if there[key] != here.get(key)]:
                said.append(f"other {name} ({', '.join(others)[:100]})")
        elif there != here:
            said.append(f"{name} {str(there)[:60]}, here {str(here)[:60]}")
    return [f"recorded with {what}: the last bits of results may differ" for what in said]


def require_side(recording: Recording, side: str) -> Mapping[str, Any]:
    """Return the header of `side`; raises ConfigurationError if it is missing or incomplete."""
    if side not in recording.headers:
        raise ConfigurationError(
            f"{recording.path}: the {side} side was not recorded; valid: {', '.join(recording.headers)}"
        )
    recording.require([f"/{side}/inputs"])
    header = dict(recording.headers[side])
    if missing := [name for name in _NEEDED if name not in header]:
        raise ConfigurationError(
            f"{recording.path}: the header lacks the {side} side's {missing[0]}; valid: a whole recording"
        )
    if "tick_period" not in header["settings"]:
        raise ConfigurationError(
            f"{recording.path}: recorded by an earlier version, as its settings lack tick_period: its {side} side"
            " cannot be replayed; what works: feelahead replay without --check, export, plot"
        )
    return header


def _is_stiffness(payload: bytes | None) -> bool:
    try:
        return payload is not None and isinstance(decode(payload), StiffnessUpdate)
    except RemoteProtocolError:
        return False


def _difference(first: bytes, second: bytes, *, feel: bool) -> tuple[float, float]:
    """Return the largest difference in eighths of strength and in metres; infinite eighths if anything else differs."""
    with contextlib.suppress(RemoteProtocolError):
        if feel:
            return _feel_difference(read_value(first, Feel), read_value(second, Feel))
        one, other = decode(first), decode(second)
        if isinstance(one, StiffnessUpdate) and isinstance(other, StiffnessUpdate):
            return _message_difference(one, other)
    return math.inf, 0.0


def _message_difference(one: StiffnessUpdate, other: StiffnessUpdate) -> tuple[float, float]:
    if (one.header, one.state) != (other.header, other.state):
        return math.inf, 0.0
    eighths, metres = [8.0 * abs(one.rumble - other.rumble)], [abs(one.horizon_m - other.horizon_m)]
    for a, b in ((one.l2, other.l2), (one.r2, other.r2)):
        eighths.append(8.0 * abs(a.course_stiffness - b.course_stiffness))
        metres += [abs(x - y) for x, y in zip((*a.fast_m, *a.slow_m), (*b.fast_m, *b.slow_m), strict=True)]
        metres.append(abs(a.displacement_m - b.displacement_m))
    return max(eighths), max(metres)


def _feel_difference(one: Feel, other: Feel) -> tuple[float, float]:
    apart = [0.0 if (one.rumble, one.light) == (other.rumble, other.light) else math.inf]
    for a, b in ((one.l2, other.l2), (one.r2, other.r2)):
        if a is not None and b is not None:
            apart += [abs(x - y) for x, y in zip(a, b, strict=True)]
        elif a is not b:
            apart.append(math.inf)
    return max(apart), 0.0
