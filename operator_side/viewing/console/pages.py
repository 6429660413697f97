"""Open pages: each receives the newest message of every kind at its own pace, and sends the operator's inputs."""

import asyncio
import contextlib
import math
from collections import deque
from collections.abc import Callable
from typing import Any, Final

import msgspec
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from common.protocol.view_messages import VIEW_NAMES
from operator_side.viewing.facts import ShownKind

MOST_PAGES: Final = 8
"""Maximum number of open pages, and of pages that draw the scene"""
_MOST_NOTES: Final = 50
"""Maximum number of notes kept for later pages"""
_A_SECOND: Final = 500
"""Maximum number of messages from a page in a second, for inputs 50 times a second and at each change"""
_TOO_MANY, _NOT_OURS = 1013, 1008
"""WebSocket close codes: try again later; policy violation"""

_RECENT_S, _FROZEN_S = 1.0, 10.0
"""Time in seconds whose answers count; and age from which an answer is no lateness: the page has been halted"""
_TAIL: Final = 0.9
_MOST_AGES: Final = 100

ROUND_ENDS: Final = f'{{"kind":"{ShownKind.END}"}}'
"""Message that a page answers with `taken`"""

Heard = Callable[[str, bytes], None]
"""Callback for a page's message: called with `s` and a PageWords in MessagePack"""


