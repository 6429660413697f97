"""Effects and output reports: exact bytes in each framing, only our flags, round trips, and never a debug code."""

from dataclasses import fields
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel, Rumble, Strengths
from operator_side.dualsense.effects.official import decode_effect, encode_effect
from operator_side.dualsense.reports import output_report
from operator_side.dualsense.reports.output_report import (
    build_output_report,
    encoded_effects,
    parse_output_report,
    transport_of_output,
)
from operator_side.dualsense.reports.transport import Seed, Transport, sealed
from tests.helpers.messages import feedback

TRANSPORTS = pytest.mark.parametrize("transport", Transport)
STRENGTHS = st.tuples(*[st.integers(0, 8)] * 10)
BYTES = st.integers(0, 255)
DRIVES = BYTES.map(lambda byte: byte / 255)
OUTPUTS = st.builds(
    Feel,
    st.none() | STRENGTHS,
    st.none() | STRENGTHS,
    st.none() | st.builds(Rumble, DRIVES, DRIVES),
    st.none() | st.tuples(BYTES, BYTES, BYTES),
)
FULL = Feel(l2=feedback(3, 6), r2=FREE_TRIGGER, rumble=Rumble(left=1.0, right=0.2), light=(10, 20, 30))
FULL_BLOCK = bytes.fromhex(
    "0f 04 33 ff 00 00 00 00 00 00"  # flags, motors right and left, nothing of the sound and the mute light
    "05 00 00 00 00 00 00 00 00 00 00"  # R2
    "21 f8 03 00 da b6 2d 00 00 00 00"  # L2
    "00 00 00 00 00 00 00 00 00 00 00 00 0a 14 1e"  # no power reduction, no player lights; colours at 44
)
CODES = [0xFC, 0xFD, 0xFE]


def framings(block: bytes) -> tuple[bytes, bytes, bytes]:
    """Build a report by hand in three framings: USB; Bluetooth as hid-playstation; Bluetooth as SDL and others."""
    return (
        b"\x02" + block,
        sealed(Seed.OUTPUT, (b"\x31\xb0\x10" + block).ljust(74, b"\0")),
        sealed(Seed.OUTPUT, (b"\x31\x92" + block).ljust(74, b"\0")),
    )


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (FREE_TRIGGER, "05 00 00 00 00 00 00 00 00 00 00"),
        # Test vector from public sources.
        (feedback(3, 6), "21 f8 03 00 da b6 2d 00 00 00 00"),
        # Computed by hand: each zone's strength minus 1, in three bits from bit 3 * zone on.
        (feedback(9, 8), "21 00 02 00 00 00 38 00 00 00 00"),
        (feedback(0, 8), "21 ff 03 ff ff ff 3f 00 00 00 00"),
        (feedback(0, 1), "21 ff 03 00 00 00 00 00 00 00 00"),
        ((1, 0, 0, 0, 0, 0, 0, 0, 0, 0), "21 01 00 00 00 00 00 00 00 00 00"),
        ((2, 8, 0, 0, 0, 0, 0, 0, 0, 5), "21 03 02 39 00 00 20 00 00 00 00"),
    ],
)
def test_exact_bytes_of_effects(effect: Strengths, expected: str) -> None:
    assert encode_effect(effect) == bytes.fromhex(expected)
    assert decode_effect(bytes.fromhex(expected)) == effect


@pytest.mark.parametrize(
    "encoded",
    [
        "05 00 00 00 00 00 00 00 00 00 01",  # Off, with another byte set.
        "21 00 00 00 00 00 00 00 00 00 00",  # feedback in no zone
        "21 00 04 00 00 00 00 00 00 00 00",  # an eleventh zone
        "21 01 00 08 00 00 00 00 00 00 00",  # a strength outside the mask
        "25 24 00 07 00 00 00 00 00 00 00",  # a weapon
        "26 f8 03 00 da b6 2d 00 00 ff 00",  # a vibration
    ],
)
def test_what_another_program_says_is_kept_as_it_is_and_holds_nothing(encoded: str) -> None:
    foreign = bytes.fromhex(encoded)
    assert decode_effect(foreign) is None
    block = bytearray(47)
    block[0], block[10:21] = 0x04, foreign
    assert parse_output_report(b"\x02" + block) == Feel(r2=FREE_TRIGGER)
    assert encoded_effects(b"\x02" + block) == (None, foreign)


@given(st.binary(min_size=11, max_size=11) | st.binary(min_size=10, max_size=10).map(lambda rest: b"\x21" + rest))
def test_any_bytes_decode_to_what_encodes_to_them(encoded: bytes) -> None:
    strengths = decode_effect(encoded)
    assert strengths is None or encode_effect(strengths) == encoded


@pytest.mark.parametrize(("transport", "sequence"), [(Transport.USB, 0), (Transport.BLUETOOTH, 11)])
def test_exact_bytes_of_reports(transport: Transport, sequence: int) -> None:
    expected = framings(FULL_BLOCK)[transport is Transport.BLUETOOTH]
    assert build_output_report(FULL, transport, sequence) == expected
    assert len(expected) == (48 if transport is Transport.USB else 78)
    assert {parse_output_report(report) for report in framings(FULL_BLOCK)} == {FULL}


