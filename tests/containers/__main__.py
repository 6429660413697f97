"""Build the images and try the containers: `python -m tests.containers`."""

import argparse
import signal
import sys
import time
from pathlib import Path
from types import FrameType

from common.errors import FeelaheadError
from feelahead.containers.engine import Engine, EngineError
from tests.containers.checks import CHECKS
from tests.containers.debian import Say
from tests.containers.provide import base_image, default_cache, provided_engine
from tests.containers.watch import CheckFailedError
from tests.kernel.skipped import SkippedError

_BUILD_LIMIT_S = 1500.0
_OPTIONS = dict.fromkeys(("ROBOT_OPTIONS", "OPERATOR_OPTIONS"), "--status json")


def main() -> int:
    """0 when everything held or the test was skipped, which the last line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.containers", description=__doc__)
    parser.add_argument("--cache", type=Path, default=default_cache(), help="where images are kept (%(default)s)")
    parser.add_argument("--link", default="delay 20ms 2ms distribution normal rate 100mbit", metavar="NAME|SPEC")
    parser.add_argument("only", nargs="*", help="words: run only the checks whose names contain one of them")
    given = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _leave)
    started_s = time.monotonic()

    def say(line: str) -> None:
        print(f"{time.monotonic() - started_s:5.0f} s  {line}", flush=True)

    failed = 0
    try:
        with provided_engine(given.cache.absolute(), say) as engine:
            settings = {"LINK": given.link, **_OPTIONS, **base_image(engine, say), "FEELAHEAD_IMAGES": engine.project}
            failed = _try_everything(engine, settings, given.only, say)
    except SkippedError as reason:
        print(f"skipped: {reason}")
        return 0
    except FeelaheadError as error:
        print(f"failed: {error}")
        return 1
    print(f"{'failed' if failed else 'passed'} in {time.monotonic() - started_s:.0f} s")
    return 1 if failed else 0


def _try_everything(engine: Engine, settings: dict[str, str], only: list[str], say: Say) -> int:
    """How many checks failed; what the project has is removed on every way out."""
    failed = 0
    began_s = time.monotonic()
    if _remove(engine, say):
        return 1
    try:
        engine.compose("build", settings=settings, limit_s=_BUILD_LIMIT_S)
    except EngineError as error:
        say(f"the images cannot be built: {error}")
        return 1
    say(f"images built in {time.monotonic() - began_s:.0f} s")
    try:
        for tried in CHECKS:
            if only and tried is not CHECKS[0] and not any(word in tried.__name__ for word in only):
                continue
            try:
                say(f"{tried.__name__}: {tried(engine, settings)}")
            except (CheckFailedError, FeelaheadError) as error:
                failed += 1
                say(f"{tried.__name__}: FAILED: {error}")
    finally:
        failed += _remove(engine, say)
    return failed


def _remove(engine: Engine, say: Say) -> int:
    """1 where it fails, and a line that says why."""
    try:
        engine.remove()
    except EngineError as error:
        say(f"FAILED: what {engine.project} has cannot be removed: {error}")
        return 1
    return 0


def _leave(number: int, frame: FrameType | None) -> None:
    """By way of everything that has to be put in order."""
    del frame
    sys.exit(128 + number)


if __name__ == "__main__":
    sys.exit(main())
