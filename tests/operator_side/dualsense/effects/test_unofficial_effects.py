"""Unofficial trigger effects: exact bytes, and nothing of them unless it is asked for."""

import itertools
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.effects.official import AnyEffect, decode_effect
from operator_side.dualsense.effects.unofficial_effects import (
    Bow,
    Galloping,
    Machine,
    SimpleFeedback,
    SimpleVibration,
    SimpleWeapon,
)
from operator_side.dualsense.reports.output_report import OutputReport, build_output_report, parse_output_report
from operator_side.dualsense.reports.transport import Transport

CODES = (0x01, 0x02, 0x06, 0x22, 0x23, 0x27)


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        # Zones 1 and 4: bits 0x02 and 0x10; strength 2 is 1, snap 8 is 7 << 3.
        (Bow(1, 4, 2, 8), "22 12 00 39 00 00 00 00 00 00 00"),
        # Zones 0 and 9: bits 0x001 and 0x200; the second foot is the low one.
        (Galloping(0, 9, 1, 5, 10), "23 01 02 0d 0a 00 00 00 00 00 00"),
        (Machine(2, 8, 3, 6, 20, 15), "27 04 01 33 14 0f 00 00 00 00 00"),
        (SimpleFeedback(0x10, 0x80), "01 10 80 00 00 00 00 00 00 00 00"),
        (SimpleWeapon(0x10, 0x80, 0xFF), "02 10 80 ff 00 00 00 00 00 00 00"),
        (SimpleVibration(30, 0x40, 0x20), "06 1e 40 20 00 00 00 00 00 00 00"),
    ],
)
def test_exact_bytes(effect: AnyEffect, expected: str) -> None:
    encoded = bytes.fromhex(expected)
    assert effect.encode() == encoded
    assert decode_effect(encoded, unofficial=True) == effect
    with pytest.raises(RemoteProtocolError, match=f"0x{encoded[0]:02x}; valid: 0x05, 0x21, 0x25, 0x26$"):
        decode_effect(encoded)


@pytest.mark.parametrize("transport", Transport)
def test_reports_hold_them_only_when_asked(transport: Transport) -> None:
    output = OutputReport(l2=Galloping(0, 9, 1, 5, 10))
    with pytest.raises(ValueError, match=r"l2 = Galloping.*unofficial=True"):
        build_output_report(output, transport)
    report = build_output_report(output, transport, unofficial=True)
    assert parse_output_report(report, unofficial=True) == output
    with pytest.raises(RemoteProtocolError, match="0x23"):
        parse_output_report(report)


def test_the_bow_holds_until_it_snaps() -> None:
    assert Bow(1, 4, 2, 8).zone_strengths == (0, 2, 2, 2, 0, 0, 0, 0, 0, 0)


@given(st.sampled_from(CODES), st.binary(min_size=10, max_size=10), st.integers(0, 10))
@settings(derandomize=True, deadline=None, max_examples=1000)
def test_any_bytes_decode_whole_or_not_at_all(code: int, rest: bytes, kept: int) -> None:
    encoded = bytes([code]) + rest[:kept] + bytes(10 - kept)
    try:
        effect = decode_effect(encoded, unofficial=True)
    except RemoteProtocolError:
        return
    assert effect.encode() == encoded


def test_every_bow_galloping_and_machine_survives_a_round_trip() -> None:
    effects: list[AnyEffect] = []
    for start, end in itertools.combinations(range(10), 2):
        if end <= 8:
            effects += [Bow(start, end, *forces) for forces in itertools.product(range(1, 9), repeat=2)]
        effects += [Galloping(start, end, *feet, 7) for feet in itertools.combinations(range(8), 2)]
        effects += [Machine(start, end, a, b, 255, 9) for a, b in itertools.product(range(8), repeat=2)]
    assert len(effects) == 36 * 64 + 45 * 28 + 45 * 64
    for effect in effects:
        assert decode_effect(effect.encode(), unofficial=True) == effect


def test_no_debug_code_decodes_even_so() -> None:
    for code in (0xFC, 0xFD, 0xFE):
        with pytest.raises(RemoteProtocolError, match=f"0x{code:02x}"):
            decode_effect(bytes([code]) + bytes(10), unofficial=True)


@pytest.mark.parametrize(
    "encoded",
    [
        "22 12 00 79 00 00 00 00 00 00 00",  # a snap of 16
        "22 02 02 00 00 00 00 00 00 00 00",  # a bow to zone 9
        "23 01 02 2d 0a 00 00 00 00 00 00",  # both feet at once
        "23 01 02 0d 00 00 00 00 00 00 00",  # at 0 Hz
        "27 04 01 73 14 0f 00 00 00 00 00",  # an amplitude of 14
        "27 05 01 33 14 0f 00 00 00 00 00",  # three zones
        "01 10 80 01 00 00 00 00 00 00 00",
    ],
)
def test_stray_bits_are_refused(encoded: str) -> None:
    with pytest.raises(RemoteProtocolError, match="stray bits"):
        decode_effect(bytes.fromhex(encoded), unofficial=True)


@pytest.mark.parametrize(
    ("effect", "arguments", "message"),
    [
        (Bow, (8, 9, 1, 1), "end = 9"),
        (Bow, (0, 1, 0, 1), "strength = 0"),
        (Bow, (0, 1, 1, 9), "snap = 9"),
        (Galloping, (9, 9, 0, 1, 1), "start = 9"),
        (Galloping, (0, 9, 7, 7, 1), "first_foot = 7"),
        (Galloping, (0, 9, 3, 3, 1), "second_foot = 3"),
        (Galloping, (0, 9, 3, 4, 0), "frequency_hz = 0"),
        (Machine, (0, 0, 0, 0, 1, 0), "end = 0"),
        (Machine, (0, 1, 8, 0, 1, 0), "amplitude_a = 8"),
        (Machine, (0, 1, 0, 8, 1, 0), "amplitude_b = 8"),
        (Machine, (0, 1, 0, 0, 1, 256), "period_ds = 256"),
        (SimpleFeedback, (256, 0), "position = 256"),
        (SimpleWeapon, (0, 0, 0.5), "strength = 0.5"),
        (SimpleVibration, (-1, 0, 0), "frequency_hz = -1"),
    ],
)
def test_arguments_out_of_range(effect: Any, arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        effect(*arguments)
