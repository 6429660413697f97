"""Pictures in H.264 (ITU-T H.264, by x264 through PyAV): a complete picture, then the changes from each to the next."""

from fractions import Fraction
from typing import Final

import av
import numpy as np
import numpy.typing as npt
from av.codec.context import CodecContext
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType
from av.video.reformatter import VideoReformatter

_ENDLESS: Final = 1 << 30
"""Number of pictures between whole ones that nobody ordered"""


class H264:
    """Encoder of one view. It uses only the previous picture, never a later one, so it delays no picture."""

    def __init__(self) -> None:
        """Raise av.FFmpegError or ValueError if this FFmpeg has no x264."""
        self._reformatter = VideoReformatter()
        self._kind: tuple[int, int, int] | None = None
        self._encoder: VideoCodecContext = CodecContext.create("libx264", "w")
        self.number = 0
        """Number of the newest picture; the first is 1"""

    def encode(self, rgb: npt.NDArray[np.uint8], quality: int, *, whole: bool = False) -> tuple[bytes, bool]:
        """Encode the next picture, RGB (height, width, 3) of even sizes; return bytes, and whether it needs no other.

        quality: on JPEG's scale, 1 to 100. whole: make a picture that needs no other; another quality or size also does
        so.
        """
        height, width, _ = rgb.shape
        if self._kind != (kind := (width, height, constant_rate_factor(quality))):
            self._kind, whole = kind, True
            self._encoder = self._opened(*kind)
        frame = self._reformatter.reformat(av.VideoFrame.from_ndarray(rgb, "rgb24"), format="yuvj420p")
        frame.pts, frame.pict_type = self.number, PictureType.I if whole else PictureType.NONE
        self.number += 1
        return b"".join(bytes(packet) for packet in self._encoder.encode(frame)), whole

    @staticmethod
    def _opened(width: int, height: int, factor: int) -> VideoCodecContext:
        encoder: VideoCodecContext = CodecContext.create("libx264", "w")
        encoder.width, encoder.height, encoder.pix_fmt = width, height, "yuvj420p"
        encoder.framerate = Fraction(30)
        encoder.time_base = Fraction(1, 30)
        encoder.gop_size, encoder.max_b_frames, encoder.thread_count = _ENDLESS, 0, 1
        encoder.options = {
            "preset": "superfast",
            "tune": "zerolatency",
            "crf": str(factor),
            "forced-idr": "1",
            # Without detection of cuts, which would make whole pictures that nobody ordered.
            "sc_threshold": "0",
        }
        return encoder


def constant_rate_factor(quality: int) -> int:
    """Return x264's constant rate factor that has at least the SSIM of JPEG's `quality`; 26 for a quality of 75.

    A smaller factor is better.
    """
    return round(45.0 - 0.25 * quality)
