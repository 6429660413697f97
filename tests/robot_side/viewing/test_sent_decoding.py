"""Decoding of pictures that a camera process has sent, also of hostile ones."""

import contextlib

import numpy as np
import pytest
import simplejpeg
from hypothesis import given
from hypothesis import strategies as st

from robot_side.viewing.exchange import Sent
from robot_side.viewing.sent_decoding import MOST_SCANS, decode_sent

RAMP = np.ascontiguousarray(np.broadcast_to(np.linspace(0, 255, 64, dtype=np.uint8)[None, :, None], (48, 64, 3)))
JPEG: bytes = simplejpeg.encode_jpeg(RAMP, 90)


def test_both_formats_show_the_same_picture() -> None:
    raw = decode_sent(Sent(64, 48, "rgb8", RAMP.tobytes()))
    np.testing.assert_array_equal(raw, RAMP)
    decoded = decode_sent(Sent(64, 48, "jpeg", JPEG))
    assert decoded.shape == RAMP.shape
    assert np.abs(decoded.astype(float) - RAMP).max() < 16.0


def test_a_grey_jpeg_is_shown_in_grey() -> None:
    grey = simplejpeg.encode_jpeg(RAMP[:, :, :1].copy(), 90, colorspace="GRAY", colorsubsampling="Gray")
    assert decode_sent(Sent(64, 48, "jpeg", grey)).shape == (48, 64, 3)


def claiming(width: int, height: int) -> bytes:
    """Return the JPEG with another size in its header."""
    at = JPEG.index(b"\xff\xc0") + 5
    return JPEG[:at] + height.to_bytes(2) + width.to_bytes(2) + JPEG[at + 4 :]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (JPEG[: len(JPEG) // 2], "the bytes are no whole JPEG: .*; valid: JPEG in grey or colour"),
        (JPEG[:20], "the bytes are no whole JPEG"),
        (b"\xff\xd8\xff" + bytes(1000), "the bytes are no whole JPEG"),
        (claiming(65_500, 65_500), "the JPEG has 65500 x 65500 pixels; valid: 64 x 48, as its message says"),
        (claiming(0, 0), "no whole JPEG|pixels"),
        (JPEG + b"\xff\xda" * MOST_SCANS, f"the JPEG has {MOST_SCANS + 1} scans; valid: up to {MOST_SCANS}"),
    ],
)
def test_what_is_not_what_it_claims_to_be_is_refused(content: bytes, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        decode_sent(Sent(64, 48, "jpeg", content))


@given(st.lists(st.tuples(st.integers(3, len(JPEG) - 1), st.integers(0, 255)), min_size=1, max_size=8))
def test_spoilt_bytes_are_decoded_or_refused_and_never_anything_else(changes: list[tuple[int, int]]) -> None:
    spoilt = bytearray(JPEG)
    for place, value in changes:
        spoilt[place] = value
    with contextlib.suppress(ValueError):
        assert decode_sent(Sent(64, 48, "jpeg", bytes(spoilt))).shape == (48, 64, 3)
