"""Open the console in Chromium and click through it: `python -m tests.console`."""

import argparse
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import Final

from common.errors import FeelaheadError
from tests.console.browser import Browser, browser
from tests.console.checks_of_gate import another_site_is_refused, wrong_addresses_are_refused
from tests.console.checks_of_hands import (
    escape_stops,
    gamepad_drives,
    hidden_or_left_page_lets_go,
    space_drives,
)
from tests.console.checks_of_keys import CHECKS as CHECKS_OF_KEYS
from tests.console.checks_of_layout import keyboard_reaches_everything, nothing_overflows
from tests.console.checks_of_link import frozen_robot_is_unmistakable, silent_operator_side_is_unmistakable
from tests.console.checks_of_views import both_views_move, scene_is_drawn, triggers_agree, words_agree
from tests.console.provide import default_cache, provide_playwright, provided_browser
from tests.console.run import running
from tests.console.stage import Check, Stage
from tests.containers.debian import Say
from tests.containers.watch import CheckFailedError
from tests.kernel.skipped import SkippedError

_LINK: Final = ("--link", "delay 20ms 2ms distribution normal")
_RUNS: Final[Sequence[tuple[Sequence[str], Sequence[Check]]]] = (
    (_LINK, (both_views_move,)),
    (_LINK, (scene_is_drawn,)),
    (_LINK, (triggers_agree, words_agree)),
    (_LINK, (nothing_overflows, keyboard_reaches_everything, wrong_addresses_are_refused, another_site_is_refused)),
    (_LINK, (frozen_robot_is_unmistakable, silent_operator_side_is_unmistakable)),
    ((), (escape_stops,)),
    ((), (space_drives, hidden_or_left_page_lets_go, gamepad_drives)),
)
"""The demo's arguments, and what is tried on it: its person needs half a minute for the task, and then rests."""


def main() -> int:
    """0 when everything held or the test was skipped, which the last line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.console", description=__doc__)
    parser.add_argument("--cache", type=Path, default=default_cache(), help="where Playwright is kept (%(default)s)")
    parser.add_argument("--out", type=Path, default=Path("console-pictures"), help="pictures go there (%(default)s)")
    parser.add_argument("only", nargs="*", help="words: run only the checks whose names contain one of them")
    given = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _leave)
    started_s = time.monotonic()

    def say(line: str) -> None:
        print(f"{time.monotonic() - started_s:5.0f} s  {line}", flush=True)

    failed = 0
    try:
        program = provided_browser(say)
        provide_playwright(given.cache.absolute(), say)
        alone = [tried for tried in CHECKS_OF_KEYS if _is_wanted(tried.__name__, given.only)]
        if alone:
            failed += _try_alone(program, given.out.absolute(), alone, say)
        for arguments, checks in _RUNS:
            wanted = [tried for tried in checks if _is_wanted(tried.__name__, given.only)]
            if wanted:
                failed += _try(program, given.out.absolute(), arguments, wanted, say)
    except SkippedError as reason:
        print(f"skipped: {reason}")
        return 0
    print(f"{'failed' if failed else 'passed'} in {time.monotonic() - started_s:.0f} s")
    return 1 if failed else 0


def _is_wanted(name: str, only: Sequence[str]) -> bool:
    return not only or any(word in name for word in only)


def _try_alone(program: str, out: Path, checks: Sequence[Callable[[Browser], str]], say: Say) -> int:
    """How many of `checks`, which need a browser and no run, failed."""
    failed = 0
    with browser(program, out) as opened:
        for tried in checks:
            try:
                say(f"{tried.__name__}: {tried(opened)}")
            except CheckFailedError as error:
                failed += 1
                say(f"{tried.__name__}: FAILED: {error}")
    return failed


def _try(program: str, out: Path, arguments: Sequence[str], checks: Sequence[Check], say: Say) -> int:
    """How many of `checks` failed on one run."""
    failed = 0
    try:
        with browser(program, out) as opened, running(arguments) as run:
            say(f"a demo {' '.join(arguments)}")
            for tried in checks:
                try:
                    say(f"{tried.__name__}: {tried(Stage(run, opened))}")
                except CheckFailedError as error:
                    failed += 1
                    say(f"{tried.__name__}: FAILED: {error}")
    except (CheckFailedError, FeelaheadError) as error:
        failed += 1
        say(f"FAILED: {error}")
    return failed


def _leave(number: int, frame: FrameType | None) -> None:
    """By way of everything that has to be put in order."""
    del frame
    sys.exit(128 + number)


if __name__ == "__main__":
    sys.exit(main())
