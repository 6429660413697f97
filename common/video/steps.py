"""Conversion of the views' H.264 pictures (VideoStep) to JPEG (VideoFrame), for pages and files."""

from fractions import Fraction
from typing import Final

import av
from av.codec.context import CodecContext, Flags
from av.video.codeccontext import VideoCodecContext

from common.protocol.view_messages import VIEW_NAMES, VideoFrame, VideoStep, ViewName

_ALIGNED: Final = 64
"""Pixels to whole multiples of which FFmpeg widens pictures at most"""
_UNIT: Final = b"\0\0\1"
"""Beginning of each unit of an access unit"""
_MOST_UNITS: Final = 64
"""Maximum number of units of a picture; x264 makes one for each slice, and a few more. FFmpeg takes 4 kB for each, even
for an empty one."""
_JPEG_SCALE: Final = 2
"""Quantiser scale of FFmpeg's MJPEG, 1 (best) to 31; 2 is about JPEG quality 90. These pictures never cross the
link."""


class Steps:
    """Converter of the VideoSteps of all views, which it takes in order of arrival."""

    def __init__(self) -> None:
        """Raises av.FFmpegError or ValueError if the installed FFmpeg has no H.264 decoder or no JPEG encoder."""
        _decoder(16, 16)
        _jpeg_encoder(16, 16)
        self._views: dict[ViewName, _View] = {}

    @property
    def lacks(self) -> tuple[int, int]:
        """For each view, number of the newest picture if it could not be shown, else 0; sent as `Watch.lacks`."""
        first, second = (view.lacks if (view := self._views.get(name)) else 0 for name in VIEW_NAMES)
        return first, second

    def decode(self, step: VideoStep) -> VideoFrame | None:
        """Return the picture as JPEG; None if the previous picture is missing, or the bytes are invalid."""
        jpeg = self._views.setdefault(step.view, _View()).decode(step)
        if jpeg is None:
            return None
        return VideoFrame(step.header, step.view, step.captured_s, step.width, step.height, jpeg)


class _View:
    def __init__(self) -> None:
        self.lacks = 0
        self._number = 0
        self._decoder: VideoCodecContext | None = None
        self._encoder: VideoCodecContext | None = None

    def decode(self, step: VideoStep) -> bytes | None:
        if step.whole:
            self._decoder = _decoder(step.width, step.height)
        elif step.number != self._number + 1:
            self._decoder = None
        self._number = step.number
        few = step.h264.count(_UNIT) <= _MOST_UNITS
        jpeg = self._jpeg(self._decoder, step) if self._decoder is not None and few else None
        if jpeg is None:
            self._decoder = None
        self.lacks = step.number if jpeg is None else 0
        return jpeg

    def _jpeg(self, decoder: VideoCodecContext, step: VideoStep) -> bytes | None:
        size = step.width, step.height
        try:
            [picture] = decoder.decode(av.Packet(step.h264))
            if (picture.width, picture.height, picture.format.name) != (*size, "yuvj420p"):
                return None
            if self._encoder is None or (self._encoder.width, self._encoder.height) != size:
                self._encoder = _jpeg_encoder(*size)
            [packet] = self._encoder.encode(picture)
        except (av.FFmpegError, ValueError):
            return None
        return bytes(packet)


def _decoder(width: int, height: int) -> VideoCodecContext:
    """Return a decoder that has no room for pictures larger than this."""
    columns, rows = -(-width // _ALIGNED), -(-height // _ALIGNED)
    decoder = CodecContext.create("h264", "r")
    decoder.thread_count = 1
    decoder.flags |= Flags.low_delay
    decoder.options = {"max_pixels": str(columns * rows * _ALIGNED**2)}
    return decoder


def _jpeg_encoder(width: int, height: int) -> VideoCodecContext:
    encoder = CodecContext.create("mjpeg", "w")
    encoder.width, encoder.height, encoder.pix_fmt = width, height, "yuvj420p"
    encoder.thread_count = 1
    encoder.framerate = Fraction(30)
    encoder.qmin = encoder.qmax = _JPEG_SCALE
    encoder.options = {"huffman": "default"}
    return encoder
