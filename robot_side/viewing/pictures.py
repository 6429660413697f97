"""Robot side's end of rendering: it orders pictures from a companion process and takes them, and never waits."""

import math
from collections.abc import Callable, Collection
from typing import Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.companion.channel import MESSAGE_LIMIT_BYTES
from common.protocol.messages import Header
from common.protocol.view_messages import VIEW_NAMES, Eye, VideoFrame, VideoStep, ViewName
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.mujoco.viewpoints import viewpoints
from robot_side.viewing.exchange import (
    Order,
    Picture,
    Ready,
    Refusal,
    Sent,
    Setup,
    Undecodable,
    decode_from_companion,
    encode,
)
from robot_side.viewing.losses import Losses
from robot_side.viewing.picture_rate_control import PictureRateControl, Step
from robot_side.viewing.sent_pictures import SentPictures, sent_eyes
from robot_side.viewing.settings import CamerasSettings
from robot_side.viewing.starting import Renders, Start, start_beside

IDLE_S: Final = 60.0
"""Time without use, in seconds, after which a companion is ended"""
RETRY_S: Final = 5.0
"""Time, in seconds, before a failed companion is started again"""
_SILENT_S: Final = 30.0
"""Time, in seconds, without an answer to an order, after which the companion is taken to hang: slow machines start
slowly."""
_ENDING_S: Final = 5.0
_WHOLE_S: Final = 0.5
"""Minimum period of whole H.264 pictures, in seconds: a viewer that asks for many would take the rate of others"""
_SETUP: Final = "setup"
"""Name of the setup among the orders, because it is answered like an order"""
_NEVER_BEGAN: Final = 2
"""Number of starts in a row without any picture, after which the companion is not started again"""


def saved_model(scene: Scene) -> bytes:
    """Return the model of a scene in MuJoCo's binary format, for `Setup`."""
    saved = np.zeros(mujoco.mj_sizeModel(scene.model), dtype=np.uint8)
    mujoco.mj_saveModel(scene.model, None, saved)
    return saved.tobytes()


