"""The address by which a controller is known, the same on USB and on Bluetooth."""

import re
import reprlib
from typing import Final

_ADDRESS: Final = re.compile("[0-9a-f]{2}(:[0-9a-f]{2}){5}")


def checked_address(address: object) -> str:
    """`address`, which has the form "aa:bb:cc:dd:ee:ff"; ValueError for anything else."""
    if not isinstance(address, str) or not _ADDRESS.fullmatch(address):
        raise ValueError(
            f"address = {reprlib.repr(address)}; valid: six pairs of hexadecimal digits like aa:bb:cc:dd:ee:ff"
        )
    return address
