"""Make the documents' pictures of real runs anew, into docs/: `python -m tests.console.pictures`."""

import argparse
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from common.errors import FeelaheadError
from tests.console.film_of_replay import make_film
from tests.console.pictures_of_page import make_first_minute
from tests.console.pictures_of_recording import make_pictures_of_recording
from tests.console.provide import default_cache, provide_playwright, provided_browser
from tests.containers.debian import Say
from tests.containers.watch import CheckFailedError
from tests.helpers.repository import ROOT
from tests.kernel.skipped import SkippedError

FIRST_MINUTE: Final = tuple(f"console/first-minute-{step}.png" for step in range(1, 6))
TERMINAL: Final = "console/terminal.svg"
PLOT: Final = "recording/run.png"
FILM: Final = "console/demo.webp"
FILES: Final = (*FIRST_MINUTE, TERMINAL, PLOT, FILM)
"""Within docs/, and nothing else is in these folders."""
_TRIES: Final = 3
_PARTS: Final = ("first-minute", "recording", "film")


def main() -> int:
    """0 when all were made, or where no browser can be had, which the last line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.console.pictures", description=__doc__)
    parser.add_argument("--cache", type=Path, default=default_cache(), help="where Playwright is kept (%(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "docs", help="the pictures' folder (%(default)s)")
    parser.add_argument("only", nargs="*", choices=(*_PARTS, []), metavar="PART", help=f"of {', '.join(_PARTS)}")
    given = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    started_s = time.monotonic()

    def say(line: str) -> None:
        print(f"{time.monotonic() - started_s:5.0f} s  {line}", flush=True)

    try:
        for part in given.only or _PARTS:
            _make(part, given.out, given.cache.absolute(), say)
    except SkippedError as reason:
        print(f"skipped: {reason}")
    except (CheckFailedError, FeelaheadError) as error:
        print(f"failed: {error}")
        return 1
    return 0


def _make(part: str, docs: Path, cache: Path, say: Say) -> None:
    """One part of FILES."""
    with tempfile.TemporaryDirectory(prefix="feelahead-") as name:
        folder = Path(name)
        if part == "recording":
            _place(docs, (TERMINAL, PLOT), lambda to: make_pictures_of_recording(folder, to, say), say)
            return
        program = provided_browser(say)
        provide_playwright(cache, say)
        if part == "film":
            _place(docs, (FILM,), lambda to: make_film(program, folder, to, say), say)
        else:
            _place(docs, FIRST_MINUTE, lambda to: make_first_minute(program, folder, to, say), say)


def _place(docs: Path, names: tuple[str, ...], make: Callable[[list[Path]], None], say: Say) -> None:
    """A run that a busy machine spoils is repeated."""
    paths = [docs / name for name in names]
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
    for left in reversed(range(_TRIES)):
        try:
            make(paths)
            break
        except (CheckFailedError, FeelaheadError) as error:
            if not left:
                raise
            say(f"once more: {error}")
    for path in paths:
        say(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    sys.exit(main())
