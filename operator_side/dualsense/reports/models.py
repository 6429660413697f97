"""Supported models of controllers, with vendor and product ids."""

from enum import Enum
from typing import Final

SONY_VENDOR_ID: Final = 0x054C


class Model(Enum):
    """Model of a controller. The value is its product id, the same on USB and Bluetooth."""

    DUALSENSE = 0x0CE6
    EDGE = 0x0DF2
    """DualSense with two function keys and two paddles; otherwise a program sees no difference"""

    @property
    def title(self) -> str:
        """Name of the model, as shown to the operator."""
        return "DualSense" if self is Model.DUALSENSE else "DualSense Edge"


PRODUCT_IDS: Final = {model.value: model.title for model in Model}
"""Name of each model, keyed by product id"""