class Cameras:
    """Keeper of one order of each wanted view; starts the companion process when a viewer is there or expected."""

    def __init__(
        self,
        scene: Scene,
        settings: CamerasSettings,
        note: Callable[[str], None],
        start: Start = start_beside,
        sent: SentPictures | None = None,
    ) -> None:
        """note: called for each fault with one line, which includes what to do about it.

        sent: pictures of real cameras, each of which replaces a rendered view from its first picture on.
        """
        self._sent, self._mounts = sent, settings.mount
        self._renders = True
        """Whether views can be rendered, as far as known; else only sent ones can be shown"""
        self._h264 = settings.codec == "auto"
        """Whether the companion makes H.264; taken to be so until it says otherwise"""
        shape = settings.width, settings.height
        self._setup = encode(Setup(saved_model(scene), *shape, viewpoints(scene), self._h264, sent is not None))
        self.picture_rate_control = PictureRateControl(settings.rate_hz, settings.quality)
        """Controller of the pictures' rate, quality and size"""
        self.starts = 0
        self.took_s: list[float] = []
        """Times that the companion took for the newest pictures, in seconds; at most a thousand"""
        self._whole: dict[ViewName, tuple[int, float]] = {}
        """Number and arrival time of each view's newest whole H.264 picture"""
        self._losses = Losses()
        self._data = scene.data
        self._note = note
        self._start = start
        self._starting = False
        self._handed_over: list[Renders | str] = []
        self._companion: Renders | None = None
        self._ended: list[tuple[Renders, float]] = []
        """Companions that were ended, each with the time until which it may exit by itself"""
        self._ordered_s: dict[str, float] = {}
        self._ordered_as: dict[ViewName, Step] = {}
        self._wanted_s = -math.inf
        self._not_before_s = -math.inf
        self._failures = 0
        self._has_worked = False
        self._hopeless = not settings.on
        if len(self._setup) > MESSAGE_LIMIT_BYTES:
            self._give_up(f"the model takes {len(self._setup) >> 20} MB; valid: up to {MESSAGE_LIMIT_BYTES >> 20} MB")

    @property
    def works(self) -> bool:
        """Whether pictures are wanted by the settings and, as far as known, can be rendered"""
        return not self._hopeless

    @property
    def process(self) -> Renders | None:
        """Companion process; None while there is none"""
        return self._companion

    def busy(self, view: ViewName) -> bool:
        """Return whether an order of `view` is under way."""
        return view in self._ordered_s

    def hear(self, now_s: float, *, watched: bool) -> None:
        """Take pictures that have been sent. watched: whether somebody looks."""
        if self._sent is not None:
            self._sent.update(now_s, watched=watched)

    def has_news(self, view: ViewName) -> bool:
        """Return whether a new picture of `view` can be ordered: always if it is rendered."""
        if self._sent is not None and self._sent.sends(view):
            return self._sent.fresh(view)
        return self._renders

    def sent_eyes(self) -> dict[ViewName, Eye | None]:
        """Return the viewpoint of each view that is sent, as `sent_eyes` does."""
        return {} if self._sent is None else sent_eyes(self._sent, self._mounts)

    def makes_h264(self, lacks: tuple[int, int] | None, now_s: float) -> bool:
        """Return whether pictures are H.264 for viewers that lack the pictures `lacks` (see `Watch`).

        None means that they show only JPEG. Where many are lost, pictures are JPEG, too: each needs no other.
        """
        return self._h264 and lacks is not None and not self._losses.many(now_s)

    def message(self, picture: Picture, header: Header) -> VideoFrame | VideoStep:
        """Return the message to be published for a picture."""
        place = header, picture.view, picture.captured_s, picture.width, picture.height
        if picture.number == 0:
            return VideoFrame(*place, picture.content)
        return VideoStep(*place, picture.number, picture.whole, picture.content)

    def update(
        self,
        now_s: float,
        captured_s: float,
        wanted: Collection[ViewName],
        lacks: tuple[int, int] | None = None,
        *,
        expected: bool = False,
    ) -> list[Picture]:
        """Order the `wanted` views that have no order under way; return the finished pictures.

        lacks: newest pictures that a viewer lacks, as for `makes_h264`. captured_s: time of the present state, which is
        ordered. expected: whether a viewer may come soon; the companion then starts even without an order. To be called
        in every turn while `wanted` is not empty, and sometimes otherwise.
        """
        expected = expected or bool(wanted)
        if expected:
            self._wanted_s = now_s
        self._follow_ends(now_s)
        companion = self._companion
        if companion is None:
            if expected and not self._hopeless and not self._starting and now_s >= self._not_before_s:
                self._starting = True
                self.starts += 1
                self._start(self._handed_over.append)
            self._take_started(now_s)
            return []
        pictures = self._receive(companion, now_s)
        if self._companion is None:
            return pictures
        if self._ordered_s and now_s - min(self._ordered_s.values()) > _SILENT_S:
            self._died(now_s, f"has not answered for {_SILENT_S:g} s")
        elif now_s - self._wanted_s > IDLE_S:
            self._end(companion, now_s)
        else:
            for view in wanted:
                self._order(companion, view, now_s, captured_s, lacks)
        return pictures

    def close(self) -> None:
        """End the companion; this takes a short time."""
        self._hopeless = True
        if self._companion is not None:
            self._end(self._companion, -math.inf)
        for part in (*self._handed_over, *(companion for companion, _ in self._ended)):
            if not isinstance(part, str):
                part.close(0.2)
        self._ended.clear()
        self._handed_over.clear()

    def _take_started(self, now_s: float) -> None:
        if not self._handed_over:
            return
        started, self._starting = self._handed_over.pop(), False
        if isinstance(started, str):
            self._failed(now_s, started)
            return
        self._companion = started
        started.channel.send(self._setup)
        self._ordered_s[_SETUP] = now_s

    def _order(
        self, companion: Renders, view: ViewName, now_s: float, captured_s: float, lacks: tuple[int, int] | None
    ) -> None:
        if view in self._ordered_s or _SETUP in self._ordered_s:
            return
        data, sent = self._data, None
        if self._sent is not None and self._sent.sends(view):
            if (picture := self._sent.take(view)) is None:
                return
            captured_s = picture.captured_s
            sent = Sent(picture.width, picture.height, picture.format, picture.content)
        mocap = np.concatenate([data.mocap_pos, data.mocap_quat], axis=1).tobytes() if len(data.mocap_pos) else b""
        step, h264 = self.picture_rate_control.step, self.makes_h264(lacks, now_s)
        number, came_s = self._whole.get(view, (0, -math.inf))
        # A lost picture is newer than the newest whole one.
        lost = lacks is not None and lacks[VIEW_NAMES.index(view)] > number
        if h264 and lost:
            self._losses.note(view, number, now_s)
        whole = h264 and lost and now_s - came_s >= _WHOLE_S
        positions = data.qpos.tobytes()
        order = Order(view, captured_s, positions, mocap, step.quality, step.halved, h264, whole, sent)
        if companion.channel.send(encode(order)):
            self._ordered_s[view], self._ordered_as[view] = now_s, step

    def _receive(self, companion: Renders, now_s: float) -> list[Picture]:
        pictures: list[Picture] = []
        for payload in companion.channel.receive():
            message = decode_from_companion(payload)
            if isinstance(message, Refusal):
                self._give_up(message.reason)
                self._end(companion, now_s)
                return pictures
            if isinstance(message, Ready):
                self._ready(message)
                continue
            self._ordered_s.pop(message.view, None)
            if isinstance(message, Undecodable):
                if self._sent is not None:
                    self._sent.refuse(message.view, message.reason, now_s)
                continue
            self._failures, self._has_worked = 0, True
            if message.number and message.whole:
                # Whole pictures are rare, and ten times as large as the following ones: not counted.
                self._whole[message.view] = message.number, now_s
            else:
                step = self._ordered_as[message.view]
                self.picture_rate_control.made(len(message.content), step, h264=message.number > 0)
            self.took_s = [*self.took_s[-999:], message.took_s]
            pictures.append(message)
        if companion.channel.ended:
            self._died(now_s, "has ended unexpectedly")
        return pictures

    def _ready(self, message: Ready) -> None:
        self._ordered_s.pop(_SETUP, None)
        self._h264 &= message.h264
        if message.unrendered and self._renders:
            self._renders = False
            self._note(f"cameras: only pictures that are sent are shown: {message.unrendered}")
        if message.trouble and not self._has_worked:
            self._note(
                f"cameras: pictures are JPEG, with ten times the bytes, as PyAV makes no H.264: {message.trouble}"
            )

    def _died(self, now_s: float, how: str) -> None:
        if self._companion is not None:
            self._end(self._companion, now_s)
        self._failed(now_s, f"the process that renders {how}")

    def _failed(self, now_s: float, why: str) -> None:
        self._failures += 1
        if self._failures >= _NEVER_BEGAN and not self._has_worked:
            self._give_up(f"{why}, {self._failures} times in a row; to see what is missing: feelahead doctor")
        else:
            self._not_before_s = now_s + RETRY_S
            self._note(f"cameras: {why}; the process is started again in {RETRY_S:g} s; the arm works meanwhile")

    def _give_up(self, why: str) -> None:
        self._hopeless = True
        self._note(f"cameras: there are no pictures, and the arm works without them: {why}")

    def _end(self, companion: Renders, now_s: float) -> None:
        companion.channel.close()
        self._ended.append((companion, now_s + _ENDING_S))
        self._companion = None
        self._ordered_s.clear()
        self._whole.clear()

    def _follow_ends(self, now_s: float) -> None:
        """Forget ended companions that have exited; kill one that does not exit in time."""
        if self._ended and (not self._ended[0][0].running or now_s >= self._ended[0][1]):
            self._ended.pop(0)[0].close(0.0)
