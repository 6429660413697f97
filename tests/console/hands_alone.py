"""Driving controls of the console's page by themselves, in virtual time.

Keys are pressed in a real browser. The operator side's code turns what the page sends into an intent. No run exists.
"""

import functools
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final

import msgspec

from common.protocol.messages import Telemetry
from operator_side.hands.intent import OperatorIntent, operator_intent
from operator_side.hands.travel_calibration import IDENTITY
from operator_side.viewing.console.names import names
from operator_side.viewing.pages.browser_hands import BrowserHands
from operator_side.viewing.pages.driving_page import DrivingPage
from tests.console.browser import Browser, Page
from tests.helpers.repository import ROOT
from tests.helpers.simulated_desk import VIEW

_PLACE: Final = ROOT / "operator_side" / "viewing" / "console" / "page"
_FRAME_MS: Final = 20
_PAGE: Final = b"""<!doctype html><meta charset="utf-8"><title>hands</title><link rel="icon" href="data:,">
<section id="stopping"></section><section id="driving"></section>
<section id="hands"></section><section id="tuning"></section>
<p><input id="field" aria-label="a field"><button id="other" type="button">other</button></p>
<iframe id="scene" srcdoc="<p tabindex=0>scene</p>"></iframe>
<script type="module">
  import { Hands } from "./hands.js";
  window.sent = [];
  window.clicked = 0;
  document.getElementById("other").onclick = () => { window.clicked += 1; };
  let number = 0; // as wire.js numbers inputs
  window.hands = new Hands(document, (message) => {
    if (message.hands) message.hands.number = number++;
    window.sent.push([performance.now(), JSON.stringify(message)]);
  });
</script>"""
_MADE: Final = {"/": ("html", _PAGE), "/names.js": ("javascript", names().encode())}
_SILENT_STATUS: Final = {"state": "disarmed", "link": "up", "owner": "ready"}


class _Handler(SimpleHTTPRequestHandler):
    def do_GET(self) -> None:
        if self.path not in _MADE:
            super().do_GET()
            return
        kind, content = _MADE[self.path]
        self.send_response(200)
        self.send_header("Content-Type", f"text/{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *arguments: object) -> None:
        """Log nothing."""


@contextmanager
def served() -> Iterator[str]:
    """Serve a page that has only the console's driving and tuning controls; yield its address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(_Handler, directory=str(_PLACE)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@dataclass
class HandsAlone:
    """The page, and a stand-in for its operator side and for a robot that arms on request.

    Time passes only in `let_pass`.
    """

    page: Page
    person: bool = False
    pages: DrivingPage = field(default_factory=DrivingPage)
    facts: dict[str, Any] = field(default_factory=dict)
    """Changes to the facts that the page gets; by default this operator has the lease, and tuning is permitted"""
    now_ms: float = 0.0
    state: str = "disarmed"
    hears: bool = True
    """Whether messages of the page arrive, and the page gets facts; False: a silent link to the page"""
    messages: list[dict[str, Any]] = field(default_factory=list)
    intent: OperatorIntent | None = None

    def __post_init__(self) -> None:
        self.shared = BrowserHands(self.pages, lambda _: None)
        self.let_pass(0.1)

    def let_pass(self, for_s: float) -> None:
        for _ in range(round(1000 * for_s / _FRAME_MS)):
            self.now_ms += _FRAME_MS
            self.page.raw.clock.run_for(_FRAME_MS)
            self._frame()

    def _frame(self) -> None:
        now_s = self.now_ms / 1000
        said = self.page.ask("() => window.sent.splice(0)")
        for _, text in said if self.hears else ():
            message = msgspec.json.decode(text)
            self.messages.append(message)
            self.pages.receive(1, message, now_s)
        if self.pages.rejected:
            raise AssertionError(f"the page sent an invalid message: {self.messages[-1]}")
        if self.pages.stopping(now_s):
            self.state = "stopped"
        screen: Telemetry = msgspec.structs.replace(VIEW, state=self.state)
        self.shared.tick(now_s, screen, 0.0)
        state = self.shared.read(now_s)
        assert state is not None
        self.intent = operator_intent(state, IDENTITY)
        if self.intent.arm:
            self.state = "armed"
        if self.hears:
            self.page.ask("(facts) => window.hands.show(facts)", self._facts(now_s))

    def _facts(self, now_s: float) -> dict[str, Any]:
        self.pages.driven(now_s)  # First, as it checks whether the page is still there.
        nothing_asked = {"asked": "", "mean_ms": None, "p99_ms": None, "newest_ms": None}
        return {
            "status": _SILENT_STATUS | {"state": self.state, "person": self.shared.doing},
            "hands": "person" if self.person and not self.pages.driver else "browser",
            "advancing": "R2",
            "may_tune": True,
            "probability": 0.99,
            "to_robot": nothing_asked,
            "to_operator": nothing_asked,
            "page": {
                "may_drive": self.pages.may_drive,
                "driver": self.pages.driver,
                "person": self.person,
                "tuning_refused": "",
                "link_asked": None,
                "counts": self.pages.counts,
                "reset_first": self.pages.reset_first,
                "released": self.pages.released,
            },
        } | self.facts

    def drive(self) -> None:
        """Press the button by which this page takes over; return when the page is ready to drive."""
        self.page.raw.click("#drive")
        self.let_pass(1.3)
        self.expect("Ready")

    def run(self) -> None:
        """Take over, then hold Space, which is hold-to-run, until this page drives."""
        self.drive()
        self.page.raw.keyboard.down("Space")
        self.let_pass(0.2)
        self.expect("You drive")

    def expect(self, words: str) -> None:
        if words not in (said := self.page.text("#hands_state")):
            raise AssertionError(f"the page says {said!r}, not {words!r}; {self.pages.doing}, {self.state}")

    @property
    def pulled(self) -> tuple[float, float]:
        return (0.0, 0.0) if self.intent is None else (self.intent.l2, self.intent.r2)

    @property
    def runs(self) -> bool:
        return self.intent is not None and self.intent.run


@contextmanager
def hands_alone(browser: Browser, *, person: bool = False, may_drive: bool = True) -> Iterator[HandsAlone]:
    """Yield the page in a new browser context, with a clock that only `let_pass` advances."""
    with served() as address, browser.page("about:blank", gamepad=True) as page:
        page.raw.clock.install(time=0)
        page.raw.goto(address)
        page.wait("window.hands !== undefined", "loaded")
        page.raw.clock.pause_at(1000)
        yield HandsAlone(page, person, DrivingPage(may_drive=may_drive))
