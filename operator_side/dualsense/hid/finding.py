"""Choice among connected controllers: first the previously used one, and USB rather than Bluetooth."""

from dataclasses import dataclass
from typing import Final

from common.errors import DeviceError, NoDeviceError
from operator_side.controller.feel import RELEASED
from operator_side.controller.port import OpenController
from operator_side.dualsense.hid.device import HidBackend, HidDualSense
from operator_side.dualsense.reports.models import PRODUCT_IDS, SONY_VENDOR_ID
from operator_side.dualsense.reports.output_report import build_output_report
from operator_side.dualsense.reports.transport import Transport

LOOKS_FOR_THE_SAME: Final = 3
"""Number of searches that accept only the previously used controller; the next search accepts any"""


@dataclass(frozen=True)
class Sighting:
    """Device node of a controller in the system, and the controller's model."""

    path: bytes
    model: str


def sightings(backend: HidBackend) -> list[Sighting]:
    """List the device nodes of all connected controllers, each once, in the system's order, without opening them."""
    listed = (
        Sighting(found["path"], model)
        for product_id, model in PRODUCT_IDS.items()
        for found in backend.enumerate(SONY_VENDOR_ID, product_id)
    )
    # The system lists a controller once for each of its HID usages.
    return list(dict.fromkeys(one for one in listed if isinstance(one.path, bytes) and one.path))


class Finder:
    """Searches for the previously used controller; takes another one only if several searches do not find it."""

    def __init__(self, backend: HidBackend, only: str | None = None) -> None:
        """only: address of the controller to take, and no other; None for any."""
        self._backend, self._only = backend, only
        self._looks = 0

    def __call__(self, preferred: str | None) -> OpenController:
        """Search once by `find_controller`; accept only `preferred` until LOOKS_FOR_THE_SAME searches have failed."""
        if self._only is not None:
            return find_controller(self._backend, self._only, others=False)
        self._looks += 1
        found = find_controller(self._backend, preferred, others=self._looks > LOOKS_FOR_THE_SAME)
        self._looks = 0
        return found


def find_controller(backend: HidBackend, preferred: str | None = None, *, others: bool = True) -> OpenController:
    """Open the controller with the address `preferred`, or another one; NoDeviceError or DeviceError if none.

    A controller that is connected by USB and Bluetooth at once is opened on USB. If `preferred` is given, another
    controller is taken only if `others` is True and every connected controller could be opened. One that could not may
    be the preferred one, as the system grants permission a moment after a controller appears. A dongle whose controller
    is off does not count as connected.
    """
    opened: list[tuple[Sighting, HidDualSense]] = []
    failure: DeviceError | None = None
    absent: NoDeviceError | None = None
    for sighting in sightings(backend):
        try:
            device = HidDualSense(backend, sighting.path)
            device.check_presence()
        except NoDeviceError as error:
            absent = absent or error
        except DeviceError as error:
            failure = failure or error
        else:
            opened.append((sighting, device))
    if not opened:
        raise failure or absent or _none_found()

    def is_another(one: HidDualSense) -> bool:
        return preferred is not None and one.identity.address != preferred

    def rank(pair: tuple[Sighting, HidDualSense]) -> tuple[bool, bool]:
        return is_another(pair[1]), pair[1].identity.transport is Transport.BLUETOOTH

    sighting, chosen = min(opened, key=rank)
    left_alone = is_another(chosen) and (failure is not None or not others)
    for _, other in opened:
        if left_alone or other is not chosen:
            other.close()
    if left_alone:
        there = dict.fromkeys(one.identity.address or "one without an address" for _, one in opened)
        raise failure or NoDeviceError(f"the controller {preferred} is not connected, only: {', '.join(there)}")
    transport, address = chosen.identity.transport, chosen.identity.address
    name = f"{sighting.model} on {transport.value}{'' if address is None else f' ({address})'}"
    return OpenController(chosen, name, address, sighting.path, build_output_report(RELEASED, transport))


def _none_found() -> NoDeviceError:
    """Make the error for no connected controller, with the remedies."""
    wanted = " or ".join(f"{name} ({SONY_VENDOR_ID:04X}:{product:04X})" for product, name in PRODUCT_IDS.items())
    return NoDeviceError(
        f"no {wanted} found: connect one by a USB cable that carries data, or by Bluetooth (hold Create and PS until"
        " its light flashes, then pair it), or run without one: --device simulated; in a container or virtual machine,"
        " pass the device through"
    )