class Said(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Message of a page, in JSON. The operator side validates the content of the first four fields."""

    hands: dict[str, Any] | None = None
    tune: dict[str, Any] | None = None
    mark: str | None = None
    play: dict[str, Any] | None = None
    again: bool | None = None
    """Whether the person wants to start the run again"""
    slow: bool | None = None
    """Whether the page's browser draws the scene without a graphics processor"""
    looks: bool | None = None
    """Whether the page's tab is visible; a hidden tab is sent only lasting messages"""
    taken: bool | None = None
    """Answer to ROUND_ENDS: the next batch may follow. True with the next frame that is drawn; False if none is, as the
    window is covered. Without this answer a slow page would fall behind without limit, as browsers queue all unread
    messages."""


PASSED_ON: Final = ("hands", "tune", "mark", "play", "again")
"""Fields that the operator side gets"""


class _Page:
    """Queue of one page: only the newest message of each kind, so that a slow page skips messages but is not late."""

    def __init__(self) -> None:
        self.newest: dict[str, bytes | str] = {}
        self.something = asyncio.Event()
        self.taken = asyncio.Event()
        self.slow = False
        self.looks = True
        self._asked_s: float | None = None
        """Time of the newest batch; None once it is answered"""
        self._covered = False
        self._ages_s: deque[tuple[float, float]] = deque(maxlen=_MOST_AGES)
        """Times and ages of the newest answers"""
        self._pictures: deque[tuple[float, bool]] = deque(maxlen=_MOST_AGES)
        """Times of the newest pictures, and whether each replaced one that was not sent yet"""

    def queue(self, kind: str, message: bytes | str, now_s: float) -> None:
        """Queue a message, in place of an unsent one of the same kind."""
        if kind in VIEW_NAMES:
            self._pictures.append((now_s, kind in self.newest))
        self.newest[kind] = message
        self.something.set()

    def answered(self, now_s: float, *, drawn: bool) -> None:
        """Note an answer to the newest batch. drawn: whether it came with a frame; a covered window draws none."""
        if self._asked_s is not None and drawn:
            self._ages_s.append((now_s, now_s - self._asked_s))
        self._asked_s = None
        self._covered = not drawn
        self.taken.set()

    def hide(self) -> None:
        """Expect no answer: a hidden page draws no frames."""
        self._asked_s = None
        self._ages_s.clear()
        self.taken.set()

    def late(self, now_s: float) -> tuple[float, float] | None:
        """Return the age of answers, in seconds, that one in ten of the last second exceeds, and the share of pictures
        skipped; None without an answer, or if the page's window is covered.
        """
        if self._covered:
            return None
        ages_s = [age_s for at_s, age_s in self._ages_s if now_s - at_s < _RECENT_S]
        if self._asked_s is not None:
            ages_s.append(now_s - self._asked_s)
        ages_s = [age_s for age_s in ages_s if age_s < _FROZEN_S]
        if not ages_s:
            return None
        skipped = [skipped for at_s, skipped in self._pictures if now_s - at_s < _RECENT_S]
        return sorted(ages_s)[math.ceil(_TAIL * len(ages_s)) - 1], sum(skipped) / max(len(skipped), 1)

    async def send(self, connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):  # `_listen` notices it, too
            while True:
                await self.something.wait()
                self.something.clear()
                self.taken.clear()
                this_round, self.newest = self.newest, {}
                self._asked_s = asyncio.get_running_loop().time()
                for message in (*this_round.values(), ROUND_ENDS):
                    await connection.send(message)
                await self.taken.wait()


class Pages:
    """All open pages; used only in the server's thread."""

    def __init__(self, changed: Callable[[int], None], heard: Heard) -> None:
        """changed: called with the number of visible pages, at each change. heard: called for each page's message."""
        self._changed = changed
        self._heard = heard
        self._pages: dict[int, _Page] = {}
        self._number = 0
        self._lasting: dict[str, bytes | str] = {}
        self._noted = 0

    @property
    def slow(self) -> bool:
        """Whether any page draws the scene slowly."""
        return any(page.slow for page in self._pages.values())

    def late(self, now_s: float) -> tuple[float, float] | None:
        """Return how late the visible pages' answers are, in seconds, and the share of pictures that they skip.

        Both are of the page that has the greatest; None without an answer.
        """
        pages = (page.late(now_s) for page in self._pages.values() if page.looks)
        known = [late for late in pages if late is not None]
        return (max(late_s for late_s, _ in known), max(skips for _, skips in known)) if known else None

    def show(self, kind: str, message: bytes | str, *, lasting: bool = False) -> None:
        """Queue a message for the visible pages; it replaces an unsent one of the same kind.

        lasting: also for hidden pages, and for pages that open later.
        """
        if lasting:
            self._lasting.pop(kind, None)  # the newest comes last
            self._lasting[kind] = message
        now_s = asyncio.get_running_loop().time()
        for page in self._pages.values():
            if page.looks or lasting:
                page.queue(kind, message, now_s)

    def note(self, message: str) -> None:
        """Send a note to every page, also to those that open later."""
        self._noted += 1
        self.show(f"{ShownKind.NOTE} {self._noted % _MOST_NOTES}", message, lasting=True)

    async def serve(self, connection: ServerConnection) -> None:
        """Serve one page until it closes."""
        if len(self._pages) >= MOST_PAGES:
            await connection.close(_TOO_MANY, f"{MOST_PAGES} pages are open")
            return
        self._number += 1
        number, page = self._number, _Page()
        page.newest.update(self._lasting)
        if page.newest:
            page.something.set()
        self._pages[number] = page
        self._count()
        sending = asyncio.create_task(page.send(connection))
        try:
            with contextlib.suppress(ConnectionClosed):
                await self._listen(number, page, connection)
        finally:
            sending.cancel()
            del self._pages[number]
            self._count()
            self._heard("s", msgspec.msgpack.encode((number, None)))

    def _count(self) -> None:
        self._changed(sum(page.looks for page in self._pages.values()))

    async def _listen(self, number: int, page: _Page, connection: ServerConnection) -> None:
        loop = asyncio.get_running_loop()
        since_s, count = loop.time(), 0
        async for message in connection:
            now_s = loop.time()
            if now_s - since_s > 1.0:
                since_s, count = now_s, 0
            count += 1
            try:
                said = msgspec.json.decode(message if isinstance(message, str) else b"", type=Said)
                words = {name: value for name in PASSED_ON if (value := getattr(said, name)) is not None}
                encoded = msgspec.msgpack.encode((number, words))
            except (msgspec.DecodeError, RecursionError, OverflowError):  # an integer of more than 64 bits
                said = None
            if said is None or count > _A_SECOND:
                await connection.close(_NOT_OURS)
                return
            if said.taken is not None:
                page.answered(now_s, drawn=said.taken)
            if said.slow is not None:
                page.slow = said.slow
            if said.looks is not None and said.looks != page.looks:
                page.looks = said.looks
                if not page.looks:
                    page.hide()
                self._count()
            if words:
                self._heard("s", encoded)
