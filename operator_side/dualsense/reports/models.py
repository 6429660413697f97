"""Models of controllers, and their ids."""

from enum import Enum
from typing import Final

SONY_VENDOR_ID: Final = 0x054C


class Model(Enum):
    """Model of a controller; the value is its product id on USB and Bluetooth."""

    DUALSENSE = 0x0CE6
    EDGE = 0x0DF2
    """DualSense with two more keys and two paddles, otherwise the same to a program."""

    @property
    def title(self) -> str:
        """Name for people."""
        return "DualSense" if self is Model.DUALSENSE else "DualSense Edge"


PRODUCT_IDS: Final = {model.value: model.title for model in Model}
"""Names for people by product id"""
