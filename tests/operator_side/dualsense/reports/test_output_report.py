"""Output reports: exact bytes in each framing, only our flags, round trips, and no debug code in any place."""

from dataclasses import fields, replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.effects.official import Feedback, MultiPositionFeedback, Off
from operator_side.dualsense.reports.checksum import Seed, sealed
from operator_side.dualsense.reports.output_report import (
    RELEASED,
    MuteLed,
    OutputReport,
    Rumble,
    build_output_report,
    parse_output_report,
    transport_of_output,
)
from operator_side.dualsense.reports.transport import Transport

REPEATABLE = settings(derandomize=True, deadline=None)
TRANSPORTS = pytest.mark.parametrize("transport", Transport)
START = {Transport.USB: 1, Transport.BLUETOOTH: 3}
EFFECTS = st.one_of(
    st.none(),
    st.just(Off()),
    st.builds(Feedback, st.integers(0, 9), st.integers(1, 8)),
    st.builds(MultiPositionFeedback, st.just((0, 1, 2, 3, 4, 5, 6, 7, 8, 0))),
)
BYTES = st.integers(0, 255)
DRIVES = BYTES.map(lambda byte: byte / 255)
OUTPUTS = st.builds(
    OutputReport,
    EFFECTS,
    EFFECTS,
    st.none() | st.builds(Rumble, DRIVES, DRIVES),
    st.none() | st.tuples(BYTES, BYTES, BYTES),
    st.none() | st.integers(0, 31),
    st.none() | st.sampled_from(MuteLed),
    st.none() | st.integers(0, 7),
)
FULL = OutputReport(
    l2=Feedback(3, 6),
    r2=Off(),
    rumble=Rumble(left=1.0, right=0.2),
    lightbar=(10, 20, 30),
    player_leds=0b10101,
    mute_led=MuteLed.BREATHING,
    trigger_power_reduction=3,
)
FULL_BLOCK = bytes.fromhex(
    "0f 55 33 ff 00 00 00 00 02 00"  # flags, motors right and left, nothing of the sound, mute light
    "05 00 00 00 00 00 00 00 00 00 00"  # R2
    "21 f8 03 00 da b6 2d 00 00 00 00"  # L2
    "00 00 00 00 03 00 00 00 00 00 00 15 0a 14 1e"  # power reduction at 36, player lights at 43, colours
)


def other_framing(block: bytes, sequence: int = 0) -> bytes:
    """Bluetooth as SDL and most libraries write it."""
    return sealed(Seed.OUTPUT, (bytes([0x31, sequence << 4 | 0x02]) + block).ljust(74, b"\0"))


def test_usb_bytes() -> None:
    assert build_output_report(FULL) == b"\x02" + FULL_BLOCK


def test_bluetooth_bytes() -> None:
    report = build_output_report(FULL, Transport.BLUETOOTH, sequence=11)
    assert report == sealed(Seed.OUTPUT, (b"\x31\xb0\x10" + FULL_BLOCK).ljust(74, b"\0"))
    assert len(report) == 78


def test_the_other_bluetooth_framing_is_read() -> None:
    assert parse_output_report(other_framing(FULL_BLOCK)) == FULL
    assert parse_output_report(other_framing(FULL_BLOCK, sequence=9)) == FULL


@TRANSPORTS
@pytest.mark.parametrize(
    ("output", "flags"),
    [
        (OutputReport(), (0x00, 0x00)),
        (OutputReport(rumble=Rumble()), (0x03, 0x00)),
        (OutputReport(r2=Off()), (0x04, 0x00)),
        (OutputReport(l2=Off()), (0x08, 0x00)),
        (OutputReport(mute_led=MuteLed.OFF), (0x00, 0x01)),
        (OutputReport(lightbar=(0, 0, 0)), (0x00, 0x04)),
        (OutputReport(player_leds=0), (0x00, 0x10)),
        (OutputReport(trigger_power_reduction=0), (0x00, 0x40)),
        (RELEASED, (0x0F, 0x00)),
    ],
)
def test_only_the_flags_of_what_is_set(transport: Transport, output: OutputReport, flags: tuple[int, int]) -> None:
    report = build_output_report(output, transport)
    start = START[transport]
    assert (report[start], report[start + 1]) == flags
    assert report[start + 38] == 0


@TRANSPORTS
@given(output=OUTPUTS, sequence=st.integers(0, 15))
@REPEATABLE
def test_round_trip(transport: Transport, output: OutputReport, sequence: int) -> None:
    report = build_output_report(output, transport, sequence)
    assert transport_of_output(report) is transport
    assert parse_output_report(report) == output
    if transport is Transport.USB:
        assert parse_output_report(report + bytes(16)) == output


@given(st.binary(max_size=130))
@REPEATABLE
def test_any_bytes_parse_or_raise_the_documented_error(report: bytes) -> None:
    try:
        parse_output_report(report)
    except RemoteProtocolError:
        return
    assert report[0] == 2
    assert len(report) in range(48, 65)


