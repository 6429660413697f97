"""Output reports, values to bytes and back: USB's 0x02, Bluetooth's 0x31.

A report has a flag for each part of the controller that it sets; what has no flag stays as it is. Only the flags
of what is asked for are ever set here, so that the lights and the mute key stay the system driver's but for a warning,
and the sound whosever it is. Layout: Linux hid-playstation, SDL and Nielk1's notes, which agree.
"""

from dataclasses import dataclass, fields, replace
from enum import IntEnum
from typing import Final

from common.checks import check_integer, check_integers, check_kind, check_number
from common.errors import RemoteProtocolError
from operator_side.dualsense.effects.effect_codes import DEBUG_CODES
from operator_side.dualsense.effects.official import EFFECT_LENGTH, AnyEffect, Off, decode_effect
from operator_side.dualsense.effects.unofficial_effects import UnofficialEffect
from operator_side.dualsense.reports.checksum import CHECKSUM_LENGTH, Seed, check, sealed
from operator_side.dualsense.reports.transport import OUTPUT_FRAMING, Transport, described

Color = tuple[int, int, int]

WARNING_LIGHT: Final[Color] = (255, 0, 0)
USUAL_LIGHT: Final[Color] = (0, 0, 128)
"""What Linux hid-playstation sets it to: what it shows once we have changed it and do so no more."""

_COMMON_LENGTH: Final = 47
_USB_MAX_LENGTH: Final = 64  # some programs pad it to the length of an input report
_KERNEL_TAG: Final = 0x10
_OTHER_MARK, _OTHER_START = 0x02, 2

# Offsets in the common block
_FLAGS_0, _FLAGS_1, _MOTOR_RIGHT, _MOTOR_LEFT, _MUTE_LED, _R2_EFFECT, _L2_EFFECT = 0, 1, 2, 3, 8, 10, 21
_POWER_REDUCTION, _FLAGS_2, _PLAYER_LEDS, _LIGHTBAR = 36, 38, 43, 44
# Of the three bytes of flags
_CLASSIC_RUMBLE, _SELECT_RUMBLE, _SET_R2_EFFECT, _SET_L2_EFFECT = 0x01, 0x02, 0x04, 0x08
_SET_MUTE_LED, _SET_LIGHTBAR, _SET_PLAYER_LEDS, _SET_POWER_REDUCTION = 0x01, 0x04, 0x10, 0x40
_CLASSIC_RUMBLE_V2: Final = 0x04


@dataclass(frozen=True, slots=True)
class Rumble:
    """The two motors' drive, 0 to 1 each; 256 steps on the wire."""

    left: float = 0.0
    right: float = 0.0

    def __post_init__(self) -> None:
        for name, drive in (("left", self.left), ("right", self.right)):
            check_number(name, drive, 0.0, 1.0)


class MuteLed(IntEnum):
    """The light under the mute key."""

    OFF = 0
    ON = 1
    BREATHING = 2


@dataclass(frozen=True, slots=True)
class OutputReport:
    """What one output report sets; None leaves a part of the controller as it is."""

    l2: AnyEffect | None = None
    r2: AnyEffect | None = None
    rumble: Rumble | None = None
    lightbar: Color | None = None
    """Red, green and blue, 0 to 255 each."""
    player_leds: int | None = None
    """The five lights below the pad, a bit each from the left, 0 to 31."""
    mute_led: MuteLed | None = None
    trigger_power_reduction: int | None = None
    """How much weaker all trigger effects get: 0 to 7 steps of an eighth."""

    def __post_init__(self) -> None:
        for name, effect in (("l2", self.l2), ("r2", self.r2)):
            if effect is not None and not isinstance(effect, AnyEffect):
                raise ValueError(f"{name} = {effect!r}; valid: a trigger effect or None")
        if self.rumble is not None:
            check_kind("rumble", self.rumble, Rumble)
        if self.lightbar is not None:
            check_integers("lightbar", self.lightbar, 3, 0, 255)
        if self.mute_led is not None:
            check_kind("mute_led", self.mute_led, MuteLed)
        for name, value, highest in (
            ("player_leds", self.player_leds, 31),
            ("trigger_power_reduction", self.trigger_power_reduction, 7),
        ):
            if value is not None:
                check_integer(name, value, 0, highest)

    def following(self, before: "OutputReport") -> "OutputReport":
        """What both together set when this one comes after `before`: each part by the newest that sets it."""
        newer = {part.name: value for part in fields(self) if (value := getattr(self, part.name)) is not None}
        return replace(before, **newer)

    def change_from(self, before: "OutputReport") -> "OutputReport":
        """The parts of this one that `before` does not set alike; the others are None."""
        same = {part.name: None for part in fields(self) if getattr(self, part.name) == getattr(before, part.name)}
        return replace(self, **same)

    @property
    def farewell(self) -> "OutputReport":
        """What undoes all that this one sets: RELEASED, and the usual light if it sets one."""
        return RELEASED if self.lightbar is None else replace(RELEASED, lightbar=USUAL_LIGHT)

    @property
    def releases(self) -> bool:
        """Whether nothing that it sets holds or shakes."""
        parts = ((self.l2, RELEASED.l2), (self.r2, RELEASED.r2), (self.rumble, RELEASED.rumble))
        return all(part in (None, off) for part, off in parts)


