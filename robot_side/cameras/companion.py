"""The process that renders: `python -m robot_side.cameras.companion FD [TROUBLE ...]`, started by `Cameras`.

TROUBLE: what was wrong with the ways to render that were tried before, one each.
"""

import contextlib
import os
import select
import sys
from typing import TYPE_CHECKING

from common.clock import MonotonicClock
from common.companion.channel import Channel
from common.companion.process import companion_channel
from robot_side.cameras.exchange import Order, Picture, Refusal, Setup, decode_to_companion, encode
from robot_side.cameras.off_screen import BACKENDS, REMEDY, silenced, trouble_with

if TYPE_CHECKING:
    from robot_side.cameras.rendering import Renderer

_LATER = 5
"""By so much niceness behind the process that ticks."""


def main() -> None:
    """Serve until the robot side is gone."""
    channel, troubles = companion_channel(sys.argv[1:])
    _step_back()
    if (trouble := trouble_with(BACKENDS[len(troubles)])) is not None:
        troubles.append(trouble)
        if len(troubles) < len(BACKENDS):
            again = [sys.executable, "-P", "-m", "robot_side.cameras.companion", sys.argv[1], *troubles]
            os.execv(sys.executable, again)  # noqa: S606
        _refuse(channel, f"{'; '.join(troubles)}; to mend it: {REMEDY}")
        return
    try:
        import simplejpeg  # noqa: F401, PLC0415  # may be missing
    except ImportError as error:
        _refuse(channel, f"{error}; to mend it: pip install 'feelahead[robot]'")
        return
    _serve(channel)


def _step_back() -> None:
    """What the robot side's own priority and real-time scheduling are for is not this."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    with contextlib.suppress(OSError):
        os.nice(_LATER)


def _refuse(channel: Channel, reason: str) -> None:
    channel.send(encode(Refusal(reason)))
    while channel.waiting and not channel.ended:
        select.select([], [channel], [])
        channel.flush()


def _serve(channel: Channel) -> None:
    drawing: tuple[Renderer, int] | None = None
    clock = MonotonicClock()
    while not channel.ended:
        select.select([channel], [channel] if channel.waiting else [], [])
        for payload in channel.receive():
            began_s = clock.now()
            message = decode_to_companion(payload)
            if isinstance(message, Setup):
                drawing = _renderer_of(message), message.quality
            elif drawing is not None:
                jpeg = _render(*drawing, message)
                channel.send(encode(Picture(message.view, message.captured_s, jpeg, clock.now() - began_s)))


def _renderer_of(setup: Setup) -> "Renderer":
    from robot_side.cameras.rendering import Renderer  # noqa: PLC0415  # after the choice of a way to render

    with silenced():
        return Renderer(setup)


def _render(renderer: "Renderer", quality: int, order: Order) -> bytes:
    import simplejpeg  # noqa: PLC0415  # may be missing, which `main` says

    picture = renderer.picture(order.view, order.positions, order.mocap_poses)
    jpeg: bytes = simplejpeg.encode_jpeg(picture, quality, colorspace="RGB", colorsubsampling="420")
    return jpeg


if __name__ == "__main__":
    main()
