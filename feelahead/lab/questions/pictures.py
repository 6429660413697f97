"""How many bytes, how much time and delay does a picture take as JPEG, H.264 and AV1, at equal quality?

feelahead bench pictures --quick
"""

import functools
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
import numpy.typing as npt
import simplejpeg
from msgspec import Meta
from rich.console import RenderableType
from scipy.ndimage import gaussian_filter

from common.arrays import FloatArray
from common.protocol.view_messages import VIEW_NAMES
from common.recording.packages import require_packages
from feelahead.lab.shown import shown
from feelahead.lab.sweep import Question, Sweep
from feelahead.lab.table import Row, Table
from robot_side.viewing.off_screen import BACKENDS, choose

if TYPE_CHECKING:
    from robot_side.viewing.h264 import H264

Image = npt.NDArray[np.uint8]
Encode = Callable[[Image], bytes]
Decode = Callable[[bytes], "Image | None"]
_JPEG: Final = (75, 50, 30)
_STEPS: Final = (90, 75, 60, 45, 30, 15)
"""Qualities of H.264, by which its bytes at JPEG's quality are found"""
_AV1: Final = (30, 40, 50, 58)
"""Constant rate factors of SVT-AV1"""
_REFRESHED: Final = "H.264 superfast, refresh 1 s, 75"
_LOOK: Final = 7
"""The quality of each seventh picture is worked out."""
_REST_S: Final = 3.0
"""The demo's person has armed by then."""
_SAME: Final = 0.99
"""SSIM from which on a picture counts as mended"""
_WRONG: Final = "wrong_after_a_loss", "wrong_for_a_newcomer"
_SIZES: Final = "bytes", "p95_bytes", "first_bytes", "kbit_s"
_COLUMNS: Final = ("method", *_SIZES, "encode_ms", "decode_ms", "late", "ssim", *_WRONG)


@dataclass(frozen=True)
class PicturesSweep(Sweep):
    """The demo's two views while its person drives the arm: each picture by every codec, in turns.

    Quality is SSIM (Wang 2004) of the brightness. late: the share of pictures that a codec holds back. wrong:
    pictures until SSIM is 0.99, after one is lost and for a newcomer.
    """

    seconds: Annotated[float, Meta(ge=2.0, le=60.0)] = 10.0
    """Length of the motion. --quick: 3 s of one size and rate."""


@dataclass(frozen=True)
class Case:
    """Both views in one size, at one rate."""

    width: int
    rate_hz: int
    seconds: float


def cells(settings: PicturesSweep) -> Iterator[Case]:
    """Lay out two sizes and two rates."""
    require_packages("bench pictures", "av", extra="robot,operator,video")
    sizes = ((640, 30), (320, 30), (640, 10))
    for width, rate_hz in sizes[:1] if settings.quick else sizes:
        yield Case(width, rate_hz, 3.0 if settings.quick else settings.seconds)


def run(cell: Case, seed: int) -> Iterator[Row]:
    """Give a row for each method and setting, both views together, and what a lost picture does."""
    found: dict[str, list[FloatArray]] = {}
    firsts: dict[str, int] = {}
    mended = []
    for pictures in _pictures(cell, seed):
        methods = _methods(cell)
        kept: list[bytes] = []
        for number, picture in enumerate(pictures):
            for method, (encode, decode) in methods.items():
                begun_s = time.process_time()
                data = encode(picture)
                encoded_s = time.process_time()
                seen = decode(data)
                spent_s = encoded_s - begun_s, time.process_time() - encoded_s
                quality = math.nan if seen is None or number % _LOOK else ssim(picture, seen)
                firsts.setdefault(method, len(data))
                if number:  # the first one opens codecs, and is a whole one
                    row = np.array([len(data), *spent_s, seen is None, quality])
                    found.setdefault(method, []).append(row)
                if method == _REFRESHED:
                    kept.append(data)
        mended.append(_mending(kept))
    for method, rows in found.items():
        size, encode_s, decode_s, late, quality = np.array(rows).T
        yield {
            "method": method,
            "bytes": size.mean(),
            "p95_bytes": np.quantile(size, 0.95),
            "first_bytes": firsts[method],
            "kbit_s": 8e-3 * size.mean() * cell.rate_hz,
            "encode_ms": 1e3 * encode_s.mean(),
            "decode_ms": 1e3 * decode_s.mean(),
            "late": late.mean(),
            "ssim": np.nanmean(quality),
        } | (dict(zip(_WRONG, np.max(mended, axis=0).tolist(), strict=True)) if method == _REFRESHED else {})


