"""Encoding and decoding of output reports: 0x02 on USB, 0x31 on Bluetooth.

A report has a flag for each part of the controller that it sets; parts without a flag stay unchanged. Only the flags of
triggers, motors and light bar are used: other lights, the mute key and sound are left to the operating system.
Layout: Linux hid-playstation, SDL and Nielk1's notes, which agree.
"""

from typing import Final

from common.errors import RemoteProtocolError
from operator_side.controller.feel import FREE_TRIGGER, Feel, Rumble
from operator_side.dualsense.effects.official import (
    COMMANDED_CODES,
    DEBUG_CODES,
    EFFECT_LENGTH,
    decode_effect,
    encode_effect,
)
from operator_side.dualsense.reports.transport import (
    CHECKSUM_LENGTH,
    OUTPUT_FRAMING,
    Seed,
    Transport,
    check,
    described,
    sealed,
)

_COMMON_LENGTH: Final = 47
_USB_MAX_LENGTH: Final = 64  # some programs pad it to the length of an input report
_KERNEL_TAG: Final = 0x10
_OTHER_MARK, _OTHER_START = 0x02, 2

# Offsets in the common block
_FLAGS_0, _FLAGS_1, _MOTOR_RIGHT, _MOTOR_LEFT, _R2_EFFECT, _L2_EFFECT, _FLAGS_2, _LIGHTBAR = 0, 1, 2, 3, 10, 21, 38, 44
# Bits in the three bytes of flags
_CLASSIC_RUMBLE, _SELECT_RUMBLE, _SET_R2_EFFECT, _SET_L2_EFFECT = 0x01, 0x02, 0x04, 0x08
_SET_LIGHTBAR, _CLASSIC_RUMBLE_V2 = 0x04, 0x04


def build_output_report(feel: Feel, transport: Transport = Transport.USB, sequence: int = 0) -> bytes:
    """Make the report that sets the effects of `feel`: 48 bytes on USB, 78 with the checksum on Bluetooth.

    sequence: used on Bluetooth; one more with each report, of which four bits are sent. Two framings are in use on
    Bluetooth; this is that of Linux hid-playstation, whose authors make the controller. ValueError if the report would
    contain an effect code other than the two of official.py.
    """
    framing = OUTPUT_FRAMING[transport]
    report = bytearray(framing.length)
    report[0] = framing.report_id
    if transport is Transport.BLUETOOTH:
        report[1], report[2] = (sequence & 0x0F) << 4, _KERNEL_TAG
    report[framing.start : framing.start + _COMMON_LENGTH] = _common_block(feel)
    for flag, place in ((_SET_L2_EFFECT, _L2_EFFECT), (_SET_R2_EFFECT, _R2_EFFECT)):
        code = report[framing.start + place]
        # Last check before sending, on the very bytes that are sent.
        if len(report) != framing.length or (code not in COMMANDED_CODES if report[framing.start] & flag else code):
            raise ValueError(f"report holds the effect code 0x{code:02x}; valid: 0x05, 0x21")
    return bytes(report) if transport is Transport.USB else sealed(Seed.OUTPUT, bytes(report[:-CHECKSUM_LENGTH]))


def _common_block(feel: Feel) -> bytearray:
    block = bytearray(_COMMON_LENGTH)
    for strengths, start, flag in ((feel.l2, _L2_EFFECT, _SET_L2_EFFECT), (feel.r2, _R2_EFFECT, _SET_R2_EFFECT)):
        if strengths is not None:
            block[_FLAGS_0] |= flag
            block[start : start + EFFECT_LENGTH] = encode_effect(strengths)
    if feel.rumble is not None:
        block[_FLAGS_0] |= _CLASSIC_RUMBLE | _SELECT_RUMBLE
        block[_MOTOR_LEFT] = round(feel.rumble.left * 255)
        block[_MOTOR_RIGHT] = round(feel.rumble.right * 255)
    if feel.light is not None:
        block[_FLAGS_1] |= _SET_LIGHTBAR
        block[_LIGHTBAR : _LIGHTBAR + 3] = bytes(feel.light)
    return block


