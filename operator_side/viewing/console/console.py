"""Console as its feeder sees it: a separate process that never blocks this one."""

from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Self

import msgspec

from common.companion.process import Companion
from operator_side.viewing.facts import OperatorFacts

_VIDEO_WAITS_BYTES: Final = 1 << 18
"""Limit on waiting bytes above which pictures are skipped: a later one is newer."""
_FACTS_WAIT_BYTES: Final = 1 << 20
_MOST_HEARD: Final = 256
_END_LIMIT_S: Final = 0.3
"""Limit on its end, in seconds: it may still be starting, and has nothing to lose."""


PageWords = tuple[int, dict[str, Any] | None]
"""Number of a page in this run, and its `hands`, its wish to `tune`, to `play` or to run `again`; None: it is gone."""


class Console:
    """Browser console; without viser there is none, which a note reports."""

    def __init__(self, title: str, *, port: int = 0, live: bool = True, token: Path | None = None) -> None:
        """Start it on `port` of this machine, 0 for any free one. live: no recording.

        token: file with the token of its address, whose owner can run again; None: a new token.
        """
        self.address: str | None = None
        """Address of its page, with the token; None until it is ready, and when it is gone."""
        self.pages = 0
        """Number of open pages; with none, nothing must be sent or rendered."""
        self.lacks: tuple[int, int] | None = None
        """As in `Watch`; None until it can show pictures in H.264."""
        self.came = 0
        """Number of times that a page was opened."""
        self.words: deque[PageWords] = deque(maxlen=_MOST_HEARD)
        """Words of the pages, oldest first, for the caller to take."""
        self._handling: set[int] = set()
        """Open pages that have sent hands."""
        self._notes: list[str] = []
        self.gone = False
        """Whether it has ended; a note gives the reason."""
        given = [] if token is None else [str(token)]
        self._companion = Companion("operator_side.viewing.console", [str(port), *given])
        run = {"title": title, "live": live, "may_run_again": token is not None}
        self._companion.channel.send(b"r", msgspec.msgpack.encode(run))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def fileno(self) -> int:
        """Return the descriptor to wait for its messages."""
        return self._companion.channel.fileno()

    def facts(self, facts: OperatorFacts) -> None:
        """Show these facts, unless it does not keep up."""
        if self.pages and self._companion.channel.waiting < _FACTS_WAIT_BYTES:
            self._companion.channel.send(b"f", msgspec.msgpack.encode(facts))

    def view(self, payload: bytes, *, video: bool) -> None:
        """Show a payload of the robot side. video: it may be skipped, as the next picture is as good."""
        if self.pages and not (video and self._companion.channel.waiting > _VIDEO_WAITS_BYTES):
            self._companion.channel.send(b"v", payload)

    def played(self, state: Mapping[str, Any]) -> None:
        """Show a recording's position: `at_s`, `length_s`, `speed`, `paused`."""
        self._companion.channel.send(b"p", msgspec.msgpack.encode(state))

    def note(self, text: str) -> None:
        """Show a lasting line."""
        self._companion.channel.send(b"n", text.encode())

    def receive(self) -> None:
        """Take the console's messages; call it often."""
        channel = self._companion.channel
        if self.gone:
            return
        for message in channel.receive():
            kind, content = message[:1], message[1:]
            if kind == b"a":
                self.address = content.decode()
            elif kind == b"w":
                before, self.pages = self.pages, int(content)
                self.came += self.pages > before
            elif kind == b"l":
                self.lacks = msgspec.msgpack.decode(content, type=tuple[int, int])
            elif kind == b"e":
                self._end(f"no console: {content.decode()}")
                return
            elif kind == b"s":
                self._hear(*msgspec.msgpack.decode(content, type=PageWords))
        if channel.ended:
            self._end("the console has ended; the run continues without it")

    def _hear(self, page: int, said: dict[str, Any] | None) -> None:
        self.words.append((page, said))
        if said is None:
            self._handling.discard(page)
        elif "hands" in said:
            self._handling.add(page)

    def _end(self, why: str) -> None:
        """Note the end: no page is open, and all hands at pages are gone."""
        self.gone, self.address = True, None
        self.pages = 0
        for page in sorted(self._handling):
            self._hear(page, None)
        self._notes.append(why)

    def take_notes(self) -> list[str]:
        """Return the notes for people since the last call."""
        taken, self._notes = self._notes, []
        return taken

    def close(self) -> None:
        """Tell its pages that the run has ended, and end it at once."""
        self._companion.channel.send(b"d", b"")
        self._companion.channel.flush()
        self._companion.close(_END_LIMIT_S)
