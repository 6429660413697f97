"""Pictures of a recording that somebody else made: no other format is tried, no huge one is decoded."""

import io
import zlib
from collections.abc import Callable

import pytest
from PIL import EpsImagePlugin, Image

from feelahead.recordings.jpeg import decoded, size_of
from tests.helpers.refusal import refusal

EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\n%%EndComments\nshowpage\n%%EOF\n"


def saved(kind: str, size: tuple[int, int]) -> bytes:
    content = io.BytesIO()
    Image.new("RGB", size, (10, 200, 30)).save(content, kind)
    return content.getvalue()


def stated(width: int, height: int) -> bytes:
    """Return a JPEG that states another size than it has."""
    jpeg = saved("JPEG", (16, 16))
    place = jpeg.index(b"\xff\xc0") + 5
    return jpeg[:place] + height.to_bytes(2) + width.to_bytes(2) + jpeg[place + 4 :]


REFUSED = {
    "PostScript": (EPS, "cannot identify image file;"),
    "PNG": (saved("PNG", (16, 16)), "cannot identify image file;"),
    "nothing": (b"", "cannot identify image file;"),
    "noise": (zlib.compress(bytes(100)), "cannot identify image file;"),
    "wide": (stated(4097, 16), "it has 4097 x 16 pixels;"),
    "far too large": (stated(65500, 65500), "could be decompression bomb DOS attack"),
}


@pytest.mark.parametrize("read", [size_of, decoded])
@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_no_picture_of_a_view_is_refused_in_one_line(
    kind: str, read: Callable[[bytes], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(EpsImagePlugin, "Ghostscript", lambda *_, **__: pytest.fail("another program was started"))
    content, told = REFUSED[kind]
    said = refusal(read, content)
    assert told in said
    assert said.endswith("; valid: a JPEG of at most 4096 x 4096 pixels")


def test_a_picture_that_is_cut_off_is_refused_when_it_is_decoded() -> None:
    jpeg = saved("JPEG", (160, 160))
    assert size_of(jpeg[:-200]) == (160, 160)
    assert "truncated" in refusal(decoded, jpeg[:-200])
    assert decoded(jpeg).getpixel((0, 0)) == pytest.approx((10, 200, 30), abs=2)
