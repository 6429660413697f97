"""A study with people: two pages, the sides of one trial at a time, until Ctrl-C."""

import contextlib
import math
import secrets
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

import msgspec

from common.command.stop_signal import StopSignal
from common.errors import ConfigurationError, FeelaheadError
from feelahead.commands.study.server import PAGES, PageServer
from feelahead.commands.study.sides import Desk, TrialSides
from feelahead.study.folder import Study
from feelahead.study.room import Page, Room, Seen
from feelahead.study.session import Start, Stop
from feelahead.study.trials.sides import DEVICES

KEPT: Final = "pages.json"
"""File of a study that has port and tokens of its pages while it runs, so that they outlive a run that is killed"""
LOG: Final = "sides.log"
_PERIOD_S: Final = 0.03


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where the pages are."""

    port: int
    tokens: dict[Page, str]


def run_people(study: Study, participant: int | None) -> None:
    """Serve the pages of a study, and run its trials, until Ctrl-C.

    ConfigurationError if simulated persons take part in this study.
    """
    study.require_all(simulated=False)
    with (
        _server(study.folder / KEPT) as server,
        tempfile.TemporaryDirectory(prefix="feelahead-") as folder,
        ThreadPoolExecutor(1) as pool,
        StopSignal() as stop,
    ):
        desk = Desk(DEVICES[study.protocol.controller], Path(folder), study.folder / LOG)
        desk.token.write_text(secrets.token_urlsafe(24))
        desk.back.write_text(server.address("participant"))
        for path in (desk.token, desk.back):
            path.chmod(0o600)
        for page in PAGES:
            sys.stdout.write(f"page of the {page}: {server.address(page)}\n")
        sys.stdout.flush()
        with _Run(study, participant, server, desk, pool) as run:
            while not stop.is_set:
                run.turn(time.monotonic(), time.time())
                time.sleep(_PERIOD_S)


class _Run:
    """What happens between the pages, the room and the sides."""

    def __init__(
        self, study: Study, participant: int | None, server: PageServer, desk: Desk, pool: ThreadPoolExecutor
    ) -> None:
        self._server, self._desk, self._pool = server, desk, pool
        self._room = Room(study, participant)
        self._sides: TrialSides | None = None
        self._closing: Future[str | None] | None = None
        self._failed: Seen | None = None
        """What is seen of sides that could not be started"""
        self._port = 0

    def __enter__(self) -> "_Run":
        return self

    def __exit__(self, *_: object) -> None:
        if self._sides is not None:
            (self._closing or self._sides.close(self._pool)).result()

    def turn(self, now_s: float, at_s: float) -> None:
        """Take what came, and show what is."""
        for page, content, answer in self._server.heard():
            try:
                self._do(self._room.hear(page, content, now_s, at_s))
            except (ValueError, msgspec.MsgspecError, FeelaheadError) as error:
                answer(str(error))
            else:
                answer("")
        if self._closing is not None and self._closing.done():
            not_whole = self._closing.result()
            self._sides = self._closing = None
            self._room.closed(not_whole, now_s, at_s)
        elif self._closing is None and (seen := self._look(now_s)) is not None:
            self._do(self._room.take(seen, now_s))
        self._do(self._room.turn(now_s, at_s))
        for page, shown in self._room.view(math.floor(now_s)).items():
            open_pages = {one: self._server.is_open(one) for one in PAGES}
            self._server.show(page, shown | ({"open": open_pages} if page == "experimenter" else {}))

    def _look(self, now_s: float) -> Seen | None:
        if self._sides is None:
            return self._failed
        seen = self._sides.look(now_s)
        if seen.console is not None:
            self._port = urlsplit(seen.console).port or 0
        return seen

    def _do(self, asked: Start | Stop | None) -> None:
        if isinstance(asked, Start):
            try:
                self._sides = TrialSides(asked, self._desk, self._port)
            except (FeelaheadError, OSError) as error:
                self._failed = Seen(failed="the recorder could not be started")
                self._desk.note("the recorder could not be started", str(error))
        elif isinstance(asked, Stop):
            self._failed = None
            if self._sides is not None:
                self._closing = self._sides.close(self._pool)
            else:
                self._closing = Future()
                self._closing.set_result(None)


@contextmanager
def _server(kept: Path) -> Iterator[PageServer]:
    """Serve the pages where a run that was killed has served them, else at a new address."""
    before: Kept | None = None
    with contextlib.suppress(OSError, msgspec.MsgspecError):
        before = msgspec.json.decode(kept.read_bytes(), type=Kept)
    tokens: dict[Page, str] = {page: secrets.token_urlsafe(24) for page in PAGES} if before is None else before.tokens
    with ExitStack() as stack:
        try:
            server = PageServer(0 if before is None else before.port, tokens)
        except ConfigurationError:
            server = PageServer(0, tokens)
        stack.enter_context(server)
        with contextlib.suppress(OSError):  # a full disk: the pages' addresses are only convenience
            kept.touch(mode=0o600)
            kept.write_bytes(msgspec.json.encode(Kept(server.port, tokens)))
        yield server
        kept.unlink(missing_ok=True)
