"""What a controller on USB answers to the driver's three questions."""

import struct

_CALIBRATION = struct.Struct("<B17h6x")


def usb_feature(report_id: int) -> bytes:
    """Feature report 0x05 (a nominal calibration), 0x09 (an address) or 0x20 (no versions); ValueError for others."""
    match report_id:
        case 0x05:
            return _CALIBRATION.pack(5, 0, 0, 0, *(8839, -8839) * 3, 540, 540, *(8192, -8192) * 3)
        case 0x09:
            return bytes([0x09, 1, 2, 3, 4, 5, 6]).ljust(20, b"\0")
        case 0x20:
            return bytes([0x20]).ljust(64, b"\0")
    raise ValueError(f"report_id = 0x{report_id:02x}; valid: 0x05, 0x09, 0x20")
