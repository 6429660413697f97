"""Which controllers there are, and the ids by which a system knows them."""

from enum import Enum
from typing import Final

SONY_VENDOR_ID: Final = 0x054C


class Model(Enum):
    """A kind of controller; the value is its product id on USB and Bluetooth."""

    DUALSENSE = 0x0CE6
    EDGE = 0x0DF2
    """It has two more keys and two paddles, and is otherwise the same to a program."""

    @property
    def title(self) -> str:
        """Its name for people."""
        return "DualSense" if self is Model.DUALSENSE else "DualSense Edge"


PRODUCT_IDS: Final = {model.value: model.title for model in Model}
"""Product ids with the names for people."""
