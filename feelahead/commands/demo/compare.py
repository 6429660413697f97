"""`feelahead demo --compare`: one seed without and with haptics, in virtual time, then side by side on a page."""

import errno
import secrets
import sys
from collections.abc import Collection, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Final

import msgspec
from rich.console import Console
from rich.table import Table

from common.command.status import Status
from common.command.stop_signal import StopSignal
from common.errors import ConfigurationError
from common.extras import installing
from common.files.output_file import write_json
from feelahead.commands.demo.settings import DemoSettings
from feelahead.commands.open_browser import show_address
from feelahead.printing.figures import shown
from feelahead.printing.progress import progress

_TAKEN: Final = {
    *("compare", "config", "console", "console_port", "duration", "enlargement", "law", "law_paper_share", "link"),
    *("link_model", "probability", "scene", "seed", "summary", "tick_period"),
}
"""Settings that a comparison takes"""
_LONGEST_S: Final = 45.0
"""Limit of a run without --duration, in seconds of virtual time"""
_PAGE: Final = Path(__file__).with_name("compare.html")
_DATA: Final = "/*DATA*/null"
_ARMS: Final = {"off": "without haptics", "reacting": "with haptics"}


def compare(settings: DemoSettings, given: Collection[str]) -> int:
    """Compute both runs, print a table of them, and serve the page until Ctrl-C if there is a terminal.

    given: fields that a person set; ConfigurationError for one without a meaning here.
    """
    refuse_others(given)
    try:
        runs = compute(settings)
    except KeyboardInterrupt:
        sys.stderr.write("feelahead demo --compare: interrupted\n")
        return 130
    person = "a simulated person who misjudges depth, in virtual time"
    sys.stdout.write(f"feelahead demo --compare: {_what(settings)}; {person}\n")
    Console().print(_table(runs))
    many = f"feelahead try haptics --scenes {settings.scene or 'wall'}"
    sys.stdout.write(f"one seed shows, and does not prove; over many seeds: {many}\n")
    if settings.summary is not None:
        figures = {name: run["figures"] for name, run in zip(("off", "on"), runs, strict=True)}
        asked = {"scene": settings.scene or "wall", "seed": settings.seed, "link": settings.link}
        write_json("--summary", settings.summary, {**asked, **figures})
    if settings.console and sys.stdout.isatty():
        _serve(page_of(settings, runs).encode(), settings.console_port)
    return 0


def refuse_others(given: Collection[str]) -> None:
    """Raise ConfigurationError if a field among `given` means nothing for a comparison."""
    for name in sorted(set(given) - _TAKEN):
        valid = ", ".join(f"--{field.replace('_', '-')}" for field in sorted(_TAKEN))
        raise ConfigurationError(f"--{name.replace('_', '-')} with --compare; valid: {valid}")


def compute(settings: DemoSettings, *, pictures: bool | None = None) -> list[dict[str, Any]]:
    """Return both runs, first the one without haptics, and show the progress.

    pictures: whether to draw; by default if the page is shown.
    """
    try:
        # The robot side may be missing, and takes long to import.
        from feelahead.both_sides.grasping_trial import MISJUDGES_DEPTH, Trial  # noqa: PLC0415
        from feelahead.commands.demo.compared_run import compared_run  # noqa: PLC0415
    except ModuleNotFoundError as error:
        why = f"--compare: {error.name} is not installed; to install it: {installing('robot,operator')}"
        raise ConfigurationError(why) from error
    drawn = settings.console and sys.stdout.isatty() if pictures is None else pictures
    limit_s = settings.duration or _LONGEST_S
    runs = []
    with progress("feelahead demo --compare", 2.0 * limit_s) as shown:
        for arm, name in _ARMS.items():
            shown.begin(name)
            trial = Trial(
                settings.scene or "wall",
                settings.link,
                arm,  # type: ignore[arg-type]
                MISJUDGES_DEPTH,
                limit_s,
                settings.link_model,
                tick_period=settings.tick_period,
                probability=settings.probability,
                law=settings.law,
                paper=settings.paper,
            )
            runs.append({"name": name, **compared_run(trial, settings.seed, shown.advance, pictures=drawn)})
            shown.advance(limit_s - runs[-1]["took_s"])
    return runs


def page_of(settings: DemoSettings, runs: list[dict[str, Any]]) -> str:
    """Return the page, complete in itself."""
    data = {"what": _what(settings), "runs": runs}
    # No text of a person can end the script element.
    encoded = msgspec.json.encode(data).decode().replace("<", "\\u003c")
    return _PAGE.read_text(encoding="utf-8").replace(_DATA, encoded)


def _what(settings: DemoSettings) -> str:
    link = f"--link {settings.link!r}" if settings.link else "no delay"
    return f"--scene {settings.scene or 'wall'} --seed {settings.seed}, {link}"


def _table(runs: list[dict[str, Any]]) -> Table:
    headings = "haptics", "contact", "mm/s, most", "least gap, mm", "placed", "finished, s"
    rows = zip(("off", "on"), runs, strict=True)
    return shown("", headings, ((name, *_cells(run["figures"])) for name, run in rows))


def _cells(figures: Mapping[str, Any]) -> list[str | float | None]:
    touched, gap_mm = figures["hit_first"], figures["least_gap_mm"]
    return [
        f"{touched}, {figures['hits']} times" if figures["hits"] > 1 else touched or "none",
        figures["fastest_hit_mm_s"],
        # The truth is sampled: a contact may fall between two samples.
        0.0 if touched else gap_mm,
        "yes" if figures["placed"] else "no",
        figures["finished_s"],
    ]


def _serve(page: bytes, port: int) -> None:
    """Serve the page on this machine until a stop signal, at an address that other users cannot guess."""
    place = f"/{secrets.token_urlsafe(24)}/"

    class Handler(BaseHTTPRequestHandler):
        """Answers with the page."""

        timeout = 5.0

        def do_GET(self) -> None:
            """Send the page, or 404 for another path."""
            if not secrets.compare_digest(self.path.encode(), place.encode()):
                self.send_error(404)
                return
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(page)))
            self.end_headers()
            self.wfile.write(page)

        def log_message(self, format: str, *values: object) -> None:  # noqa: A002  # the base class's name
            """Say nothing."""

    try:
        server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
    except OSError as error:
        if error.errno not in (errno.EADDRINUSE, errno.EACCES):
            raise
        raise ConfigurationError(f"--console-port {port}: {error.strerror}; valid: a free port, or 0") from error
    with server, StopSignal() as stop, Status("line", "feelahead demo") as status:
        server.timeout = 0.2
        show_address(f"http://127.0.0.1:{server.server_port}{place}", status)
        status.note("it plays both runs at real speed; Ctrl-C ends it")
        while not stop.is_set:
            server.handle_request()
