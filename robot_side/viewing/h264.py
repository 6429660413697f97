"""Pictures in H.264 (ITU-T H.264, by x264 through PyAV): a whole one, then the changes from one to the next."""

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


class H264:
    """Encoder of one view. It uses only the picture before, no later one, so that it adds no delay in pictures."""

    def __init__(self, preset: str = "superfast", refresh: int = _ENDLESS) -> None:
        """preset: of x264. refresh: pictures in which a column of intra refresh sweeps over the view.

        av.FFmpegError, ValueError: if this FFmpeg has no x264.
        """
        self._preset, self._refresh = preset, refresh
        self._reformatter = VideoReformatter()
        self._kind: tuple[int, int, int] | None = None
        self._encoder: VideoCodecContext = CodecContext.create("libx264", "w")
        self.number = 0
        """Number of the newest picture, from 1"""

    def encode(self, rgb: npt.NDArray[np.uint8], quality: int, *, whole: bool = False) -> tuple[bytes, bool]:
        """Encode the next picture, RGB (height, width, 3), even sizes; return the bytes, and whether it is a whole one.

        quality: as of JPEG, 1 to 100. Another quality or size makes this picture a whole one.
        """
        height, width, _ = rgb.shape
        if self._kind != (kind := (width, height, constant_rate_factor(quality))):
            self._kind, whole = kind, True
            self._encoder = self._opened(*kind)
        frame = self._reformatter.reformat(av.VideoFrame.from_ndarray(rgb, "rgb24"), format="yuvj420p")
        frame.pts, frame.pict_type = self.number, PictureType.I if whole else PictureType.NONE
        self.number += 1
        return b"".join(bytes(packet) for packet in self._encoder.encode(frame)), whole

    def _opened(self, width: int, height: int, factor: int) -> VideoCodecContext:
        encoder: VideoCodecContext = CodecContext.create("libx264", "w")
        encoder.width, encoder.height, encoder.pix_fmt = width, height, "yuvj420p"
        encoder.framerate = Fraction(30)
        encoder.time_base = Fraction(1, 30)
        encoder.gop_size, encoder.max_b_frames, encoder.thread_count = self._refresh, 0, 1
        encoder.options = {
            "preset": self._preset,
            "tune": "zerolatency",
            "crf": str(factor),
            "forced-idr": "1",
            "intra-refresh": str(int(self._refresh < _ENDLESS)),
            # Without detection of cuts, which would make whole pictures unasked.
            "sc_threshold": "0",
        }
        return encoder


def constant_rate_factor(quality: int) -> int:
    """Return x264's constant rate factor with at least the SSIM of JPEG's `quality`: 26 for 75; less is better."""
    return round(45.0 - 0.25 * quality)
