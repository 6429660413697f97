"""What is said when a controller cannot be used, and what to do about each. One line each."""

import os
import sys

from common.errors import DeviceError, NoDeviceError
from operator_side.dualsense.reports.models import PRODUCT_IDS, SONY_VENDOR_ID

INSTALL = "pip install --force-reinstall hidapi"
"""Over another package's module, too; by its own name, for feelahead may come from a folder."""
_WITHOUT = "run without one: --device simulated"


def none_found() -> NoDeviceError:
    """No controller is connected, or the system does not show it."""
    wanted = " or ".join(f"{name} ({SONY_VENDOR_ID:04X}:{product:04X})" for product, name in PRODUCT_IDS.items())
    return NoDeviceError(
        f"no {wanted} found: connect one by a USB cable that carries data, or by Bluetooth (hold Create and PS until"
        f" its light flashes, then pair it), or {_WITHOUT}; in a container or virtual machine, pass the device through"
    )


def not_opened(path: bytes, reason: str) -> DeviceError:
    """There is one, and the system does not let us at it."""
    name = os.fsdecode(path)
    denied = os.path.exists(name) and not os.access(name, os.R_OK | os.W_OK)  # noqa: PTH110  # hidapi's names need not be paths
    if sys.platform == "linux" and (denied or "permission denied" in reason.lower()):
        return DeviceError(
            f"no permission to open the controller at {name}: `feelahead doctor` prints the udev rule that grants it,"
            " and the command that puts it in place"
        )
    return DeviceError(
        f"the controller at {name} cannot be opened ({reason}): close other programs that use it (Steam Input), plug"
        f" it in again, or {_WITHOUT}"
    )


def no_dualsense(path: bytes, reason: str) -> DeviceError:
    """It was opened, and what it sends cannot be read."""
    return DeviceError(
        f"the controller at {os.fsdecode(path)} does not speak as a DualSense does ({reason}): plug it in again;"
        " imitations are not supported"
    )


def silent(path: bytes) -> DeviceError:
    """It was opened, and sends nothing."""
    return DeviceError(
        f"the controller at {os.fsdecode(path)} sends nothing: press its PS button, and plug it in again if that does"
        " not help"
    )


def gone(reason: str) -> DeviceError:
    """The controller was there a moment ago."""
    return DeviceError(f"the controller is gone ({reason}): plug it in again, or press its PS button")
