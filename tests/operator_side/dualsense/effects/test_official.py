"""Official trigger effects: exact bytes, and no byte string that is half understood."""

import itertools
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.effects.effect_codes import DEBUG_CODES
from operator_side.dualsense.effects.official import (
    EFFECT_LENGTH,
    Feedback,
    MultiPositionFeedback,
    MultiPositionVibration,
    Off,
    SlopeFeedback,
    TriggerEffect,
    Vibration,
    Weapon,
    decode_effect,
)

REPEATABLE = settings(derandomize=True, deadline=None)
STRENGTHS = st.tuples(*[st.integers(0, 8)] * 10)
SLOPES = st.tuples(st.integers(0, 8), st.integers(1, 9), st.integers(1, 8), st.integers(1, 8)).map(
    lambda drawn: SlopeFeedback(min(drawn[0], drawn[1] - 1), drawn[1], *drawn[2:])
)
WEAPONS = st.tuples(st.integers(2, 7), st.integers(3, 8), st.integers(0, 8)).map(
    lambda drawn: Weapon(min(drawn[0], drawn[1] - 1), drawn[1], drawn[2])
)
HERTZ = st.integers(0, 255)
EFFECTS: st.SearchStrategy[TriggerEffect] = st.one_of(
    st.just(Off()),
    st.builds(Feedback, st.integers(0, 9), st.integers(0, 8)),
    st.builds(MultiPositionFeedback, STRENGTHS),
    SLOPES,
    WEAPONS,
    st.builds(Vibration, st.integers(0, 9), st.integers(0, 8), HERTZ),
    st.builds(MultiPositionVibration, STRENGTHS, HERTZ),
)


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        (Off(), "05 00 00 00 00 00 00 00 00 00 00"),
        # The public test vector.
        (Feedback(3, 6), "21 f8 03 00 da b6 2d 00 00 00 00"),
        # Worked by hand: three bits a zone, strength less one, from bit 3 * zone.
        (Feedback(9, 8), "21 00 02 00 00 00 38 00 00 00 00"),
        (Feedback(0, 8), "21 ff 03 ff ff ff 3f 00 00 00 00"),
        (Feedback(0, 1), "21 ff 03 00 00 00 00 00 00 00 00"),
        (MultiPositionFeedback((1, 0, 0, 0, 0, 0, 0, 0, 0, 0)), "21 01 00 00 00 00 00 00 00 00 00"),
        (MultiPositionFeedback((2, 8, 0, 0, 0, 0, 0, 0, 0, 5)), "21 03 02 39 00 00 20 00 00 00 00"),
        # Zones 2 and 5: bits 0x04 and 0x20; strength 8 is 7.
        (Weapon(2, 5, 8), "25 24 00 07 00 00 00 00 00 00 00"),
        # Zones 7 and 8: bits 0x080 and 0x100.
        (Weapon(7, 8, 1), "25 80 01 00 00 00 00 00 00 00 00"),
        # Amplitude 1 packs as zeros, so that only the mask and the ninth parameter are left.
        (Vibration(0, 1, 40), "26 ff 03 00 00 00 00 00 00 28 00"),
        (Vibration(3, 6, 255), "26 f8 03 00 da b6 2d 00 00 ff 00"),
        (MultiPositionVibration((0, 0, 0, 4, 0, 0, 0, 0, 0, 8), 16), "26 08 02 00 06 00 38 00 00 10 00"),
    ],
)
def test_exact_bytes(effect: TriggerEffect, expected: str) -> None:
    assert effect.encode() == bytes.fromhex(expected)
    assert decode_effect(bytes.fromhex(expected)) == effect


@pytest.mark.parametrize(
    ("slope", "strengths"),
    [
        (SlopeFeedback(0, 9, 1, 8), (1, 2, 3, 3, 4, 5, 6, 6, 7, 8)),
        (SlopeFeedback(2, 6, 8, 4), (0, 0, 8, 7, 6, 5, 4, 4, 4, 4)),
        (SlopeFeedback(8, 9, 1, 8), (0, 0, 0, 0, 0, 0, 0, 0, 1, 8)),
        (SlopeFeedback(0, 2, 1, 4), (1, 2, 4, 4, 4, 4, 4, 4, 4, 4)),  # 2.5 goes to 2
        (SlopeFeedback(0, 1, 5, 5), (5, 5, 5, 5, 5, 5, 5, 5, 5, 5)),
    ],
)
def test_a_slope_is_the_multi_position_feedback_of_its_strengths(
    slope: SlopeFeedback, strengths: tuple[int, ...]
) -> None:
    assert slope.zone_strengths == strengths
    assert slope.encode() == MultiPositionFeedback(strengths).encode()


