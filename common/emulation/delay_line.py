"""Delay line, which applies an emulated link's profile to messages."""

import heapq
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Generic, TypeVar, cast

import numpy as np

from common.emulation.clauses import Chance
from common.emulation.distribution import delays_at
from common.emulation.figures import LinkFigures
from common.emulation.loss import decisions, uniform_blocks
from common.emulation.profile import LinkProfile
from common.emulation.spec import Direction, Stream

Item = TypeVar("Item")
BitFlip = Callable[[bytes], bytes]
Corrupt = Callable[[Item, BitFlip], Item]

_MOST_RETRANSMISSIONS = 1000

_MOST_OUTAGES_ON_END = 1000


class DelayLine(Generic[Item]):
    """Delay line, which returns messages when they are due, with losses, copies, corruption and reordering.

    The order of events is netem's: duplicate, lose, corrupt, drop beyond the limit, delay. A copy precedes its
    original, and has events of its own. The line has no thread: `next_due` returns when to call `pop`. The same
    profile, pushes and times give the same deliveries.
    """

    def __init__(
        self, profile: LinkProfile, start_s: float | None = None, corrupt: Corrupt[Item] | None = None
    ) -> None:
        """Outages count from `start_s`; None: from the first push.

        `corrupt(item, flip)` returns the item with a part replaced by `flip(part)`, which flips one bit of bytes. It is
        needed if the profile corrupts items that are not bytes.
        """
        self.figures = LinkFigures(profile.seed)
        """Counts and statistics of the messages so far."""
        self._start_s = start_s
        self._corrupt = corrupt
        self._queue: list[tuple[float, int, Item, float, int, int, bool]] = []
        """Heap of waiting messages, ordered by due time, then by order of arrival."""
        self._entered = 0
        self._last_due_s = -math.inf
        self._follow(profile)

    def begin(self, now_s: float) -> None:
        """Count outages from `now_s`, unless they count already: those of a link's streams coincide."""
        if self._start_s is None:
            self._start_s = now_s

    def change(self, profile: LinkProfile) -> None:
        """Apply `profile` from the next push on; waiting messages keep their due times, and the figures continue."""
        if profile != self.profile:
            self._follow(profile)

    def _follow(self, profile: LinkProfile) -> None:
        self.profile = profile
        self._since_reordered = 0
        self._in_order = profile.model == "stream"
        self._outages = profile.outages
        self._rate = profile.rate
        self._mean_delay_s = profile.mean_delay_s()
        self._trace = None if profile.trace is None else profile.trace.delays_s
        self._recovery_s = profile.recovery_s() if self._in_order else 0.0

        def generator(number: int) -> np.random.Generator:
            # One for each mechanism: adding loss changes no delay.
            return np.random.default_rng(np.random.SeedSequence(profile.seed, spawn_key=(number,)))

        def chances(chance: Chance | None, number: int) -> Iterator[bool] | None:
            if chance is None or chance.share == 0.0:
                return None
            return decisions(generator(number), chance.share, chance.correlation)

        self._delays_s = _endless_delays(profile, generator(0))
        self._losses = None if profile.loss is None else profile.loss.losses(generator(1))
        self._duplicates = None if self._in_order else chances(profile.duplicate, 2)
        self._corruptions = chances(profile.corrupt, 3)
        self._reorders = chances(profile.reorder, 4)
        self._bits = generator(6)
        self._lost_again = decisions(generator(7), profile.retransmitted_share())

    def push(self, now_s: float, item: Item, size_bytes: int | None = None) -> None:
        """Add the message `item` at `now_s`. `size_bytes`, which a rate needs, is by default the length of bytes.

        Raises ValueError for a time that is not finite, a negative size, or a missing size with a rate. Also if the
        profile corrupts messages, `item` is not bytes, and the line has no `corrupt`.
        """
        if not math.isfinite(now_s):
            raise ValueError(f"now_s = {now_s}; valid: finite seconds")
        if size_bytes is None:
            if isinstance(item, (bytes, bytearray)):
                size_bytes = len(item)
            elif self._rate is not None:
                raise ValueError("size_bytes is missing; valid: the bytes of an item that is not bytes itself")
            else:
                size_bytes = 0
        elif size_bytes < 0:
            raise ValueError(f"size_bytes = {size_bytes}; valid: 0 or more")
        if self._corruptions is not None and self._corrupt is None and not isinstance(item, (bytes, bytearray)):
            raise ValueError("item is not bytes, which the profile corrupts; valid: bytes, or a line with `corrupt`")
        if self._start_s is None:
            self._start_s = now_s
        number = self.figures.sent
        self.figures.sent += 1
        if self._in_order:
            self._push_stream(now_s, item, number, size_bytes)
        else:
            self._push_datagram(now_s, item, number, size_bytes)

    def pop(self, now_s: float) -> list[Item]:
        """Return the messages due by `now_s`, in order of due time; those of the same due time in order of `push`.

        Raises ValueError for a time that is not finite.
        """
        if not math.isfinite(now_s):
            raise ValueError(f"now_s = {now_s}; valid: finite seconds")
        due: list[Item] = []
        queue = self._queue
        while queue and queue[0][0] <= now_s:
            due_s, _, item, sent_s, number, size_bytes, copy = heapq.heappop(queue)
            self.figures.add_delivered(now_s, sent_s, due_s, number, size_bytes, copy=copy)
            due.append(item)
        return due

    def next_due(self) -> float | None:
        """Return the time at which the next message is due, on the clock of `push`; None if none waits."""
        return self._queue[0][0] if self._queue else None

    def backlog_s(self, now_s: float) -> float:
        """Return the queueing delay, in seconds, that the rate would cause for a message pushed now."""
        if self._rate is None:
            return 0.0
        return max(0.0, self._last_due_s - now_s - self._mean_delay_s)

    @property
    def waiting(self) -> int:
        """Number of messages that have not been returned yet."""
        return len(self._queue)

    def summary(self) -> dict[str, Any]:
        """Return the requested profile (`asked`, in the grammar's words), model, seed, and the figures `achieved`."""
        return {
            "asked": self.profile.words,
            "model": self.profile.model,
            "seed": self.profile.seed,
            "achieved": self.figures.achieved() | {"waiting": self.waiting},
        }

    def _push_datagram(self, now_s: float, item: Item, number: int, size_bytes: int) -> None:
        if self._outage_end_s(now_s) is not None:
            self.figures.outage += 1
            return
        traced_s: float | None = None
        if self._trace is not None:
            traced_s = self._trace[number % len(self._trace)]
            if traced_s is None:
                self.figures.lost += 1
                return
        doubled = self._duplicates is not None and next(self._duplicates)
        lost = self._losses is not None and next(self._losses)
        if lost and not doubled:
            self.figures.lost += 1
            return
        # Duplicated and lost at once leaves one message.
        if doubled and not lost and not (self._losses is not None and next(self._losses)):
            self.figures.duplicated += 1
            self._admit(now_s, item, number, size_bytes, traced_s, copy=True)
        self._admit(now_s, item, number, size_bytes, traced_s, copy=False)

    def _admit(
        self, now_s: float, item: Item, number: int, size_bytes: int, traced_s: float | None, *, copy: bool
    ) -> None:
        if self._corruptions is not None and next(self._corruptions):
            self.figures.corrupted += 1
            flip = self._flip_one_bit
            item = self._corrupt(item, flip) if self._corrupt else cast(Item, flip(cast(bytes, item)))
        if len(self._queue) >= self.profile.limit:
            self.figures.dropped += 1
            return
        self._enqueue(now_s, self._due_s(now_s, size_bytes, traced_s), item, number, size_bytes, copy=copy)

    def _push_stream(self, now_s: float, item: Item, number: int, size_bytes: int) -> None:
        if len(self._queue) >= self.profile.limit:
            self.figures.dropped += 1
            return
        sent_s = self._after_outage_s(now_s)
        self.figures.held += sent_s > now_s
        traced_s = None if self._trace is None else self._trace[number % len(self._trace)]
        corrupted = self._corruptions is not None and next(self._corruptions)
        self.figures.corrupted += corrupted
        missing = corrupted or (self._losses is not None and next(self._losses))
        if self._trace is not None and traced_s is None:
            missing = True
            traced_s = self._next_traced_s(number)
        tries = 0
        while missing and tries < _MOST_RETRANSMISSIONS:
            tries += 1
            sent_s = self._after_outage_s(sent_s + self._recovery_s)
            # A round trip later a burst of loss is over: use the long-run share.
            missing = next(self._lost_again)
        self.figures.retransmitted += tries
        due_s = max(self._due_s(sent_s, size_bytes, traced_s), self._last_due_s)
        self._last_due_s = due_s
        self._enqueue(now_s, due_s, item, number, size_bytes, copy=False)

    def _due_s(self, now_s: float, size_bytes: int, traced_s: float | None) -> float:
        if self._reorders is not None:
            if self._since_reordered >= self.profile.gap - 1 and next(self._reorders):
                self._since_reordered = 0
                return now_s
            self._since_reordered += 1
        due_s = now_s + (next(self._delays_s) if traced_s is None else traced_s)
        if self._rate is not None:
            due_s = max(due_s, self._last_due_s) + self._rate.transmission_s(size_bytes)
            self._last_due_s = due_s
        return due_s

    def _enqueue(self, now_s: float, due_s: float, item: Item, number: int, size_bytes: int, *, copy: bool) -> None:
        heapq.heappush(self._queue, (due_s, self._entered, item, now_s, number, size_bytes, copy))
        self._entered += 1

    def _flip_one_bit(self, payload: bytes) -> bytes:
        if not payload:
            return payload
        altered = bytearray(payload)
        byte, bit = divmod(int(self._bits.integers(8 * len(altered))), 8)
        altered[byte] ^= 1 << bit
        return bytes(altered)

    def _next_traced_s(self, number: int) -> float:
        trace = self._trace or ()
        return next(
            delay_s for step in range(1, len(trace) + 1) if (delay_s := trace[(number + step) % len(trace)]) is not None
        )

    def _outage_end_s(self, now_s: float) -> float | None:
        """Return the latest end of the outages that contain `now_s`; None outside of all outages."""
        start_s = self._start_s
        if not self._outages or start_s is None:
            return None
        ends_s = [end_s for outage in self._outages if (end_s := outage.end_s(now_s - start_s)) is not None]
        return start_s + max(ends_s) if ends_s else None

    def _after_outage_s(self, now_s: float) -> float:
        # One outage may end within another, and that within the first one's next repetition.
        for _ in range(_MOST_OUTAGES_ON_END):
            if (end_s := self._outage_end_s(now_s)) is None or end_s <= now_s:
                break
            now_s = end_s
        return now_s


def _endless_delays(profile: LinkProfile, generator: np.random.Generator) -> Iterator[float]:
    if profile.jitter_s == 0.0:
        while True:
            yield profile.delay_s
    for block in uniform_blocks(generator):
        yield from delays_at(block, profile.delay_s, profile.jitter_s, profile.distribution).tolist()


def link_summary(direction: Direction, lines: Mapping[Stream, DelayLine[Any]]) -> dict[str, Any]:
    """Return the part `link` of a run's summary: the summary of each stream's line.

    The keys are the direction for haptics, else direction and stream, such as `to_robot.video`.
    """
    return {
        direction if stream == "haptics" else f"{direction}.{stream}": line.summary() for stream, line in lines.items()
    }
