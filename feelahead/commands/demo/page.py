"""The demo's page: how long it keeps the run alive, and how it outlives a restart of both sides."""

import secrets
import socket
from contextlib import ExitStack
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

FIRST_PAGE_S: Final = 60.0
"""Time for which a run waits for its first page, in seconds"""
AFTER_PAGES_S: Final = 5.0
"""Time for which a run goes on after its last page was closed, in seconds: a reload closes it for a moment"""
PERSON_WAITS_S: Final = 10.0
"""Longest time that the scripted person waits for the first picture on a page, in seconds"""


class Lifetime:
    """End of a run: by its duration, or by its pages; `now_s` is the present time."""

    def __init__(self, duration_s: float | None) -> None:
        """duration_s: None if the pages decide."""
        self._duration_s = duration_s
        self._limit_s = FIRST_PAGE_S if duration_s is None else duration_s
        self._since_s: float | None = None
        self._seen = False

    @property
    def has_begun(self) -> bool:
        """Whether the link has been up."""
        return self._since_s is not None

    def begin(self, now_s: float) -> None:
        """Note that the link is up."""
        self._since_s = now_s

    def why_over(self, pages: int, now_s: float) -> str | None:
        """Return why the run ends now, as a sentence for people; None to go on. pages: number of open ones."""
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
    """Console address that both runs share when a page wishes to run again."""

    def __init__(self, folder: Path) -> None:
        """Write the token of the address to a file in `folder`."""
        self._token = folder / "console_token"
        self._token.touch(mode=0o600)
        self._token.write_text(secrets.token_urlsafe(24))
        self._address: str | None = None
        self.wants_again = False

    def flags(self) -> list[str]:
        """Return the operator side's flags."""
        port = None if self._address is None else urlsplit(self._address).port
        kept = [] if port is None else [f"--console-port={port}"]
        return [f"--console-token={self._token}", f"--person-waits={PERSON_WAITS_S:g}", *kept]

    def is_new(self, address: str) -> bool:
        """Keep the address; return whether it is another one than before."""
        before, self._address = self._address, address
        return before != address

    def take_again(self) -> bool:
        """Return whether a page wished to run again since the last call."""
        wanted, self.wants_again = self.wants_again, False
        return wanted


def free_ports(count: int) -> list[int]:
    """Return ports of 127.0.0.1 that are free now; both sides can then start at once."""
    with ExitStack() as stack:
        probes = [stack.enter_context(socket.socket()) for _ in range(count)]
        for probe in probes:
            probe.bind(("127.0.0.1", 0))
        return [int(probe.getsockname()[1]) for probe in probes]