@TRANSPORTS
@given(block=st.binary(min_size=47, max_size=47), flags=st.sampled_from([0x00, 0x03, 0x04, 0x08]))
@REPEATABLE
def test_random_output_reports_raise_only_the_documented_error(transport: Transport, block: bytes, flags: int) -> None:
    block = bytes([flags]) + block[1:]
    report = b"\x02" + block
    if transport is Transport.BLUETOOTH:
        report = sealed(Seed.OUTPUT, (b"\x31\x00\x10" + block).ljust(74, b"\0"))
    try:
        output = parse_output_report(report)
    except RemoteProtocolError:
        return
    assert (output.l2 is not None) == bool(flags & 0x08)
    assert (output.r2 is not None) == bool(flags & 0x04)
    assert (output.lightbar is not None) == bool(block[1] & 0x04)


@pytest.mark.parametrize("code", [0xFC, 0xFD, 0xFE])
@pytest.mark.parametrize("place", [10, 21])
@pytest.mark.parametrize("flags", [0x00, 0x0C])
def test_a_debug_code_is_refused_wherever_it_stands(code: int, place: int, flags: int) -> None:
    block = bytearray(FULL_BLOCK)
    block[0] = flags
    block[place] = code
    for report in (
        b"\x02" + block,
        sealed(Seed.OUTPUT, (b"\x31\x00\x10" + block).ljust(74, b"\0")),
        other_framing(bytes(block)),
    ):
        with pytest.raises(RemoteProtocolError, match=f"0x{code:02x}"):
            parse_output_report(report)


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
    assert parse_output_report(b"\x02" + block) == OutputReport(rumble=rumble)


def test_a_wrong_checksum_is_refused() -> None:
    report = bytearray(build_output_report(FULL, Transport.BLUETOOTH))
    report[30] ^= 0x40
    with pytest.raises(RemoteProtocolError, match="output report: checksum"):
        parse_output_report(bytes(report))


@pytest.mark.parametrize("start", ["31 00 00", "31 00 11", "31 01 10", "31 04 10"])
def test_an_unknown_framing_is_refused(start: str) -> None:
    with pytest.raises(RemoteProtocolError, match="bytes 1 and 2"):
        parse_output_report(sealed(Seed.OUTPUT, bytes.fromhex(start).ljust(74, b"\0")))


def test_an_unknown_mute_light_is_refused() -> None:
    block = bytearray(FULL_BLOCK)
    block[8] = 3
    with pytest.raises(RemoteProtocolError, match="mute light 3"):
        parse_output_report(b"\x02" + block)


def test_nothing_but_the_effect_values_can_choose_a_code() -> None:
    class Debug:
        zone_strengths = (0,) * 10

        def encode(self) -> bytes:
            return b"\xfc" + bytes(10)

    with pytest.raises(ValueError, match="l2 = "):
        OutputReport(l2=Debug())  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fields", "name"),
    [
        ({"lightbar": (0, 0, 256)}, r"lightbar\[2\]"),
        ({"lightbar": (0, 0)}, "lightbar"),
        ({"lightbar": 5}, "lightbar"),
        ({"rumble": 0.5}, "rumble"),
        ({"player_leds": 0.5}, "player_leds"),
        ({"player_leds": 32}, "player_leds"),
        ({"mute_led": 1}, "mute_led"),
        ({"trigger_power_reduction": 8}, "trigger_power_reduction"),
        ({"trigger_power_reduction": 0.5}, "trigger_power_reduction"),
    ],
)
def test_arguments_out_of_range(fields: dict[str, Any], name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} = "):
        replace(FULL, **fields)


def test_rumble_out_of_range() -> None:
    with pytest.raises(ValueError, match=r"left = 1.5"):
        Rumble(left=1.5)
    with pytest.raises(ValueError, match="right = nan"):
        Rumble(right=float("nan"))


def test_sequence_out_of_range() -> None:
    with pytest.raises(ValueError, match="sequence = 16"):
        build_output_report(FULL, Transport.BLUETOOTH, 16)
    with pytest.raises(ValueError, match=r"sequence = 0\.5"):
        build_output_report(FULL, Transport.BLUETOOTH, 0.5)  # type: ignore[arg-type]


@given(OUTPUTS, OUTPUTS)
@REPEATABLE
def test_two_in_a_row_set_what_both_together_set(first: OutputReport, second: OutputReport) -> None:
    both = second.following(first)
    for part in fields(OutputReport):
        newer, older = getattr(second, part.name), getattr(first, part.name)
        assert getattr(both, part.name) == (older if newer is None else newer)
    assert OutputReport().following(first) == first.following(OutputReport()) == first


@given(OUTPUTS, OUTPUTS)
@REPEATABLE
def test_a_change_leads_from_the_one_to_the_other(before: OutputReport, after: OutputReport) -> None:
    wanted = after.following(before)
    assert wanted.change_from(before).following(before) == wanted
    assert wanted.change_from(wanted) == OutputReport()


@pytest.mark.parametrize(
    ("output", "releases"),
    [
        (OutputReport(), True),
        (RELEASED, True),
        (OutputReport(r2=Off(), lightbar=(1, 2, 3)), True),
        (OutputReport(l2=Off(), r2=Feedback(3, 6)), False),
        (OutputReport(rumble=Rumble(right=0.1)), False),
    ],
)
def test_what_holds_or_shakes_releases_nothing(output: OutputReport, releases: bool) -> None:
    assert output.releases is releases
