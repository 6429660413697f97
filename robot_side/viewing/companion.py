"""Process that renders pictures, started by `Cameras`: `python -m robot_side.viewing.companion FD [TROUBLE ...]`.

TROUBLE: fault of a rendering backend that was tried before, one argument for each.
"""

import importlib.util
import os
import select
import sys
from typing import TYPE_CHECKING

import msgspec
import numpy as np
import numpy.typing as npt

from common.clock import MonotonicClock
from common.companion.channel import Channel
from common.companion.process import companion_channel
from common.extras import installing
from common.protocol.codec import VIEW_MAXIMUM_BYTES
from common.protocol.view_messages import ViewName
from common.realtime.priority import lower_priority
from robot_side.drivers.mujoco.drawing.off_screen import BACKENDS, REMEDY, silenced, trouble_with
from robot_side.viewing.exchange import Order, Picture, Ready, Refusal, Setup, Undecodable, decode_to_companion, encode

if TYPE_CHECKING:
    from robot_side.viewing.h264 import H264
    from robot_side.viewing.rendering import Renderer

_NICENESS = 0
"""Niceness of this process: an ordinary program's, not the sides', which would put pictures before the browser"""

_MOST_BYTES = VIEW_MAXIMUM_BYTES - 4096
"""Largest encoded picture: a view message beside its header"""


def main() -> None:
    """Serve orders until the robot side's process has ended."""
    channel, troubles = companion_channel(sys.argv[1:])
    lower_priority(_NICENESS)
    if (trouble := trouble_with(BACKENDS[len(troubles)])) is not None:
        troubles.append(trouble)
        if len(troubles) < len(BACKENDS):
            again = [sys.executable, "-P", "-m", "robot_side.viewing.companion", sys.argv[1], *troubles]
            os.execv(sys.executable, again)  # noqa: S606
    try:
        import simplejpeg  # noqa: F401, PLC0415  # may be missing
    except ImportError as error:
        _refuse(channel, f"{error}; to install it: {installing('robot')}")
        return
    _serve(channel, f"{'; '.join(troubles)}; to mend it: {REMEDY}" if trouble is not None else "")


def _refuse(channel: Channel, reason: str) -> None:
    channel.send(encode(Refusal(reason)))
    while channel.waiting and not channel.ended:
        select.select([], [channel], [])
        channel.flush()


def _serve(channel: Channel, unrendered: str) -> None:
    """Serve orders. unrendered: why nothing can be rendered; empty if it can."""
    drawing: _Drawing | None = None
    clock = MonotonicClock()
    while not channel.ended:
        select.select([channel], [channel] if channel.waiting else [], [])
        for payload in channel.receive():
            began_s = clock.now()
            message = decode_to_companion(payload)
            if isinstance(message, Setup):
                if unrendered and not message.sent:
                    _refuse(channel, unrendered)
                    return
                drawing = _Drawing(message, unrendered)
                channel.send(encode(drawing.ready))
            elif drawing is not None:
                try:
                    source = drawing.source(message)
                except ValueError as error:
                    channel.send(encode(Undecodable(message.view, str(error))))
                    continue
                (height, width, _), content, number, whole = drawing.picture(message, source)
                if len(content) > _MOST_BYTES:
                    reason = f"it takes {len(content)} bytes encoded; valid: up to {_MOST_BYTES}"
                    channel.send(encode(Undecodable(message.view, reason)))
                    continue
                place = message.view, message.captured_s, width, height
                channel.send(encode(Picture(*place, content, clock.now() - began_s, number, whole)))


def _renderer_of(setup: Setup) -> "Renderer":
    from robot_side.viewing.rendering import Renderer  # noqa: PLC0415  # after the choice of a backend

    with silenced():
        return Renderer(setup)


class _Drawing:
    def __init__(self, setup: Setup, unrendered: str) -> None:
        self._renderer = None if unrendered else _renderer_of(setup)
        self._h264: dict[ViewName, H264] = {}
        ready = _tried() if setup.h264 else Ready(h264=False)
        self.ready = msgspec.structs.replace(ready, unrendered=unrendered)

    def source(self, order: Order) -> npt.NDArray[np.uint8]:
        """Return the picture to encode, RGB (height, width, 3); ValueError if there is none."""
        if order.sent is not None:
            from robot_side.viewing.sent_decoding import decode_sent  # noqa: PLC0415  # needs simplejpeg

            return decode_sent(order.sent)
        if self._renderer is None:
            raise ValueError(self.ready.unrendered)
        return self._renderer.picture(order.view, order.positions, order.mocap_poses)

    def picture(self, order: Order, picture: npt.NDArray[np.uint8]) -> tuple[tuple[int, ...], bytes, int, bool]:
        """Encode a picture; return its shape, bytes, number (0 for JPEG), and whether it can be shown by itself."""
        import simplejpeg  # noqa: PLC0415  # may be missing, which `main` reports

        if order.halved:
            from robot_side.viewing.halving import halved  # noqa: PLC0415  # seldom needed

            picture = halved(picture)
        if order.h264:
            from robot_side.viewing.h264 import H264  # noqa: PLC0415  # an extra

            # H.264 has one colour for two pixels by two: an odd last row or column is left out.
            picture = picture[: len(picture) & ~1, : picture.shape[1] & ~1]
            encoder = self._h264.setdefault(order.view, H264())
            content, whole = encoder.encode(picture, order.quality, whole=order.whole)
            return picture.shape, content, encoder.number, whole
        jpeg: bytes = simplejpeg.encode_jpeg(picture, order.quality, colorspace="RGB", colorsubsampling="420")
        return picture.shape, jpeg, 0, True


def _tried() -> Ready:
    """Try to encode H.264; this also imports PyAV before the first order."""
    if importlib.util.find_spec("av") is None:
        return Ready(h264=False)
    try:
        from robot_side.viewing.h264 import H264  # noqa: PLC0415  # an extra

        H264().encode(np.zeros((16, 16, 3), np.uint8), 75)
    except Exception as error:  # PyAV's errors or an ImportError; JPEG remains
        return Ready(h264=False, trouble=f"{type(error).__name__}: {error}")
    return Ready(h264=True)


if __name__ == "__main__":
    main()