def parse_output_report(report: bytes) -> Feel:
    """Decode an output report of either transport; parts of the controller other than those of `Feel` are ignored.

    USB: 48 to 64 bytes. Bluetooth: 78 bytes in either framing. A trigger effect that feelahead never sends is decoded
    as a free trigger. RemoteProtocolError for another id, length, framing or checksum, and for a debug effect code for
    either trigger, even if the trigger's flag is not set.
    """
    block = _block_of(report)
    flags = block[_FLAGS_0]
    rumbles = flags & _CLASSIC_RUMBLE or block[_FLAGS_2] & _CLASSIC_RUMBLE_V2
    red, green, blue = block[_LIGHTBAR : _LIGHTBAR + 3]
    l2, r2 = (None if effect is None else decode_effect(effect) or FREE_TRIGGER for effect in _effects(block))
    return Feel(
        l2=l2,
        r2=r2,
        rumble=Rumble(block[_MOTOR_LEFT] / 255, block[_MOTOR_RIGHT] / 255) if rumbles else None,
        light=(red, green, blue) if block[_FLAGS_1] & _SET_LIGHTBAR else None,
    )


def encoded_effects(report: bytes) -> tuple[bytes | None, bytes | None]:
    """Return the eleven bytes of L2's and of R2's effect, whatever they are; None for an effect that is not set.

    RemoteProtocolError as `parse_output_report`.
    """
    return _effects(_block_of(report))


def _block_of(report: bytes) -> bytes:
    start = _common_start(report)
    block = report[start : start + _COMMON_LENGTH]
    for place in (_L2_EFFECT, _R2_EFFECT):
        if block[place] in DEBUG_CODES:
            raise RemoteProtocolError(f"output report: debug effect code 0x{block[place]:02x}; valid: none")
    return block


def _effects(block: bytes) -> tuple[bytes | None, bytes | None]:
    """Return the encoded effects of L2 and R2; None for an effect that is not set."""
    l2, r2 = (
        block[place : place + EFFECT_LENGTH] if block[_FLAGS_0] & flag else None
        for place, flag in ((_L2_EFFECT, _SET_L2_EFFECT), (_R2_EFFECT, _SET_R2_EFFECT))
    )
    return l2, r2


def transport_of_output(report: bytes) -> Transport:
    """Return the transport for which the report's id and length are valid; RemoteProtocolError if there is none."""
    usb, bluetooth = OUTPUT_FRAMING[Transport.USB], OUTPUT_FRAMING[Transport.BLUETOOTH]
    if report and report[0] == usb.report_id and usb.length <= len(report) <= _USB_MAX_LENGTH:
        return Transport.USB
    if report and report[0] == bluetooth.report_id and len(report) == bluetooth.length:
        return Transport.BLUETOOTH
    raise RemoteProtocolError(
        f"output report: {described(report)}; valid: id 0x{usb.report_id:02x}, {usb.length} to {_USB_MAX_LENGTH} bytes"
        f" (USB), id 0x{bluetooth.report_id:02x}, {bluetooth.length} bytes (Bluetooth)"
    )


def _common_start(report: bytes) -> int:
    """Return the offset of the common block; on Bluetooth the report's second byte tells the framing.

    RemoteProtocolError for an invalid id, length, checksum or framing.
    """
    transport = transport_of_output(report)
    if transport is Transport.USB:
        return OUTPUT_FRAMING[transport].start
    check(Seed.OUTPUT, report)
    mark = report[1] & 0x0F  # below the sequence number
    if mark == 0 and report[2] == _KERNEL_TAG:
        return OUTPUT_FRAMING[transport].start
    if mark == _OTHER_MARK:
        return _OTHER_START
    raise RemoteProtocolError(
        f"output report: bytes 1 and 2 are 0x{report[1]:02x}, 0x{report[2]:02x}; "
        "valid: the sequence and 0x10 (hid-playstation), or 0x02 and no tag (SDL)"
    )