@TRANSPORTS
@pytest.mark.parametrize(
    ("output", "flags"),
    [
        (Feel(), (0x00, 0x00)),
        (Feel(rumble=Rumble()), (0x03, 0x00)),
        (Feel(r2=FREE_TRIGGER), (0x04, 0x00)),
        (Feel(l2=FREE_TRIGGER), (0x08, 0x00)),
        (Feel(light=(0, 0, 0)), (0x00, 0x04)),
        (RELEASED, (0x0F, 0x00)),
    ],
)
def test_only_the_flags_of_what_is_set(transport: Transport, output: Feel, flags: tuple[int, int]) -> None:
    report = build_output_report(output, transport)
    start = 1 if transport is Transport.USB else 3
    assert (report[start], report[start + 1]) == flags
    assert report[start + 38] == 0


@TRANSPORTS
@given(output=OUTPUTS, sequence=st.integers(0, 100))
@settings(max_examples=1000)
def test_round_trip(transport: Transport, output: Feel, sequence: int) -> None:
    report = build_output_report(output, transport, sequence)
    assert transport_of_output(report) is transport
    assert parse_output_report(report) == output
    if transport is Transport.USB:
        assert parse_output_report(report + bytes(16)) == output
    else:
        assert report[1] == sequence % 16 << 4


@given(st.binary(max_size=130) | st.binary(min_size=47, max_size=47).flatmap(lambda b: st.sampled_from(framings(b))))
@settings(max_examples=1000)
def test_any_bytes_parse_without_a_debug_code_or_raise_the_documented_error(report: bytes) -> None:
    try:
        output = parse_output_report(report)
    except RemoteProtocolError:
        return
    start = 1 if report[0] == 2 else 2 if report[1] & 0x0F else 3
    assert not {report[start + 10], report[start + 21]} & set(CODES)
    assert (output.l2 is not None, output.r2 is not None) == (bool(report[start] & 8), bool(report[start] & 4))


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("place", [10, 21])
@pytest.mark.parametrize("flags", [0x00, 0x0C])
def test_a_debug_code_is_refused_wherever_it_stands(code: int, place: int, flags: int) -> None:
    block = bytearray(FULL_BLOCK)
    block[0], block[place] = flags, code
    for report in framings(bytes(block)):
        with pytest.raises(RemoteProtocolError, match=f"0x{code:02x}"):
            parse_output_report(report)


@TRANSPORTS
@pytest.mark.parametrize("code", [*CODES, 0x00, 0x01, 0x25, 0x26, 0x80, 0xFF])
def test_nothing_brings_another_code_to_the_wire(
    transport: Transport, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    bytes_of_code, off = bytes([code]), encode_effect(FREE_TRIGGER)
    for encoded in (
        bytes_of_code.ljust(11, b"\0"),
        off + bytes_of_code * 40,  # Longer, so that it is at another place.
        b"",
        bytes_of_code * 3,
    ):
        monkeypatch.setattr(output_report, "encode_effect", lambda _, encoded=encoded: encoded)
        for one in (Feel(l2=FREE_TRIGGER), Feel(r2=FREE_TRIGGER), RELEASED):
            with pytest.raises(ValueError, match="effect code"):
                build_output_report(one, transport)


@pytest.mark.parametrize(
    ("flags", "rumble"),
    [
        ({0: 0x03}, Rumble(1.0, 0.2)),
        ({0: 0x02, 38: 0x04}, Rumble(1.0, 0.2)),  # as hid-playstation does with present firmware
        ({0: 0x02}, None),
    ],
)
def test_either_way_to_rumble_is_read(flags: dict[int, int], rumble: Rumble | None) -> None:
    block = bytearray(47)
    block[2], block[3] = 51, 255
    for place, value in flags.items():
        block[place] = value
    assert parse_output_report(b"\x02" + block) == Feel(rumble=rumble)


@pytest.mark.parametrize(
    ("report", "message"),
    [
        (b"", "no bytes"),
        (b"\x02" + bytes(46), "id 0x02, 47 bytes; valid: id 0x02, 48 to 64 bytes"),
        (b"\x02" + bytes(64), "id 0x02, 65 bytes"),
        (b"\x31" + bytes(76), "id 0x31, 77 bytes"),
        (b"\x31" + bytes(77), "output report: checksum"),
        *(
            (sealed(Seed.OUTPUT, bytes.fromhex(start).ljust(74, b"\0")), "bytes 1 and 2")
            for start in ("31 00 00", "31 00 11", "31 01 10", "31 04 10")
        ),
    ],
)
def test_refused_bytes_are_named(report: bytes, message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        parse_output_report(report)


@pytest.mark.parametrize(
    ("strengths", "named"),
    [
        *(((1,) * 9, ""), ([1] * 10, r"\[1, "), ((1,) * 9 + (9,), ".*9"), ((-1,) + (0,) * 9, ".*-1")),
        *(((1.0,) + (0,) * 9, ".*1.0"), (5, "5"), (b"\xfc" * 10, "b")),
    ],
)
def test_refused_strengths_are_named(strengths: Any, named: str) -> None:
    for name in ("l2", "r2"):
        with pytest.raises(ValueError, match=f"{name} = {named}.*; valid: a tuple of 10"):
            Feel(**{name: strengths})


@given(OUTPUTS, OUTPUTS)
def test_two_in_a_row_set_what_both_together_set_and_a_change_leads_there(first: Feel, second: Feel) -> None:
    both = second.completed_from(first)
    for part in fields(Feel):
        newer, older = getattr(second, part.name), getattr(first, part.name)
        assert getattr(both, part.name) == (older if newer is None else newer)
    assert both.change_from(first).completed_from(first) == both
    assert both.change_from(both) == Feel()