def test_every_slope_runs_from_start_to_end_and_never_turns() -> None:
    for start, end, first, last in itertools.product(range(9), range(1, 10), range(1, 9), range(1, 9)):
        if start >= end:
            continue
        strengths = SlopeFeedback(start, end, first, last).zone_strengths
        assert strengths[:start] == (0,) * start
        assert strengths[start] == first
        assert strengths[end:] == (last,) * (10 - end)
        assert list(strengths[start:]) == sorted(strengths[start:], reverse=first > last)


def test_what_each_holds_against_the_finger() -> None:
    assert Weapon(3, 6, 5).zone_strengths == (0, 0, 0, 5, 5, 5, 0, 0, 0, 0)
    assert Vibration(3, 6, 20).zone_strengths == (0,) * 10
    assert Vibration(3, 6, 20).zone_amplitudes == (0, 0, 0, 6, 6, 6, 6, 6, 6, 6)
    assert MultiPositionVibration((1,) * 10, 20).zone_strengths == (0,) * 10


@pytest.mark.parametrize(
    "effect",
    [
        Feedback(4, 0),
        MultiPositionFeedback((0,) * 10),
        Weapon(2, 3, 0),
        Vibration(4, 0, 20),
        Vibration(4, 8, 0),
        MultiPositionVibration((0,) * 10, 20),
        MultiPositionVibration((8,) * 10, 0),
    ],
)
def test_nothing_to_feel_is_off(effect: TriggerEffect) -> None:
    assert effect.encode() == Off().encode()
    assert decode_effect(effect.encode()) == Off()


@given(EFFECTS)
@REPEATABLE
def test_decoding_keeps_every_byte_and_zone(effect: TriggerEffect) -> None:
    encoded = effect.encode()
    assert len(encoded) == EFFECT_LENGTH
    assert encoded[0] not in DEBUG_CODES
    decoded = decode_effect(encoded)
    assert decoded.encode() == encoded
    assert decoded.zone_strengths == effect.zone_strengths


@given(WEAPONS.filter(lambda weapon: weapon.strength > 0))
@REPEATABLE
def test_a_weapon_is_decoded_as_it_was(weapon: Weapon) -> None:
    assert decode_effect(weapon.encode()) == weapon


@given(st.integers(1, 8), st.integers(0, 9), st.integers(1, 255))
@REPEATABLE
def test_one_step_decodes_to_the_simplest_whoever_made_it(strength: int, position: int, hertz: int) -> None:
    profile = (0,) * position + (strength,) * (10 - position)
    assert decode_effect(MultiPositionFeedback(profile).encode()) == Feedback(position, strength)
    assert decode_effect(MultiPositionVibration(profile, hertz).encode()) == Vibration(position, strength, hertz)


@given(
    st.one_of(
        st.binary(max_size=13),
        st.tuples(st.sampled_from([0x05, 0x21, 0x25, 0x26]), st.binary(min_size=10, max_size=10)).map(
            lambda drawn: bytes([drawn[0]]) + drawn[1]
        ),
        EFFECTS.map(lambda effect: effect.encode()).flatmap(
            lambda good: st.tuples(st.integers(0, 87), st.just(good)).map(
                lambda pair: (int.from_bytes(pair[1], "big") ^ 1 << pair[0]).to_bytes(11, "big")
            )
        ),
    )
)
@REPEATABLE
def test_any_bytes_decode_whole_or_not_at_all(encoded: bytes) -> None:
    try:
        effect = decode_effect(encoded)
    except RemoteProtocolError:
        return
    assert effect.encode() == encoded


def test_only_four_codes_decode() -> None:
    """Whatever the ten parameters: tried with those of a good value of each code."""
    parameters = [effect.encode()[1:] for effect in (Off(), Feedback(0, 1), Weapon(2, 3, 1), Vibration(0, 1, 1))]
    decoded = set()
    for code, rest in itertools.product(range(256), parameters):
        try:
            decode_effect(bytes([code]) + rest)
        except RemoteProtocolError:
            continue
        decoded.add(code)
    assert decoded == {0x05, 0x21, 0x25, 0x26}


