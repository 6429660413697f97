"""Output reports, values to bytes and back: USB's 0x02, Bluetooth's 0x31.

A report has a flag for each part of the controller that it sets; a part without its flag stays as it is. Only the flags
of the parts that `OutputReport` sets are set here: the other lights, the mute key and the sound stay the system's.
Layout: Linux hid-playstation, SDL and Nielk1's notes, which agree.
"""

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Annotated, Any, Final

from msgspec import Meta

from common.errors import RemoteProtocolError
from common.limits import Limited, Share, check_limits
from operator_side.dualsense.effects.official import (
    COMMANDED_CODES,
    DEBUG_CODES,
    EFFECT_LENGTH,
    AnyEffect,
    Off,
    OtherEffect,
    decode_effect,
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

Byte = Annotated[int, Meta(ge=0, le=255)]
Color = tuple[Byte, Byte, Byte]

WARNING_LIGHT: Final[Color] = (255, 0, 0)
USUAL_LIGHT: Final[Color] = (0, 0, 128)
"""The color that Linux hid-playstation sets; we set it again after a warning."""

_COMMON_LENGTH: Final = 47
_USB_MAX_LENGTH: Final = 64  # some programs pad it to the length of an input report
_KERNEL_TAG: Final = 0x10
_OTHER_MARK, _OTHER_START = 0x02, 2

# Offsets in the common block
_FLAGS_0, _FLAGS_1, _MOTOR_RIGHT, _MOTOR_LEFT, _R2_EFFECT, _L2_EFFECT, _FLAGS_2, _LIGHTBAR = 0, 1, 2, 3, 10, 21, 38, 44
# Of the three bytes of flags
_CLASSIC_RUMBLE, _SELECT_RUMBLE, _SET_R2_EFFECT, _SET_L2_EFFECT = 0x01, 0x02, 0x04, 0x08
_SET_LIGHTBAR, _CLASSIC_RUMBLE_V2 = 0x04, 0x04


@dataclass(frozen=True, slots=True)
class Rumble(Limited):
    """The two motors' drive, 0 to 1 each; 256 steps on the wire."""

    left: Share = 0.0
    right: Share = 0.0


@dataclass(frozen=True, slots=True)
class OutputReport:
    """The parts of a controller that one output report sets; None leaves a part as it is."""

    l2: AnyEffect | None = None
    r2: AnyEffect | None = None
    rumble: Rumble | None = None
    lightbar: Color | None = None
    """Red, green and blue, 0 to 255 each."""

    def __post_init__(self) -> None:
        for name, effect in (("l2", self.l2), ("r2", self.r2)):
            if effect is not None and not isinstance(effect, AnyEffect):
                raise ValueError(f"{name} = {effect!r}; valid: a trigger effect or None")
        if self.lightbar is not None:
            check_limits(self)

    def following(self, before: "OutputReport") -> "OutputReport":
        """Join both, this one after `before`: each part by the newest that sets it."""
        pairs = zip(_parts(self), _parts(before), strict=True)
        return OutputReport(*(old if new is None else new for new, old in pairs))

    def change_from(self, before: "OutputReport") -> "OutputReport":
        """The parts of this one that differ from those of `before`; the others are None."""
        pairs = zip(_parts(self), _parts(before), strict=True)
        return OutputReport(*(None if new == old else new for new, old in pairs))

    @property
    def farewell(self) -> "OutputReport":
        """The report that undoes this one: RELEASED, and the usual light if this one sets a light."""
        return RELEASED if self.lightbar is None else OutputReport(Off(), Off(), Rumble(), USUAL_LIGHT)

    @property
    def releases(self) -> bool:
        """Whether nothing that it sets holds or shakes."""
        return self.l2 in (None, Off()) and self.r2 in (None, Off()) and self.rumble in (None, Rumble())


_parts: Final[Callable[[OutputReport], tuple[Any, ...]]] = attrgetter("l2", "r2", "rumble", "lightbar")
RELEASED: Final = OutputReport(l2=Off(), r2=Off(), rumble=Rumble())
"""No effect on either trigger, no rumble."""


def build_output_report(output: OutputReport, transport: Transport = Transport.USB, sequence: int = 0) -> bytes:
    """Make the report that sets what `output` holds: 48 bytes on USB, 78 with the checksum on Bluetooth.

    `sequence`: on Bluetooth, one more with each report; four bits of it are sent. Of the two framings of a Bluetooth
    report that are in use this is the one of Linux hid-playstation, whose authors make the controller. ValueError for
    anything but the two effects of official.py, whatever the type of `output`.
    """
    framing = OUTPUT_FRAMING[transport]
    report = bytearray(framing.length)
    report[0] = framing.report_id
    if transport is Transport.BLUETOOTH:
        report[1], report[2] = (sequence & 0x0F) << 4, _KERNEL_TAG
    report[framing.start : framing.start + _COMMON_LENGTH] = _common_block(output)
    for flag, place in ((_SET_L2_EFFECT, _L2_EFFECT), (_SET_R2_EFFECT, _R2_EFFECT)):
        code = report[framing.start + place]
        # The last gate before the wire, on the very bytes that are sent.
        if len(report) != framing.length or (code not in COMMANDED_CODES if report[framing.start] & flag else code):
            raise ValueError(f"report holds the effect code 0x{code:02x}; valid: 0x05, 0x21")
    return bytes(report) if transport is Transport.USB else sealed(Seed.OUTPUT, bytes(report[:-CHECKSUM_LENGTH]))


def _common_block(output: OutputReport) -> bytearray:
    block = bytearray(_COMMON_LENGTH)
    for effect, start, flag in ((output.l2, _L2_EFFECT, _SET_L2_EFFECT), (output.r2, _R2_EFFECT, _SET_R2_EFFECT)):
        if isinstance(effect, OtherEffect):
            raise ValueError(f"effect = {effect}; valid: Off, MultiPositionFeedback")
        if effect is not None:
            block[_FLAGS_0] |= flag
            block[start : start + EFFECT_LENGTH] = effect.encode()
    if output.rumble is not None:
        block[_FLAGS_0] |= _CLASSIC_RUMBLE | _SELECT_RUMBLE
        block[_MOTOR_LEFT] = round(output.rumble.left * 255)
        block[_MOTOR_RIGHT] = round(output.rumble.right * 255)
    if output.lightbar is not None:
        block[_FLAGS_1] |= _SET_LIGHTBAR
        block[_LIGHTBAR : _LIGHTBAR + 3] = bytes(output.lightbar)
    return block


def parse_output_report(report: bytes) -> OutputReport:
    """Read an output report of either transport; flags for other parts of the controller are passed over.

    USB: 48 to 64 bytes. Bluetooth: 78 bytes in either framing. RemoteProtocolError for another id, length, framing or
    checksum, and for a debug code in either trigger's place even where its flag is not set.
    """
    start = _common_start(report)
    block = report[start : start + _COMMON_LENGTH]
    for place in (_L2_EFFECT, _R2_EFFECT):
        if block[place] in DEBUG_CODES:
            raise RemoteProtocolError(f"output report: debug effect code 0x{block[place]:02x}; valid: none")
    flags = block[_FLAGS_0]
    rumbles = flags & _CLASSIC_RUMBLE or block[_FLAGS_2] & _CLASSIC_RUMBLE_V2
    red, green, blue = block[_LIGHTBAR : _LIGHTBAR + 3]
    return OutputReport(
        l2=decode_effect(block[_L2_EFFECT : _L2_EFFECT + EFFECT_LENGTH]) if flags & _SET_L2_EFFECT else None,
        r2=decode_effect(block[_R2_EFFECT : _R2_EFFECT + EFFECT_LENGTH]) if flags & _SET_R2_EFFECT else None,
        rumble=Rumble(block[_MOTOR_LEFT] / 255, block[_MOTOR_RIGHT] / 255) if rumbles else None,
        lightbar=(red, green, blue) if block[_FLAGS_1] & _SET_LIGHTBAR else None,
    )


def transport_of_output(report: bytes) -> Transport:
    """Tell the transport by the report's id and length; RemoteProtocolError for any other id or length."""
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
    """Find the begin of the common block; a Bluetooth report's second byte shows the framing."""
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
