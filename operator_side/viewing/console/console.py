"""Access of the operator side to its console: a separate process that never blocks this one."""

import contextlib
import os
import secrets
import threading
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Self
from urllib.parse import urlsplit

import msgspec

from common.companion.process import Companion
from operator_side.viewing.facts import OperatorFacts

_VIDEO_WAITS_BYTES: Final = 1 << 18
"""Number of waiting bytes above which pictures are skipped, as newer ones follow"""
_FACTS_WAIT_BYTES: Final = 1 << 20
"""Number of waiting bytes above which facts are skipped"""
_MOST_HEARD: Final = 256
"""Maximum number of pages' messages that wait for the caller"""
_MOST_NOTES: Final = 50
"""Maximum number of notes kept for a process that is started again"""
_AGAIN_S: Final = 1.0
"""Seconds from the process's unexpected end until another one is started"""
_MOST_ENDS, _WITHIN_S = 3, 60.0
"""Greatest number of unexpected ends within that many seconds after which another process is started"""
_END_LIMIT_S: Final = 1.0
"""Seconds to wait for the console process to end before it is killed: it has nothing to save"""


_MODULE: Final = "operator_side.viewing.console"

PageWords = tuple[int, dict[str, Any] | None]
"""Number of a page, and its message: any of `PASSED_ON` (pages.py); None if the page has closed."""


