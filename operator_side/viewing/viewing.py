"""Feed the console and the terminal view, and ask the robot side for the pictures and the scene that they show."""

import contextlib
import math
from collections.abc import Callable
from typing import Final

from common.command.status import Status
from common.errors import RemoteProtocolError
from common.protocol.codec import VIEW_MAXIMUM_BYTES, claims_to_be, decode_view, encode
from common.protocol.messages import Watch
from common.protocol.view_messages import SCENE_TOPIC, VIDEO_TOPIC, SceneState
from common.rate.pieces import PIECE, Joining
from common.recording.entries import Kind
from common.recording.side import SideRecording
from common.status.statuses import OperatorStatus
from operator_side.core import OperatorSide
from operator_side.settings import OperatorSettings
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts import FACTS_PERIOD_S, SceneFacts
from operator_side.viewing.facts_of_core import Surroundings, operator_facts
from operator_side.viewing.pages.driving_page import DrivingPage

_WATCH_PERIOD_S: Final = 0.25
_EXPECT_PERIOD_S: Final = 10.0
"""Seconds between Watch messages while no page is visible"""
_TELEMETRY_TOPIC: Final = b"telemetry"


def view_topics(settings: OperatorSettings) -> tuple[bytes, ...]:
    """Return the topics to subscribe to.

    Telemetry always; the scene with the console, `--tui` or `--status facts`; pictures only with the console.
    """
    scene = (SCENE_TOPIC,) if settings.console or settings.tells_facts else ()
    return (_TELEMETRY_TOPIC, *scene, *((VIDEO_TOPIC,) if settings.console else ()))


class SceneFigures:
    """Newest overlap and tick times from the robot side's scene messages."""

    def __init__(self) -> None:
        self.newest: SceneFacts | None = None
        """Newest figures; None before the first"""

    def receive(self, payload: bytes) -> None:
        """Take a payload of the topic `scene`. Shapes, which are large, and invalid payloads are ignored."""
        with contextlib.suppress(RemoteProtocolError):
            if claims_to_be("scene", payload) and isinstance(state := decode_view(payload), SceneState):
                by_trigger = zip(*((l2, r2) for _, l2, r2 in state.overlaps), strict=True)
                overlap_mm3 = 1e9 * max(map(sum, by_trigger), default=0.0)
                self.newest = SceneFacts(overlap_mm3, state.tick_p50_us, state.tick_p99_us, state.overruns)


class Viewing:
    """Feed of the console, the terminal view and the recording; views are requested only while somebody watches."""

    def __init__(
        self,
        core: OperatorSide,
        surroundings: Callable[[float], Surroundings],
        status: Status,
        pages: DrivingPage,
        console: Console | None,
        recording: SideRecording | None = None,
    ) -> None:
        """surroundings: called with a time for its Surroundings. pages: gets the messages of the console's pages."""
        self.console = console
        self._pages = pages
        self._recording = recording
        self._core = core
        self._surroundings = surroundings
        self._status = status
        self._figures = SceneFigures()
        self._joining = {topic: Joining(VIEW_MAXIMUM_BYTES) for topic in (VIDEO_TOPIC, SCENE_TOPIC)}
        self._reported: str | None = None
        self._asked = False
        """Whether the newest Watch message reported lacking H.264 pictures, so that whole ones come"""
        self._watch_s = self._facts_s = -math.inf
        self.has_shown_picture = False
        """Whether a picture has been sent to a page"""
        self._open_pages = 0

    def note(self, text: str) -> None:
        """Show a line that stays, in the status and on the console."""
        self._status.note(text)
        if self.console is not None:
            self.console.note(text)

    def receive(self, topic: bytes, payload: bytes, now_s: float) -> bool:
        """Take a payload, and show it once its pieces are joined; return False if its topic is not a view's."""
        of, is_piece, _ = topic.partition(PIECE)
        if of not in self._joining:
            return False
        if is_piece:
            whole = self._joining[of].add(payload)
            return whole is None or self.receive(of, whole, now_s)
        if topic == SCENE_TOPIC and self._status.wants_facts:
            self._figures.receive(payload)
        if topic == VIDEO_TOPIC:
            self._pages.pictures.receive(payload, now_s)
        if self.console is not None:
            self.console.view(payload, video=topic == VIDEO_TOPIC)
            self.has_shown_picture |= topic == VIDEO_TOPIC and self.console.pages > 0
        return True

    def requests(self, now_s: float) -> list[bytes]:
        """Return the Watch message if one is due now; rarely one is due while nobody watches."""
        if self.console is not None:
            self._hear(self.console, now_s)
        pages = self.console is not None and self.console.pages > 0
        lacks = None if self.console is None else self.console.lacks
        stands_still = lacks is not None and any(lacks) and not self._asked
        watches = pages or self._status.wants_facts
        if not watches and (self.console is None or self.console.address is None):
            return []
        # While nobody watches, a Watch only lets the robot side keep its drawing process ready.
        if now_s - self._watch_s < (_WATCH_PERIOD_S if watches else _EXPECT_PERIOD_S) and not (pages and stands_still):
            return []
        self._watch_s, self._asked = now_s, lacks is not None and any(lacks)
        pace = self._pages.pace.now
        watch = Watch(
            *(self._core.link.stamp(now_s), pages, pages, watches, lacks),
            picture_hz=pace.picture_hz,
            halved=pace.halved,
            scene_hz=pace.scene_hz,
        )
        if self._recording is not None:
            self._recording.noted.append((Kind.WATCHED, now_s, b""))
        return [encode(watch)]

    def _hear(self, console: Console, now_s: float) -> None:
        console.receive(now_s)
        self._pages.pace.update(console.late, now_s)
        while console.words:
            page, said = console.words.popleft()
            if said is None:
                self._pages.close(page, now_s)
            elif said.pop("again", False):
                self._status.event("again")
            else:
                self._pages.receive(page, said, now_s)

    def facts_due(self, now_s: float) -> bool:
        """Return whether `show` is due. Also show the console's notes and its new address."""
        shown = self.console is not None and self._looks_at_console(self.console)
        return (shown or self._recording is not None) and now_s - self._facts_s >= FACTS_PERIOD_S

    def _looks_at_console(self, console: Console) -> bool:
        for text in console.take_notes():
            self._status.note(text)
        # Pages of a console that is started again come back by themselves.
        if console.pages != self._open_pages and (console.address is not None or console.gone):
            self._open_pages = console.pages
            self._status.event("pages", count=console.pages)
        if console.address not in (None, self._reported):
            self._reported = console.address
            if not self._status.event("console", address=self._reported):
                self._status.note(f"console: {self._reported}")
        return console.pages > 0

    def show(self, status: OperatorStatus, now_s: float) -> None:
        """Show the facts at `now_s` on the console, and record them. status: as of `operator_facts`."""
        self._facts_s = now_s if now_s - self._facts_s > 2 * FACTS_PERIOD_S else self._facts_s + FACTS_PERIOD_S
        facts = operator_facts(self._core, status, self._surroundings(now_s), now_s)
        if self.console is not None:
            self.console.facts(facts)
        if self._recording is not None:
            self._recording.facts(now_s, facts)

    def tell(self, status: OperatorStatus, now_s: float) -> None:
        """Show the status at `now_s`, with the facts for `--tui` or `--status facts`."""
        self._status.show(now_s, operator=status)
        if self._status.wants_facts:
            around, scene = self._surroundings(now_s), self._figures.newest
            self._status.show_facts(operator_facts(self._core, status, around, now_s, scene))
