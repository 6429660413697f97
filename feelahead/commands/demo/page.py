"""The console's page in the demo: how long an open page prolongs the run, and how it survives a restart."""

import secrets
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

FIRST_PAGE_S: Final = 60.0
"""Time for which a run waits for its first page, in seconds"""
AFTER_PAGES_S: Final = 5.0
"""Time for which a run continues after its last page was closed, in seconds: a reload closes the page for a moment"""
PERSON_WAITS_S: Final = 10.0
"""Maximum time for which the scripted person waits until a page shows its first picture, in seconds"""


class Lifetime:
    """Decides when a run ends: after a duration, or some time after its last page was closed."""

    def __init__(self, duration_s: float | None) -> None:
        """duration_s: duration once the link is up; None: the run lasts as long as a page is open."""
        self._duration_s = duration_s
        self._limit_s = FIRST_PAGE_S if duration_s is None else duration_s
        self._since_s: float | None = None
        self._seen = False

    @property
    def has_begun(self) -> bool:
        """Whether the link has come up, from which the time counts."""
        return self._since_s is not None

    def begin(self, now_s: float) -> None:
        """Note that the link is up at `now_s`."""
        self._since_s = now_s

    def why_over(self, pages: int, now_s: float) -> str | None:
        """Return in words why the run ends at `now_s`; None if it continues. pages: number of open pages."""
        if self._since_s is None:
            return None
        if self._duration_s is None and pages > 0:
            self._seen, self._since_s, self._limit_s = True, now_s, AFTER_PAGES_S
        if now_s - self._since_s < self._limit_s:
            return None
        if self._duration_s is not None:
            return f"the run ends after {self._limit_s:g} s"
        if self._seen:
            return "the page was closed: the run ends"
        return f"no page was opened for {self._limit_s:g} s: the run ends; --duration SECONDS makes it longer"


class KeptPage:
    """Address of the console that consecutive runs share, so that an open page connects again after a restart."""

    def __init__(self, folder: Path) -> None:
        """Write the secret token of the address to a file in `folder`."""
        self._token = folder / "console_token"
        self._token.touch(mode=0o600)
        self._token.write_text(secrets.token_urlsafe(24))
        self._address: str | None = None
        self.wants_again = False

    def flags(self, *, waits: bool) -> list[str]:
        """Return the operator side's flags. waits: the scripted person waits for the first picture."""
        port = None if self._address is None else urlsplit(self._address).port
        kept = [] if port is None else [f"--console-port={port}"]
        patience = [f"--person-waits={PERSON_WAITS_S:g}"] if waits else []
        return [f"--console-token={self._token}", *patience, *kept]

    def is_new(self, address: str) -> bool:
        """Store the console's address; return whether it differs from that of the last run."""
        before, self._address = self._address, address
        return before != address

    def take_again(self) -> bool:
        """Return whether a page has asked for another run since the last call."""
        wanted, self.wants_again = self.wants_again, False
        return wanted


@contextmanager
def kept_addresses(*names: str) -> Iterator[dict[str, str]]:
    """Yield for each of `names` an address of 127.0.0.1 that no program gets by asking for any free port.

    As they are known in advance, both sides start at once. Sockets that do not listen keep the ports.
    """
    with ExitStack() as stack:
        keepers = {name: stack.enter_context(socket.socket()) for name in names}
        for keeper in keepers.values():
            # ZeroMQ does the same: such sockets may share a port while at most one of them listens.
            keeper.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            keeper.bind(("127.0.0.1", 0))
        yield {name: f"tcp://127.0.0.1:{keeper.getsockname()[1]}" for name, keeper in keepers.items()}