@pytest.mark.parametrize(
    ("encoded", "message"),
    [
        ("", "0 bytes"),
        ("05", "1 bytes"),
        ("21 f8 03 00 da b6 2d 00 00 00 00 00", "12 bytes"),
        ("05 00 00 00 00 00 00 00 00 00 01", "stray"),
        ("21 00 00 00 00 00 00 00 00 00 00", "stray"),  # feedback in no zone
        ("21 00 04 00 00 00 00 00 00 00 00", "stray"),  # an eleventh zone
        ("21 01 00 08 00 00 00 00 00 00 00", "stray"),  # a strength outside the mask
        ("21 01 00 00 00 00 00 00 00 10 00", "stray"),  # a frequency where none belongs
        ("25 04 00 00 00 00 00 00 00 00 00", "stray"),  # a weapon with one end
        ("25 1c 00 00 00 00 00 00 00 00 00", "stray"),  # with three
        ("25 03 00 00 00 00 00 00 00 00 00", "stray"),  # before zone 2
        ("25 04 02 00 00 00 00 00 00 00 00", "stray"),  # up to zone 9
        ("25 24 00 08 00 00 00 00 00 00 00", "stray"),  # a strength of 9
        ("26 ff 03 00 00 00 00 00 00 00 00", "stray"),  # at 0 Hz
        ("22 24 00 09 00 00 00 00 00 00 00", "0x22"),  # unofficial
        ("01 10 80 00 00 00 00 00 00 00 00", "0x01"),
        ("fc 00 00 00 00 00 00 00 00 00 00", "0xfc"),
        ("fe 00 00 00 00 00 00 00 00 00 00", "0xfe"),
    ],
)
def test_refused_bytes_are_named(encoded: str, message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        decode_effect(bytes.fromhex(encoded))


@pytest.mark.parametrize(
    ("effect", "arguments", "message"),
    [
        (Feedback, (10, 1), "position = 10"),
        (Feedback, (0, 9), "strength = 9"),
        (Feedback, (0, -1), "strength = -1"),
        (Feedback, (0.5, 1), "position = 0.5"),
        (MultiPositionFeedback, ((1,) * 9,), r"strengths = .*; valid: a tuple of 10 integers from 0 to 8"),
        (MultiPositionFeedback, ([1] * 10,), r"strengths = \[1, .*; valid: a tuple of 10"),
        (MultiPositionFeedback, ((1,) * 9 + (9,),), r"strengths\[9\] = 9"),
        (MultiPositionFeedback, ((0.5,) + (0,) * 9,), r"strengths\[0\] = 0.5"),
        (SlopeFeedback, (9, 9, 1, 8), "start = 9"),
        (SlopeFeedback, (3, 3, 1, 8), "end = 3; valid: an integer from 4 to 9"),
        (SlopeFeedback, (0, 10, 1, 8), "end = 10"),
        (SlopeFeedback, (0, 9, 0, 8), "start_strength = 0"),
        (SlopeFeedback, (0, 9, 1, 9), "end_strength = 9"),
        (Weapon, (1, 5, 1), "start = 1; valid: an integer from 2 to 7"),
        (Weapon, (8, 9, 1), "start = 8"),
        (Weapon, (5, 5, 1), "end = 5; valid: an integer from 6 to 8"),
        (Weapon, (5, 9, 1), "end = 9"),
        (Weapon, (5, 6, 9), "strength = 9"),
        (Vibration, (10, 1, 1), "position = 10"),
        (Vibration, (0, 9, 1), "amplitude = 9"),
        (Vibration, (0, 1, 256), "frequency_hz = 256"),
        (MultiPositionVibration, ((0,) * 11, 1), r"amplitudes = .*; valid: a tuple of 10"),
        (MultiPositionVibration, ([0] * 10, 1), r"amplitudes = \[0, .*; valid: a tuple of 10"),
        (MultiPositionVibration, ((0,) * 10, -1), "frequency_hz = -1"),
    ],
)
def test_arguments_out_of_range(effect: Any, arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        effect(*arguments)