class Console:
    """Browser console. Without viser no page is served, and a note says so.

    A process that ends unexpectedly is started again, at the same address. Until then its pages count as closed.
    """

    def __init__(
        self, title: str, *, port: int = 0, live: bool = True, token: Path | None = None, back: Path | None = None
    ) -> None:
        """Start the console process on `port` of this machine; 0 for any free port. live: not a replayed recording.

        token: file with the token of the page's address; pages then offer to run again. None for a random token.
        back: file with the address to which pages go at the end; until then they show nothing that tells a condition.
        """
        self.address: str | None = None
        """Address of the page, with the token; None until the page is ready, and once the process has ended."""
        self.pages = 0
        """Number of visible pages; with 0, nothing need be sent or rendered."""
        self.lacks: tuple[int, int] | None = None
        """As `lacks` in `Watch`; None until the console can show H.264 pictures."""
        self.late: tuple[float, float] | None = None
        """Lateness of the pages' answers, in seconds, and share of pictures skipped; None without a page."""
        self.came = 0
        """Number of times that a page was opened or shown again."""
        self.words: deque[PageWords] = deque(maxlen=_MOST_HEARD)
        """Messages of the pages, oldest first, for the caller to take."""
        self._handling: set[int] = set()
        """Open pages that have sent hands."""
        self._notes: list[str] = []
        self.gone = False
        """Whether the console process has ended for good; a note gives the reason."""
        self._port = port
        self._token = secrets.token_urlsafe(24) if token is None else token.read_text().strip()
        to = None if back is None else back.read_text().strip()
        run = {"title": title, "live": live, "may_run_again": token is not None and to is None, "back": to}
        self._run = msgspec.msgpack.encode(run)
        self._kept: deque[str] = deque(maxlen=_MOST_NOTES)
        self._ends_s: deque[float] = deque(maxlen=_MOST_ENDS + 1)
        """Times of the process's newest unexpected ends"""
        self._again_s: float | None = None
        """Time to start another process; None while one runs or starts"""
        self._started: list[Companion | OSError] = []
        self._starting: threading.Thread | None = None
        """Thread that starts another process, or has done so"""
        self._closed = threading.Event()
        self._companion = Companion(_MODULE)
        self._runs = False
        """Whether a process runs whose end has not been noted"""
        self._begin()

    def _begin(self) -> None:
        companion, self._runs = self._companion, True
        # Not on the command line, which other users of the machine can list.
        companion.channel.send(b"o", msgspec.msgpack.encode((self._port, self._token)))
        companion.channel.send(b"r", self._run)
        for text in self._kept:
            companion.channel.send(b"n", text.encode())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def fileno(self) -> int:
        """Return the file descriptor that becomes readable when the console process sends a message."""
        return self._companion.channel.fileno()

    def facts(self, facts: OperatorFacts) -> None:
        """Show `facts`; skip them if no page is visible or the console process does not keep up."""
        if self.pages and self._companion.channel.waiting < _FACTS_WAIT_BYTES:
            self._companion.channel.send(b"f", msgspec.msgpack.encode(facts))

    def view(self, payload: bytes, *, video: bool) -> None:
        """Show a view payload of the robot side. video: a picture, skipped if the console process does not keep up."""
        if self.pages and not (video and self._companion.channel.waiting > _VIDEO_WAITS_BYTES):
            self._companion.channel.send(b"v", payload)

    def played(self, state: Mapping[str, Any]) -> None:
        """Show a recording's position: `at_s`, `length_s`, `speed`, `paused`."""
        self._companion.channel.send(b"p", msgspec.msgpack.encode(state))

    def note(self, text: str) -> None:
        """Show a line that stays on the pages."""
        self._kept.append(text)
        self._companion.channel.send(b"n", text.encode())

    def receive(self, now_s: float) -> None:
        """Take the messages of the console process, and start it again if it has ended; call it often."""
        self._start_again(now_s)
        channel = self._companion.channel
        if not self._runs:
            return
        for message in channel.receive():
            kind, content = message[:1], message[1:]
            if kind == b"a":
                self.address = content.decode()
                self._port = urlsplit(self.address).port or 0
            elif kind == b"w":
                before, self.pages = self.pages, int(content)
                self.came += self.pages > before
                self.late = self.late if self.pages else None
            elif kind == b"t":
                self.late = msgspec.msgpack.decode(content, type=tuple[float, float])
            elif kind == b"l":
                self.lacks = msgspec.msgpack.decode(content, type=tuple[int, int])
            elif kind == b"e":
                self._end(f"no console: {content.decode()}", for_good=True)
                return
            elif kind == b"s":
                self._hear(*msgspec.msgpack.decode(content, type=PageWords))
        if channel.ended:
            self._ends_s.append(now_s)
            for_good = len(self._ends_s) > _MOST_ENDS and now_s - self._ends_s[0] < _WITHIN_S
            self._again_s = None if for_good else now_s + _AGAIN_S
            then = "the run continues without it" if for_good else "it is started again, and no page drives meanwhile"
            self._end(f"the console has ended; {then}", for_good=for_good)

    def _start_again(self, now_s: float) -> None:
        if self._again_s is not None and now_s >= self._again_s:
            self._again_s = None
            # In a thread, as starting a process takes milliseconds.
            self._starting = threading.Thread(target=_start, args=(self._started, self._closed), daemon=True)
            self._starting.start()
        if self._started:
            started = self._started.pop()
            if isinstance(started, OSError):
                self._end(f"no console: no process can be started: {started.strerror}", for_good=True)
                return
            self._companion.close(0.0)
            self._companion = started
            self._begin()

    def _hear(self, page: int, said: dict[str, Any] | None) -> None:
        self.words.append((page, said))
        if said is None:
            self._handling.discard(page)
        elif "hands" in said:
            self._handling.add(page)

    def _end(self, why: str, *, for_good: bool) -> None:
        """Note the end of the console process: report every page that sent hands as closed."""
        self._runs, self.gone = False, for_good
        self.address, self.pages, self.lacks, self.late = None, 0, None, None
        for page in sorted(self._handling):
            self._hear(page, None)
        self._notes.append(why)

    def take_notes(self) -> list[str]:
        """Return the notes since the last call, for the status."""
        taken, self._notes = self._notes, []
        return taken

    def close(self) -> None:
        """Tell the pages that the run has ended, and end the console process; kill it after `_END_LIMIT_S`.

        A process that is just being started ends, too: here, or after the same time by the thread that starts it.
        """
        self._closed.set()
        self._companion.channel.send(b"d", b"")
        self._companion.channel.flush()
        self._companion.close(_END_LIMIT_S)
        if self._starting is not None:
            self._starting.join(_END_LIMIT_S)
        _end_all(self._started)


def _start(started: list[Companion | OSError], closed: threading.Event) -> None:
    """Start another console process; end it at once if the console was closed meanwhile."""
    # Of this thread alone, so that the new process does not begin with the priority of the side.
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 0)
    try:
        started.append(Companion(_MODULE))
    except OSError as error:
        started.append(error)
    if closed.is_set():
        _end_all(started)


def _end_all(started: list[Companion | OSError]) -> None:
    """Kill the processes that nobody has taken: the thread that starts one and `close` may both try."""
    with contextlib.suppress(IndexError):
        while True:
            if isinstance(one := started.pop(), Companion):
                one.close(0.0)
