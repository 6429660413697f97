"""Trigger effects: exact bytes, and no byte string that is half understood."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.effects import (
    DEBUG_CODES,
    EFFECT_LENGTH,
    Feedback,
    MultiPositionFeedback,
    Off,
    TriggerEffect,
    decode_effect,
)

REPEATABLE = settings(derandomize=True, deadline=None)
STRENGTHS = st.tuples(*[st.integers(0, 8)] * 10)
EFFECTS = st.one_of(
    st.just(Off()),
    st.builds(Feedback, st.integers(0, 9), st.integers(0, 8)),
    st.builds(MultiPositionFeedback, STRENGTHS),
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
    ],
)
def test_exact_bytes(effect: TriggerEffect, expected: str) -> None:
    assert effect.encode() == bytes.fromhex(expected)
    assert decode_effect(bytes.fromhex(expected)) == effect


@pytest.mark.parametrize("effect", [Feedback(4, 0), MultiPositionFeedback((0,) * 10)])
def test_nothing_to_resist_is_off(effect: TriggerEffect) -> None:
    assert effect.encode() == Off().encode()
    assert decode_effect(effect.encode()) == Off()


@given(EFFECTS)
@REPEATABLE
def test_decoding_keeps_every_zone(effect: TriggerEffect) -> None:
    encoded = effect.encode()
    assert len(encoded) == EFFECT_LENGTH
    assert encoded[0] not in DEBUG_CODES
    decoded = decode_effect(encoded)
    assert decoded.zone_strengths == effect.zone_strengths
    assert decoded.encode() == encoded


@given(st.integers(1, 8), st.integers(0, 9))
@REPEATABLE
def test_one_step_decodes_to_feedback_whoever_made_it(strength: int, position: int) -> None:
    made = MultiPositionFeedback((0,) * position + (strength,) * (10 - position))
    assert decode_effect(made.encode()) == Feedback(position, strength)


@given(
    st.one_of(
        st.binary(max_size=13),
        st.binary(min_size=10, max_size=10).map(lambda rest: b"\x21" + rest),
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
        ("26 ff 03 00 00 00 00 00 00 10 00", "0x26"),
        ("fc 00 00 00 00 00 00 00 00 00 00", "0xfc"),
        ("fe 00 00 00 00 00 00 00 00 00 00", "0xfe"),
    ],
)
def test_refused_bytes_are_named(encoded: str, message: str) -> None:
    with pytest.raises(RemoteProtocolError, match=message):
        decode_effect(bytes.fromhex(encoded))


def test_arguments_out_of_range() -> None:
    with pytest.raises(ValueError, match="position = 10"):
        Feedback(10, 1)
    with pytest.raises(ValueError, match="strength = 9"):
        Feedback(0, 9)
    with pytest.raises(ValueError, match="strength = -1"):
        Feedback(0, -1)
    with pytest.raises(ValueError, match="9 values"):
        MultiPositionFeedback((1,) * 9)
    with pytest.raises(ValueError, match=r"strengths\[9\] = 9"):
        MultiPositionFeedback((1,) * 9 + (9,))
    with pytest.raises(ValueError, match=r"strengths\[0\] = 0.5"):
        MultiPositionFeedback((0.5,) + (0,) * 9)  # type: ignore[arg-type]