RELEASED: Final = OutputReport(l2=Off(), r2=Off(), rumble=Rumble())
"""No effect on either trigger, no rumble."""


def build_output_report(
    output: OutputReport, transport: Transport = Transport.USB, sequence: int = 0, *, unofficial: bool = False
) -> bytes:
    """Make the report that sets what `output` holds: 48 bytes on USB, 78 with the checksum on Bluetooth.

    `sequence`: on Bluetooth, 0 to 15, one more with each report; ValueError beyond. Of the two framings of a
    Bluetooth report that are in use this is the one of Linux hid-playstation, whose authors make the controller.
    ValueError for an unofficial effect unless `unofficial` says that it is meant.
    """
    if not unofficial:
        for name, effect in (("l2", output.l2), ("r2", output.r2)):
            if isinstance(effect, UnofficialEffect):
                raise ValueError(f"{name} = {effect}; valid: an official effect, unless unofficial=True")
    check_integer("sequence", sequence, 0, 15)
    framing = OUTPUT_FRAMING[transport]
    report = bytearray(framing.length)
    report[0] = framing.report_id
    report[framing.start : framing.start + _COMMON_LENGTH] = _common_block(output)
    if transport is Transport.USB:
        return bytes(report)
    report[1], report[2] = sequence << 4, _KERNEL_TAG
    return sealed(Seed.OUTPUT, bytes(report[:-CHECKSUM_LENGTH]))


def _common_block(output: OutputReport) -> bytearray:
    block = bytearray(_COMMON_LENGTH)
    for effect, start, flag in (
        (output.l2, _L2_EFFECT, _SET_L2_EFFECT),
        (output.r2, _R2_EFFECT, _SET_R2_EFFECT),
    ):
        if effect is not None:
            block[_FLAGS_0] |= flag
            block[start : start + EFFECT_LENGTH] = effect.encode()
    if output.rumble is not None:
        block[_FLAGS_0] |= _CLASSIC_RUMBLE | _SELECT_RUMBLE
        block[_MOTOR_LEFT] = round(output.rumble.left * 255)
        block[_MOTOR_RIGHT] = round(output.rumble.right * 255)
    if output.mute_led is not None:
        block[_FLAGS_1] |= _SET_MUTE_LED
        block[_MUTE_LED] = output.mute_led
    if output.lightbar is not None:
        block[_FLAGS_1] |= _SET_LIGHTBAR
        block[_LIGHTBAR : _LIGHTBAR + 3] = bytes(output.lightbar)
    if output.player_leds is not None:
        block[_FLAGS_1] |= _SET_PLAYER_LEDS
        block[_PLAYER_LEDS] = output.player_leds
    if output.trigger_power_reduction is not None:
        block[_FLAGS_1] |= _SET_POWER_REDUCTION
        block[_POWER_REDUCTION] = output.trigger_power_reduction
    return block


def parse_output_report(report: bytes, *, unofficial: bool = False) -> OutputReport:
    """Read an output report of either transport; flags for other parts of the controller are passed over.

    USB: 48 to 64 bytes. Bluetooth: 78 bytes in either framing. RemoteProtocolError for another id, length,
    framing or checksum, for an effect that does not decode, and for a debug code in either trigger's place even
    where its flag is not set. `unofficial`: accept those effects, too.
    """
    start = _common_start(report)
    block = report[start : start + _COMMON_LENGTH]
    for place in (_L2_EFFECT, _R2_EFFECT):
        if block[place] in DEBUG_CODES:
            raise RemoteProtocolError(f"output report: debug effect code 0x{block[place]:02x}; valid: none")
    flags, flags_1 = block[_FLAGS_0], block[_FLAGS_1]
    rumbles = flags & _CLASSIC_RUMBLE or block[_FLAGS_2] & _CLASSIC_RUMBLE_V2
    return OutputReport(
        l2=_effect_at(block, _L2_EFFECT, unofficial) if flags & _SET_L2_EFFECT else None,
        r2=_effect_at(block, _R2_EFFECT, unofficial) if flags & _SET_R2_EFFECT else None,
        rumble=Rumble(block[_MOTOR_LEFT] / 255, block[_MOTOR_RIGHT] / 255) if rumbles else None,
        lightbar=(block[_LIGHTBAR], block[_LIGHTBAR + 1], block[_LIGHTBAR + 2]) if flags_1 & _SET_LIGHTBAR else None,
        player_leds=block[_PLAYER_LEDS] & 0x1F if flags_1 & _SET_PLAYER_LEDS else None,
        mute_led=_mute_led(block[_MUTE_LED]) if flags_1 & _SET_MUTE_LED else None,
        trigger_power_reduction=block[_POWER_REDUCTION] & 0x07 if flags_1 & _SET_POWER_REDUCTION else None,
    )


def transport_of_output(report: bytes) -> Transport:
    """Tell by an output report's id and length what it is for; RemoteProtocolError for any other id or length."""
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
    """Where the common block begins; a Bluetooth report's second byte tells its framing."""
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


def _effect_at(block: bytes, start: int, unofficial: bool) -> AnyEffect:
    return decode_effect(block[start : start + EFFECT_LENGTH], unofficial=unofficial)


def _mute_led(byte: int) -> MuteLed:
    try:
        return MuteLed(byte)
    except ValueError as error:
        raise RemoteProtocolError(f"output report: mute light {byte}; valid: 0 to 2") from error
