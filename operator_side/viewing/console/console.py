"""The console as whoever feeds it sees it: a process beside ours, which ours never waits for."""

from collections import deque
from collections.abc import Mapping
from typing import Any, Final, Self

import msgspec

from common.companion.process import Companion
from operator_side.viewing.facts import OperatorFacts

_VIDEO_WAITS_BYTES: Final = 1 << 18
"""Pictures are left out while more than this waits: a later one is newer."""
_FACTS_WAIT_BYTES: Final = 1 << 20
_MOST_HEARD: Final = 256
_END_LIMIT_S: Final = 0.3
"""It may still be starting, and has nothing to lose."""


PageWords = tuple[int, dict[str, Any] | None]
"""Which of the pages of this run, and its `hands`, what it wants to `tune`, or to `play`; None: this page is gone."""


class Console:
    """The browser console; without viser there is none, which a note says."""

    def __init__(self, title: str, *, port: int = 0, live: bool = True) -> None:
        """Start it on `port` of this machine, 0 for any; `live`: no recording."""
        self.address: str | None = None
        """Where its page is, with the token that lets in; None until it is ready, and when it is gone."""
        self.pages = 0
        """How many are open: with none, nothing needs to be sent or rendered."""
        self.lacks: tuple[int, int] | None = None
        """As in `Watch`; None until it is known that pictures in H.264 can be shown."""
        self.came = 0
        """How often one came to look."""
        self.words: deque[PageWords] = deque(maxlen=_MOST_HEARD)
        """What the pages said, the oldest first, for whoever takes it."""
        self._handling: set[int] = set()
        """The pages that have said something of their hands, and are not gone."""
        self._notes: list[str] = []
        self.gone = False
        """Whether there is none any more; a note says why."""
        self._companion = Companion("operator_side.viewing.console", [str(port)])
        self._companion.channel.send(b"r", msgspec.msgpack.encode({"title": title, "live": live}))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def fileno(self) -> int:
        """To wait for what it says."""
        return self._companion.channel.fileno()

    def facts(self, facts: OperatorFacts) -> None:
        """Show these, unless it does not keep up."""
        if self.pages and self._companion.channel.waiting < _FACTS_WAIT_BYTES:
            self._companion.channel.send(b"f", msgspec.msgpack.encode(facts))

    def view(self, payload: bytes, *, video: bool) -> None:
        """Show what the robot side published, as it came; `video`: the next picture is as good."""
        if self.pages and not (video and self._companion.channel.waiting > _VIDEO_WAITS_BYTES):
            self._companion.channel.send(b"v", payload)

    def played(self, state: Mapping[str, Any]) -> None:
        """Show where a recording is: `at_s`, `length_s`, `speed`, `paused`."""
        self._companion.channel.send(b"p", msgspec.msgpack.encode(state))

    def note(self, text: str) -> None:
        """Show a line that stays."""
        self._companion.channel.send(b"n", text.encode())

    def receive(self) -> None:
        """Take what the console says; call it often."""
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
            self._end("the console has ended; the run goes on without it")

    def _hear(self, page: int, said: dict[str, Any] | None) -> None:
        self.words.append((page, said))
        if said is None:
            self._handling.discard(page)
        elif "hands" in said:
            self._handling.add(page)

    def _end(self, why: str) -> None:
        """Whoever watched sees no more; whose hands moved something through a page is gone, too."""
        self.gone, self.address = True, None
        self.pages = 0
        for page in sorted(self._handling):
            self._hear(page, None)
        self._notes.append(why)

    def take_notes(self) -> list[str]:
        """Lines for people since the last call."""
        taken, self._notes = self._notes, []
        return taken

    def close(self) -> None:
        """End it, at once."""
        self._companion.close(_END_LIMIT_S)
