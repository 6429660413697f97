"""A real browser and what drives it: Debian's Chromium, and Playwright by a lock and in a place of its own."""

import hashlib
import os
import platform
import shutil
import sys
from pathlib import Path
from typing import Final

from tests.containers.debian import Say, install, run_or_skip
from tests.kernel.skipped import SkippedError

_LOCK: Final = Path(__file__).parents[1] / "requirements-console.lock"
_NAMES: Final = ("chromium", "chromium-browser", "google-chrome")


def default_cache() -> Path:
    """Where Playwright is kept from one run to the next."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "feelahead" / "console-test"


def provided_browser(say: Say) -> str:
    """Where a Chromium is; in CI, root gets Debian's. SkippedError where none can be had."""
    for name in _NAMES:
        if (found := shutil.which(name)) is not None:
            return found
    if os.environ.get("CI") != "true" or os.geteuid() != 0:
        raise SkippedError("no chromium (with CI=true, root gets Debian's)")
    install((_NAMES[0], "fonts-dejavu-core"), _NAMES[0], say)
    found = shutil.which(_NAMES[0])
    if found is None:
        raise SkippedError("Debian's chromium brought no program of that name")
    return found


def provide_playwright(cache: Path, say: Say) -> None:
    """Make `import playwright` work in this process; SkippedError where it cannot be installed."""
    pinned = hashlib.sha256(_LOCK.read_bytes()).hexdigest()[:12]
    place = cache / f"{platform.machine()}-{sys.version_info.major}.{sys.version_info.minor}-{pinned}"
    if not (place / "playwright").exists():
        say("installing playwright")
        shutil.rmtree(place, ignore_errors=True)
        whole = ("install", "--disable-pip-version-check", "--quiet", "--require-hashes", "--no-deps")
        unfinished = place.with_suffix(".new")
        shutil.rmtree(unfinished, ignore_errors=True)
        run_or_skip([sys.executable, "-m", "pip", *whole, "--target", str(unfinished), "-r", str(_LOCK)], {})
        unfinished.rename(place)
    sys.path.append(str(place))
