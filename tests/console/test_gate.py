"""The console refuses pages of other web sites, even if they know its token."""

import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.console.browser import Browser
from tests.console.run import DRAWN, Run

pytestmark = [pytest.mark.console, pytest.mark.processes]


_PAGE = b"<!doctype html><title>another site</title><p>another site</p>"


def test_another_site_is_refused(browser: Browser, demo: Run) -> None:
    """Such a page knows the whole address, but gets no content, no WebSocket and no frame of the console."""
    with _another_site() as elsewhere, browser.page(elsewhere) as page:
        script = """async (address) => {
            const live = address.replace('http', 'ws') + 'live';
            const opened = await new Promise((resolve) => {
                const socket = new WebSocket(live);
                socket.onopen = () => resolve(true);
                socket.onclose = socket.onerror = () => resolve(false);
            });
            const read = await fetch(address).then(() => true, () => false);
            const image = await fetch(address, { mode: 'no-cors' }).then((answer) => answer.type, () => 'refused');
            return { opened, read, image };
        }"""
        seen = page.ask(script, demo.address)
        page.complaints.clear()  # The refusals themselves.
        assert not seen["opened"], "its WebSocket was let in"
        assert not seen["read"], "it could read the page"
    with browser.page(demo.address) as page:
        page.wait(DRAWN, "drawn for a person who may see it")


@contextmanager
def _another_site() -> Iterator[str]:
    class Answers(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(_PAGE)

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002  # as the base class has it
            """Log nothing."""

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Answers)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
