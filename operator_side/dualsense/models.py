"""Which controllers there are."""

from typing import Final

SONY_VENDOR_ID: Final = 0x054C
PRODUCT_IDS: Final = {0x0CE6: "DualSense", 0x0DF2: "DualSense Edge"}
"""USB and Bluetooth product ids."""