def _pictures(cell: Case, seed: int) -> Iterator[Iterator[Image]]:
    """Render both views, one after the other, of the same motion."""
    choose(BACKENDS[0])
    from feelahead.both_sides.loopback import Loopback, LoopbackSettings, robot_parts  # noqa: PLC0415  # after the choice
    from robot_side.drivers.mujoco.scene import load_scene  # noqa: PLC0415
    from robot_side.settings import RobotSettings  # noqa: PLC0415
    from robot_side.viewing.exchange import Setup  # noqa: PLC0415
    from robot_side.viewing.pictures import saved_model  # noqa: PLC0415
    from robot_side.viewing.rendering import Renderer  # noqa: PLC0415
    from robot_side.viewing.viewpoints import viewpoints  # noqa: PLC0415

    scene = load_scene(name="table", seed=seed)
    setup = Setup(saved_model(scene), cell.width, cell.width * 3 // 4, viewpoints(scene))
    loopback = Loopback(LoopbackSettings(), parts=robot_parts(RobotSettings(), scene))
    states = []
    for number in range(round(cell.seconds * cell.rate_hz)):
        loopback.run_until(_REST_S + number / cell.rate_hz)
        states.append(scene.data.qpos.tobytes())
    renderer = Renderer(setup)
    for view in VIEW_NAMES:
        yield (renderer.picture(view, state).copy() for state in states)


def _methods(cell: Case) -> dict[str, tuple[Encode, Decode]]:
    from robot_side.viewing.h264 import H264  # noqa: PLC0415  # an extra

    methods: dict[str, tuple[Encode, Decode]] = {}
    for quality in _JPEG:
        jpeg = functools.partial(simplejpeg.encode_jpeg, quality=quality, colorspace="RGB", colorsubsampling="420")
        methods[f"JPEG {quality}"] = jpeg, simplejpeg.decode_jpeg
    for quality in _STEPS:
        methods[f"H.264 superfast, {quality}"] = _first_of(H264(), quality), _decoded_by("h264")
    methods["H.264 ultrafast, 75"] = _first_of(H264("ultrafast"), 75), _decoded_by("h264")
    methods[_REFRESHED] = _first_of(H264(refresh=cell.rate_hz), 75), _decoded_by("h264")
    for factor in _AV1:
        methods[f"AV1 preset 12, {factor}"] = _av1(cell, factor), _decoded_by("libdav1d")
    return methods


def _first_of(encoder: "H264", quality: int) -> Encode:
    return lambda picture: encoder.encode(picture, quality)[0]


def _av1(cell: Case, factor: int) -> Encode:
    import av  # noqa: PLC0415  # an extra

    encoder: Any = av.CodecContext.create("libsvtav1", "w")
    encoder.width, encoder.height, encoder.pix_fmt = cell.width, cell.width * 3 // 4, "yuv420p"
    encoder.time_base, encoder.framerate = Fraction(1, cell.rate_hz), Fraction(cell.rate_hz)
    encoder.gop_size = 1 << 20
    fast = "pred-struct=1:lookahead=0:lp=1:rtc=1"
    encoder.options = {"preset": "12", "crf": str(factor), "svtav1-params": fast}
    reformatter = av.video.reformatter.VideoReformatter()

    def encode(picture: Image) -> bytes:
        frame = reformatter.reformat(av.VideoFrame.from_ndarray(picture, "rgb24"), format="yuv420p")
        return b"".join(bytes(packet) for packet in encoder.encode(frame))

    return encode


def _decoded_by(name: str) -> Decode:
    import av  # noqa: PLC0415  # an extra

    decoder: Any = av.CodecContext.create(name, "r")
    decoder.thread_count = 1
    decoder.flags |= av.codec.context.Flags.low_delay

    def decode(data: bytes) -> "Image | None":
        frames = decoder.decode(av.Packet(data)) if data else []
        return np.asarray(frames[-1].to_ndarray(format="rgb24"), np.uint8) if frames else None

    return decode


def _mending(steps: list[bytes]) -> tuple[int, int]:
    """Count the pictures that are wrong after the tenth is lost, and for one who begins with the eleventh."""
    whole, holed, late = _decoded_by("h264"), _decoded_by("h264"), _decoded_by("h264")
    wrong = [0, 0]
    for number, step in enumerate(steps):
        right = whole(step)
        for index, (decode, first) in enumerate(((holed, 0), (late, 10))):
            if number != 9 and number >= first:
                try:
                    seen = decode(step)
                except ValueError:
                    seen = None
                if right is not None and (seen is None or ssim(right, seen) < _SAME):
                    wrong[index] = number - 9
    return wrong[0], wrong[1]


def ssim(picture: Image, other: Image) -> float:
    """Structural similarity of two pictures' brightness (Wang 2004: a Gaussian of 1.5 pixels); 1 for the same."""
    blur = functools.partial(gaussian_filter, sigma=1.5, truncate=3.5)
    a, b = (one.astype(np.float32) @ np.array([0.299, 0.587, 0.114], np.float32) for one in (picture, other))
    mean_a, mean_b = blur(a), blur(b)
    spread = blur(a * a) - mean_a**2 + blur(b * b) - mean_b**2
    alike = (2 * mean_a * mean_b + 6.5025) * (2 * (blur(a * b) - mean_a * mean_b) + 58.5225)
    return float(np.mean(alike / ((mean_a**2 + mean_b**2 + 6.5025) * (spread + 58.5225))))


def show(_: PicturesSweep, table: Table) -> Iterator[RenderableType]:
    """Show every method, and the bytes of each codec at JPEG's quality."""
    for (width, rate_hz), rows in table.groups("width", "rate_hz"):
        of = f"{width} x {width * 3 // 4}, {rate_hz} Hz"
        yield shown(f"{of}: a picture", _COLUMNS, rows.lines(*_COLUMNS))
        equal = []
        for quality in _JPEG:
            [jpeg] = rows.where(method=f"JPEG {quality}")
            others = (_bytes_at(jpeg["ssim"], rows, f"{codec}, ") for codec in ("H.264 superfast", "AV1 preset 12"))
            equal.append((f"JPEG {quality}", jpeg["ssim"], jpeg["bytes"], *others))
        yield shown(f"{of}: bytes at equal quality", ("", "ssim", "JPEG", "H.264", "AV1"), equal)


def _bytes_at(quality: float, rows: Table, codec: str) -> str:
    """Interpolate bytes (as their logarithm) between two settings of a codec; without reaching beyond them."""
    known = sorted((row["ssim"], row["bytes"]) for row in rows if row["method"].removeprefix(codec).isdigit())
    values, sizes = np.array(known).T
    size = np.exp(np.interp(quality, values, np.log(sizes)))
    return f"{'< ' if quality < values[0] else ''}{size:.0f}"


QUESTION = Question("bench pictures", PicturesSweep, cells, run, show, timed=True)
