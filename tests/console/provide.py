"""Browser and its driver: Debian's Chromium, and Playwright of a locked version, installed in a separate folder."""

import hashlib
import platform
import shutil
import sys
from pathlib import Path
from typing import Final

import pytest

from tests.helpers.machines.debian import cache_folder, install, run_or_skip

_LOCK: Final = Path(__file__).parents[1] / "requirements-console.lock"
_NAMES: Final = ("chromium", "chromium-browser", "google-chrome")


def provided_browser() -> str:
    """Find Chromium, or install Debian's if in CI as root; skip the test if neither is possible."""
    found = next(filter(None, map(shutil.which, _NAMES)), None)
    if found is None:
        install((_NAMES[0], "fonts-dejavu-core"), _NAMES[0])
        found = shutil.which(_NAMES[0])
    return found or pytest.skip(f"Debian's {_NAMES[0]} brought no program of that name")


def provide_playwright() -> None:
    """Make `import playwright` work in this process; skip the test if it cannot be installed."""
    pinned = hashlib.sha256(_LOCK.read_bytes()).hexdigest()[:12]
    place = cache_folder("console") / f"{platform.machine()}-{sys.version_info.major}.{sys.version_info.minor}-{pinned}"
    if not (place / "playwright").exists():
        whole = ("install", "--disable-pip-version-check", "--quiet", "--require-hashes", "--no-deps")
        unfinished = place.with_suffix(".new")
        for folder in (place, unfinished):
            shutil.rmtree(folder, ignore_errors=True)
        run_or_skip([sys.executable, "-m", "pip", *whole, "--target", str(unfinished), "-r", str(_LOCK)])
        unfinished.rename(place)
    sys.path.append(str(place))
