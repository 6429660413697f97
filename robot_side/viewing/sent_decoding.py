"""Decoding of pictures that a camera process has sent; only in the process that renders."""

from typing import Final

import numpy as np
import numpy.typing as npt
import simplejpeg

from robot_side.viewing.exchange import Sent

MOST_SCANS: Final = 32
"""Maximum number of a JPEG's scans; each makes the decoder go through the whole picture, however few bytes it has"""
_SCAN: Final = b"\xff\xda"
_LONGEST_REASON: Final = 200


def decode_sent(sent: Sent) -> npt.NDArray[np.uint8]:
    """Return a sent picture, RGB (height, width, 3); ValueError with the reason if it is none, or of another size."""
    shape = sent.height, sent.width, 3
    if sent.format == "rgb8":
        return np.frombuffer(sent.content, np.uint8).reshape(shape)
    if (scans := sent.content.count(_SCAN)) > MOST_SCANS:
        raise ValueError(f"the JPEG has {scans} scans; valid: up to {MOST_SCANS}")
    try:
        height, width, *_ = simplejpeg.decode_jpeg_header(sent.content)
    except Exception as error:
        raise _undecodable(error) from error
    if (height, width) != shape[:2]:
        raise ValueError(
            f"the JPEG has {width} x {height} pixels; valid: {sent.width} x {sent.height}, as its message says"
        )
    try:
        picture: npt.NDArray[np.uint8] = simplejpeg.decode_jpeg(sent.content, "RGB")
    except Exception as error:
        raise _undecodable(error) from error
    return picture


def _undecodable(error: Exception) -> ValueError:
    """Return an error for whatever the library says about bytes that are no JPEG."""
    return ValueError(f"the bytes are no whole JPEG: {str(error)[:_LONGEST_REASON]}; valid: JPEG in grey or colour")
