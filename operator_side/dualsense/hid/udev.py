"""The udev rule that lets the person at a Linux machine use the controller: its text, its place, what loads it.

`uaccess` gives the device to whoever sits at the machine; rules for that must come before 73-seat-late.rules. Over
USB the ids are attributes of the device; over Bluetooth they only are in the name of its parent.
"""

from typing import Final

from operator_side.dualsense.reports.models import PRODUCT_IDS, SONY_VENDOR_ID

RULE_FILE: Final = "/etc/udev/rules.d/70-dualsense.rules"
RULE_FOLDERS: Final = ("/etc/udev/rules.d", "/run/udev/rules.d", "/usr/local/lib/udev/rules.d", "/usr/lib/udev/rules.d")
"""Where udev looks."""
RELOAD: Final = "sudo udevadm control --reload && sudo udevadm trigger"

_GRANT: Final = 'MODE="0660", TAG+="uaccess"'
_USB: Final = 'KERNEL=="hidraw*", ATTRS{{idVendor}}=="{vendor:04x}", ATTRS{{idProduct}}=="{product:04x}", {grant}'
_BLUETOOTH: Final = 'KERNEL=="hidraw*", KERNELS=="*{vendor:04X}:{product:04X}*", {grant}'

RULES: Final = tuple(
    line.format(vendor=SONY_VENDOR_ID, product=product, grant=_GRANT)
    for product in PRODUCT_IDS
    for line in (_USB, _BLUETOOTH)
)
"""One line each: USB and Bluetooth, for every model."""


def installing_command() -> str:
    """Lines for a shell that put the rule into its place and load it; to be copied as they are."""
    return "\n".join((f"sudo tee {RULE_FILE} << 'END'", *RULES, "END", RELOAD))
