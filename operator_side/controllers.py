"""Table of the controllers that --device selects, and how each is opened. A new controller needs a line here.

Others come from packages and files (`common.files.plugged`): a function without arguments that opens one, or raises
DeviceError, whose text says what to do; it is called again until it succeeds.
"""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from common.errors import ConfigurationError, DeviceError
from common.files.plugged import find, require_methods
from operator_side.controller.background_writes import BackgroundWrites
from operator_side.controller.port import Controller, OpenController
from operator_side.controller.search import BackgroundSearch, Ready
from operator_side.core import OperatorSide
from operator_side.dualsense.hid.device import HidBackend, load_backend
from operator_side.dualsense.hid.finding import Finder
from operator_side.dualsense.hid.release_guard import ReleaseGuard
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.evdev.pad import find_pad
from operator_side.people.arming_hands import constant_force
from operator_side.people.simulated_hands import simulated_hands
from operator_side.settings import OperatorSettings
from operator_side.viewing.pages.browser_hands import BrowserHands
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.pages.shared_hands import SharedHands


class OpeningParts(NamedTuple):
    """Parts that the opening of a controller may need."""

    settings: OperatorSettings
    core: OperatorSide
    pages: DrivingPage
    backend: HidBackend | None = None
    """Module to use instead of hidapi; None for hidapi"""


class Opening(NamedTuple):
    """Search for a controller, and the parts that belong to it."""

    search: BackgroundSearch
    guard: ReleaseGuard | None = None
    """Watchdog for the controller, whose context the caller enters; None if none is needed"""
    hands: BrowserHands | None = None
    """Page or scripted person at the controller, called in every turn; None for a real controller"""


def _hid(given: OpeningParts) -> Opening:
    # Without haptics nothing needs to be released, so there is no watchdog.
    return Opening(
        dualsense_search(given.backend, given.settings.controller), ReleaseGuard() if given.settings.haptics else None
    )


def dualsense_search(backend: HidBackend | None = None, only: str | None = None) -> BackgroundSearch:
    """Return a search for a real DualSense. backend: instead of hidapi. only: address of the one to take."""
    find = Finder(load_backend() if backend is None else backend, only)
    return BackgroundSearch(functools.partial(_with_background_writes, find))


def _with_background_writes(find: Finder, preferred: str | None) -> OpenController:
    found = find(preferred)
    writes = BackgroundWrites(found.device)
    return dataclasses.replace(found, device=writes, stalls=writes.stalls)


def _evdev(given: OpeningParts) -> Opening:
    del given
    return Opening(BackgroundSearch(find_pad))


def _simulated(given: OpeningParts) -> Opening:
    settings, device, core = given.settings, SimulatedDualSense(), given.core
    calibration, swap_sides = settings.calibration, settings.swap_sides
    own = settings.person_file if settings.pull_n is None else constant_force(settings.pull_n)
    person = functools.partial(
        simulated_hands,
        *(device, settings.person, settings.seed, calibration),
        swap_sides=swap_sides,
        own=own,
    )
    shared = SharedHands(given.pages, core.calibrate, device, calibration, person, swap_sides=swap_sides)
    return Opening(Ready(OpenController(shared, "simulated DualSense")), hands=shared)


def _browser(given: OpeningParts) -> Opening:
    page = BrowserHands(given.pages, given.core.calibrate, swap_sides=given.settings.swap_sides)
    return Opening(Ready(OpenController(page, "a page of the console")), hands=page)


DEVICES: Final[Mapping[str, Callable[[OpeningParts], Opening]]] = {
    "hid": _hid,
    "evdev": _evdev,
    "simulated": _simulated,
    "browser": _browser,
}
_METHODS: Final = {"read": "now_s", "write": "feel, now_s", "close": ""}


def opening_of(name: str, given: OpeningParts) -> Opening:
    """Return the opening of the controller `name`; ConfigurationError for one that is unknown or cannot be loaded."""
    if name in DEVICES:
        return DEVICES[name](given)
    opens = find("controller", name, DEVICES)
    if not callable(opens):
        raise ConfigurationError(
            f"controller {name}: is of type {type(opens).__name__}; valid: a function or class that opens one"
        )
    return Opening(BackgroundSearch(functools.partial(_open, name, opens)))


def _open(name: str, opens: Callable[[], Controller], preferred: str | None) -> OpenController:
    del preferred
    try:
        device = opens()
    except DeviceError:
        raise
    except Exception as error:  # anybody's code
        raise DeviceError(f"controller {name}: {type(error).__name__}: {error}") from error
    require_methods(f"controller {name}", device, _METHODS)
    return OpenController(device, name)
