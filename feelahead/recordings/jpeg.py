"""Decoding of a recording's pictures, anybody's bytes: JPEG only, with at most a view's pixels."""

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from common.errors import ConfigurationError

_LARGEST: Final = 4096
"""Largest width and height of a view's pictures, in pixels"""


def size_of(jpeg: bytes) -> tuple[int, int]:
    """Return the (width, height) of a picture, which is not decoded. ConfigurationError for an invalid one."""
    with _as_one_line():
        found: tuple[int, int] = _opened(jpeg).size
        return found


def decoded(jpeg: bytes) -> Any:
    """Return a picture as an image of Pillow, of red, green and blue. ConfigurationError for an invalid one."""
    with _as_one_line():
        return _opened(jpeg).convert("RGB")


def _opened(jpeg: bytes) -> Any:
    from PIL import Image  # noqa: PLC0415

    # Without a format Pillow tries all that it knows, and runs Ghostscript for one of them.
    image = Image.open(io.BytesIO(jpeg), formats=["JPEG"])
    if max(image.size) > _LARGEST:
        raise ValueError(f"it has {image.width} x {image.height} pixels")
    return image


@contextmanager
def _as_one_line() -> Iterator[None]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of pictures that are far too large
            yield
    except Exception as error:  # Pillow has no common class of errors
        why = f"{error}".partition(" <")[0]
        raise ConfigurationError(
            f"a picture of the recording cannot be read: {why}; valid: a JPEG of at most {_LARGEST} x {_LARGEST} pixels"
        ) from error
