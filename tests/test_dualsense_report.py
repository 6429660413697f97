"""USB reports: every field in its place, round trips, and one error for all that is no report."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.effects import Feedback, MultiPositionFeedback, Off, TriggerEffect
from operator_side.dualsense.report import (
    Button,
    ControllerState,
    OutputReport,
    Rumble,
    TriggerFeedback,
    build_input_report,
    build_output_report,
    parse_input_report,
    parse_output_report,
)

REPEATABLE = settings(derandomize=True, deadline=None)
INPUT_REPORTS = st.binary(min_size=63, max_size=63).map(lambda rest: b"\x01" + rest)
EFFECTS = st.one_of(
    st.none(),
    st.just(Off()),
    st.builds(Feedback, st.integers(0, 9), st.integers(1, 8)),
    st.builds(MultiPositionFeedback, st.just((0, 1, 2, 3, 4, 5, 6, 7, 8, 0))),
)
BYTE_DRIVES = st.integers(0, 255).map(lambda byte: byte / 255)


def report_with(**fields: int) -> bytes:
    """An idle input report with bytes set: `b8=0x20` is byte 8."""
    report = bytearray(64)
    report[0] = 0x01
    report[1:5] = bytes([128] * 4)
    report[8] = 0x08
    for name, value in fields.items():
        report[int(name[1:])] = value
    return bytes(report)


def test_idle_report() -> None:
    assert parse_input_report(report_with()) == ControllerState()


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"b1": 255}, {"left_stick": (1.0, 0.0)}),
        ({"b1": 0}, {"left_stick": (-1.0, 0.0)}),
        ({"b2": 0}, {"left_stick": (0.0, 1.0)}),
        ({"b2": 255}, {"left_stick": (0.0, -1.0)}),
        ({"b3": 64}, {"right_stick": (-0.5, 0.0)}),
        ({"b4": 64}, {"right_stick": (0.0, 0.5)}),
        ({"b5": 255}, {"l2": 1.0}),
        ({"b6": 51}, {"r2": 0.2}),
        ({"b7": 200}, {"sequence": 200}),
        ({"b28": 0xC0, "b29": 0xC6, "b30": 0x2D}, {"sensor_time_s": 1.0}),  # 3 000 000 thirds of a microsecond
        ({"b42": 0x19, "b48": 0x01}, {"r2_feedback": TriggerFeedback(9, 1, 1)}),
        ({"b43": 0x03, "b48": 0x20}, {"l2_feedback": TriggerFeedback(3, 0, 2)}),
    ],
)
def test_each_field_has_its_byte(fields: dict[str, int], expected: dict[str, Any]) -> None:
    assert parse_input_report(report_with(**fields)) == ControllerState(**expected)


@pytest.mark.parametrize(
    ("fields", "button"),
    [
        ({"b8": 0x18}, Button.SQUARE),
        ({"b8": 0x28}, Button.CROSS),
        ({"b8": 0x48}, Button.CIRCLE),
        ({"b8": 0x88}, Button.TRIANGLE),
        ({"b9": 0x01}, Button.L1),
        ({"b9": 0x02}, Button.R1),
        ({"b9": 0x04}, Button.L2),
        ({"b9": 0x08}, Button.R2),
        ({"b9": 0x10}, Button.CREATE),
        ({"b9": 0x20}, Button.OPTIONS),
        ({"b9": 0x40}, Button.L3),
        ({"b9": 0x80}, Button.R3),
        ({"b10": 0x01}, Button.PS),
        ({"b10": 0x02}, Button.TOUCHPAD),
        ({"b10": 0x04}, Button.MUTE),
        ({"b10": 0x10}, Button.LEFT_FUNCTION),
        ({"b10": 0x20}, Button.RIGHT_FUNCTION),
        ({"b10": 0x40}, Button.LEFT_PADDLE),
        ({"b10": 0x80}, Button.RIGHT_PADDLE),
    ],
)
def test_each_button_has_its_bit(fields: dict[str, int], button: Button) -> None:
    assert parse_input_report(report_with(**fields)).pressed == {button}


@pytest.mark.parametrize(
    ("hat", "pressed"),
    [
        (0, {Button.UP}),
        (1, {Button.UP, Button.RIGHT}),
        (2, {Button.RIGHT}),
        (3, {Button.RIGHT, Button.DOWN}),
        (4, {Button.DOWN}),
        (5, {Button.DOWN, Button.LEFT}),
        (6, {Button.LEFT}),
        (7, {Button.LEFT, Button.UP}),
        (8, set()),
        (15, set()),
    ],
)
def test_hat_goes_clockwise_from_up(hat: int, pressed: set[Button]) -> None:
    assert parse_input_report(report_with(b8=hat)).pressed == pressed


@given(INPUT_REPORTS)
@REPEATABLE
def test_every_input_report_survives_a_round_trip(report: bytes) -> None:
    state = parse_input_report(report)
    built = build_input_report(state)
    assert parse_input_report(built) == state
    # Sticks, triggers, sequence and buttons are the very same bytes, the hat's null states and the two
    # undefined bits apart.
    assert built[1:8] == report[1:8]
    assert built[8] & 0xF0 == report[8] & 0xF0
    assert built[9] == report[9]
    assert built[10] == report[10] & 0xF7
    assert built[28:32] == report[28:32]
    assert built[42:44] == report[42:44]
    assert built[48] == report[48]


@given(
    st.tuples(*[st.floats(-1, 1)] * 4),
    st.tuples(*[st.floats(0, 1)] * 2),
    st.floats(0, 1431.6),
)
@REPEATABLE
def test_building_rounds_to_the_nearest_step(
    sticks: tuple[float, ...], triggers: tuple[float, ...], time_s: float
) -> None:
    state = ControllerState(
        (sticks[0], sticks[1]), (sticks[2], sticks[3]), triggers[0], triggers[1], sensor_time_s=time_s
    )
    read = parse_input_report(build_input_report(state))
    assert [*read.left_stick, *read.right_stick] == pytest.approx(sticks, abs=0.5 / 127 + 1e-12)
    assert [read.l2, read.r2] == pytest.approx(triggers, abs=0.5 / 255 + 1e-12)
    assert read.sensor_time_s == pytest.approx(time_s, abs=0.5 / 3e6 + 1e-12)


def test_the_built_report_says_that_nothing_touches_the_pad() -> None:
    report = build_input_report(ControllerState())
    assert len(report) == 64
    assert report[33] & 0x80
    assert report[37] & 0x80


@given(st.binary(max_size=130))
@REPEATABLE
def test_any_bytes_parse_or_raise_the_documented_error(report: bytes) -> None:
    for report_id, lengths, parse in (
        (1, range(64, 65), parse_input_report),
        (2, range(48, 65), parse_output_report),
    ):
        try:
            parse(report)
        except RemoteProtocolError:
            continue
        assert report[0] == report_id
        assert len(report) in lengths


@given(INPUT_REPORTS, st.integers(0, 63))
@REPEATABLE
def test_a_truncated_input_report_names_its_length(report: bytes, length: int) -> None:
    with pytest.raises(RemoteProtocolError, match=f"{length} bytes;" if length else "no bytes;"):
        parse_input_report(report[:length])


def test_a_bluetooth_report_names_its_id_and_length() -> None:
    with pytest.raises(RemoteProtocolError, match="id 0x31, 78 bytes"):
        parse_input_report(b"\x31" + bytes(77))


@pytest.mark.parametrize(
    ("fields", "name"),
    [
        ({"left_stick": (1.1, 0.0)}, "left_stick"),
        ({"right_stick": (0.0, float("nan"))}, "right_stick"),
        ({"l2": -0.1}, "l2"),
        ({"r2": float("nan")}, "r2"),
        ({"sequence": 256}, "sequence"),
        ({"sensor_time_s": 2000.0}, "sensor_time_s"),
        ({"pressed": frozenset({Button.UP, Button.DOWN})}, "pressed"),
        ({"pressed": frozenset({Button.LEFT, Button.RIGHT})}, "pressed"),
    ],
)
def test_impossible_states_are_refused(fields: dict[str, Any], name: str) -> None:
    with pytest.raises(ValueError, match=name):
        ControllerState(**fields)


def test_output_report_bytes() -> None:
    expected = bytearray(48)
    expected[0] = 0x02
    expected[1] = 0x0F
    expected[3] = 51  # right
    expected[4] = 255  # left
    expected[11] = 0x05
    expected[22:33] = bytes.fromhex("21 f8 03 00 da b6 2d 00 00 00 00")
    assert build_output_report(Feedback(3, 6), Off(), Rumble(left=1.0, right=0.2)) == bytes(expected)


@pytest.mark.parametrize(
    ("output", "flags"),
    [
        (OutputReport(), 0x00),
        (OutputReport(rumble=Rumble()), 0x03),
        (OutputReport(r2=Off()), 0x04),
        (OutputReport(l2=Off()), 0x08),
    ],
)
def test_only_the_flags_of_what_is_set(output: OutputReport, flags: int) -> None:
    report = build_output_report(output.l2, output.r2, output.rumble)
    assert report[1] == flags
    assert report[2] == 0
    assert report[39] == 0


@given(EFFECTS, EFFECTS, st.none() | st.builds(Rumble, BYTE_DRIVES, BYTE_DRIVES))
@REPEATABLE
def test_output_round_trip(l2: TriggerEffect | None, r2: TriggerEffect | None, rumble: Rumble | None) -> None:
    report = build_output_report(l2, r2, rumble)
    assert len(report) == 48
    assert parse_output_report(report) == OutputReport(l2, r2, rumble)
    assert parse_output_report(report + bytes(16)) == OutputReport(l2, r2, rumble)


@given(st.binary(min_size=47, max_size=63).map(lambda rest: b"\x02" + rest))
@REPEATABLE
def test_random_output_reports_raise_only_the_documented_error(report: bytes) -> None:
    try:
        output = parse_output_report(report)
    except RemoteProtocolError:
        return
    assert (output.l2 is not None) == bool(report[1] & 0x08)
    assert (output.r2 is not None) == bool(report[1] & 0x04)


@pytest.mark.parametrize("code", [0xFC, 0xFD, 0xFE])
@pytest.mark.parametrize("place", [11, 22])
@pytest.mark.parametrize("flags", [0x00, 0x0C])
def test_a_debug_code_is_refused_wherever_it_stands(code: int, place: int, flags: int) -> None:
    report = bytearray(build_output_report(Off(), Off()))
    report[1] = flags
    report[place] = code
    with pytest.raises(RemoteProtocolError, match=f"0x{code:02x}"):
        parse_output_report(bytes(report))


def test_nothing_but_the_effect_values_can_choose_a_code() -> None:
    class Debug:
        zone_strengths = (0,) * 10

        def encode(self) -> bytes:
            return b"\xfc" + bytes(10)

    with pytest.raises(ValueError, match="l2 = "):
        build_output_report(Debug())  # type: ignore[arg-type]


def test_rumble_out_of_range() -> None:
    with pytest.raises(ValueError, match=r"left = 1.5"):
        Rumble(left=1.5)
    with pytest.raises(ValueError, match="right = nan"):
        Rumble(right=float("nan"))
