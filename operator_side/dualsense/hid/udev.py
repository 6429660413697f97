"""Udev rule that permits a person logged in at a Linux machine to use the controller, and commands to install it.

The tag `uaccess` grants the device to the person at the machine; such a rule's file must sort before
73-seat-late.rules. Over USB the ids are attributes of the device; over Bluetooth they are only in its parent's name.
"""

from typing import Final

from operator_side.dualsense.reports.models import PRODUCT_IDS, SONY_VENDOR_ID

RULE_FILE: Final = "/etc/udev/rules.d/70-dualsense.rules"
RULE_FOLDERS: Final = ("/etc/udev/rules.d", "/run/udev/rules.d", "/usr/local/lib/udev/rules.d", "/usr/lib/udev/rules.d")
"""Folders that udev reads"""
RELOAD: Final = "sudo udevadm control --reload && sudo udevadm trigger"

_GRANT: Final = 'MODE="0660", TAG+="uaccess"'
_USB: Final = 'KERNEL=="hidraw*", ATTRS{{idVendor}}=="{vendor:04x}", ATTRS{{idProduct}}=="{product:04x}", {grant}'
_BLUETOOTH: Final = 'KERNEL=="hidraw*", KERNELS=="*{vendor:04X}:{product:04X}*", {grant}'

RULES: Final = tuple(
    line.format(vendor=SONY_VENDOR_ID, product=product, grant=_GRANT)
    for product in PRODUCT_IDS
    for line in (_USB, _BLUETOOTH)
)
"""Rules, one line for each model on USB and on Bluetooth"""


def installing_command() -> str:
    """Return shell commands that install the rules and load them, to be copied into a shell."""
    return "\n".join((f"sudo tee {RULE_FILE} << 'END'", *RULES, "END", RELOAD))
