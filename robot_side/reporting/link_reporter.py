"""Reports of the link's figures, for the lease's owner and for the robot side's status."""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final

from common.protocol.codec import encode
from common.protocol.messages import LinkReport
from common.rate.budget import Budget
from common.sockets.tcp_figures import TcpFigures
from robot_side.operators.operator_session import OperatorSession
from robot_side.tick.outgoing import Outgoing, OutgoingStream

PERIOD_S: Final = 0.5
_NAMES: Final = {"video": "pictures"}


class LinkReporter:
    """Maker of a report every 0.5 s, while an operator owns the lease."""

    def __init__(
        self,
        session: OperatorSession,
        budget: Budget[OutgoingStream],
        pictures: Callable[[], Mapping[str, float | int] | None],
        tcp: Callable[[bytes], TcpFigures],
    ) -> None:
        """pictures: returns rate_hz, quality and size, or None without cameras. tcp: returns a peer's TCP figures."""
        self._session = session
        self._budget = budget
        self._pictures = pictures
        self._tcp = tcp
        self._peer = b""
        self._before = TcpFigures()
        self._held_back: Counter[tuple[str, str]] = Counter()
        self._next_s = 0.0
        self._report: LinkReport | None = None

    def status(self) -> dict[str, float | str | None]:
        """Return the values of the newest report, with the present values of the budget: rate and queueing delay."""
        return ({} if self._report is None else self._report.values()) | self._budget.status()

    def due(self, now_s: float) -> list[Outgoing]:
        """Return the report to send at `now_s`, if one is due."""
        peer = self._session.owner_peer
        if now_s < self._next_s or peer is None:
            return []
        self._next_s = now_s + PERIOD_S
        now = self._tcp(peer)
        lost = None if peer != self._peer else now.since(self._before).lost_share
        self._peer, self._before = peer, now
        figures = self._budget.status()
        self._report = LinkReport(
            # In a separate sequence: a replay has no link and must send all other messages identically.
            self._session.shown_header(now_s),
            rate_kbit_s=figures["rate_kbit_s"],
            queue_ms=figures["queue_ms"],
            lost=None if lost is None else min(lost, 1.0),
            pictures=self._words(),
            held_back=self._new(),
        )
        return [Outgoing("haptics", peer, encode(self._report))]

    def _words(self) -> str:
        pictures = self._pictures()
        if pictures is None:
            return "none"
        size = "" if pictures["size"] == 1 else f", size {pictures['size']:g}"
        return f"{pictures['rate_hz']:.0f} Hz, quality {pictures['quality']}{size}"

    def _new(self) -> str:
        counts = Counter(
            {
                (stream, why): count
                for stream, reasons in self._budget.held_back().items()
                for why, count in reasons.items()
            }
        )
        new, self._held_back = counts - self._held_back, counts
        return ", ".join(
            f"{_NAMES.get(stream, stream)} {count} ({why})" for (stream, why), count in sorted(new.items())
        )
