"""The robot side's end of rendering: orders pictures of a companion and takes them, without ever waiting for it."""

import math
import threading
from collections.abc import Callable, Collection
from typing import Final, Protocol

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.companion.channel import MESSAGE_LIMIT_BYTES, Channel
from common.companion.process import Companion
from common.protocol.view_messages import ViewName
from robot_side.cameras.exchange import Order, Picture, Refusal, Setup, decode_from_companion, encode
from robot_side.cameras.settings import CamerasSettings
from robot_side.cameras.viewpoints import viewpoints
from robot_side.simulation.scene import Scene

MODULE: Final = "robot_side.cameras.companion"
IDLE_S: Final = 60.0
"""A companion that nobody has needed for so long is ended."""
RETRY_S: Final = 5.0
"""One that has died is started again no sooner."""
_SILENT_S: Final = 30.0
"""An order that is not answered within this: it hangs. A slow machine takes a while to start."""
_ENDING_S: Final = 5.0
_NEVER_BEGAN: Final = 2
"""After so many starts in a row that came to no picture, no other one follows."""


class Renders(Protocol):
    """A `Companion`, as far as it is needed here."""

    channel: Channel

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        ...

    def close(self, limit_s: float = ...) -> bool:
        """End it."""
        ...


Start = Callable[[Callable[[Renders | str], None]], None]
"""Starts a companion, and hands it, or why there is none, to the function that it is given, at once or later."""


def start_beside(done: Callable[[Renders | str], None]) -> None:
    """In a thread, as starting a process takes milliseconds; what is waited for there holds nobody up."""

    def begin() -> None:
        try:
            done(Companion(MODULE))
        except OSError as error:
            done(f"no process can be started: {error.strerror}")

    threading.Thread(target=begin, daemon=True).start()


class Cameras:
    """Keeps one order of each view under way while it is wanted; starts the companion when it is needed first."""

    def __init__(
        self,
        scene: Scene,
        settings: CamerasSettings,
        note: Callable[[str], None],
        start: Start = start_beside,
    ) -> None:
        """note: told in one line what does not work, and what would help."""
        model = scene.model
        saved = np.zeros(mujoco.mj_sizeModel(model), dtype=np.uint8)
        mujoco.mj_saveModel(model, None, saved)
        self._setup = encode(
            Setup(saved.tobytes(), settings.width, settings.height, settings.quality, viewpoints(scene))
        )
        self.period_s = 1.0 / settings.rate_hz
        self.size = settings.width, settings.height
        self.starts = 0
        self.took_s: list[float] = []
        """How long the companion was at the newest pictures, at most a thousand."""
        self._data = scene.data
        self._note = note
        self._start = start
        self._starting = False
        self._handed_over: list[Renders | str] = []
        self._companion: Renders | None = None
        self._ended: list[tuple[Renders, float]] = []
        """Those that may take until then to end by themselves."""
        self._ordered_s: dict[ViewName, float] = {}
        self._wanted_s = -math.inf
        self._not_before_s = -math.inf
        self._failures = 0
        self._has_worked = False
        self._hopeless = not settings.on
        if len(self._setup) > MESSAGE_LIMIT_BYTES:
            self._give_up(f"the model takes {len(self._setup) >> 20} MB; valid: up to {MESSAGE_LIMIT_BYTES >> 20}")

    @property
    def works(self) -> bool:
        """False once it is known that nothing can be rendered, or where nothing is to be."""
        return not self._hopeless

    @property
    def process(self) -> Renders | None:
        """The companion, while there is one."""
        return self._companion

    def busy(self, view: ViewName) -> bool:
        """Whether an order of `view` is under way."""
        return view in self._ordered_s

    def update(self, now_s: float, captured_s: float, wanted: Collection[ViewName]) -> list[Picture]:
        """Order the `wanted` views that are not under way, of the state as it is; what has been finished.

        captured_s: when that state was so. To be called in every turn while `wanted` is not empty, and now and then
        otherwise.
        """
        if wanted:
            self._wanted_s = now_s
        self._follow_ends(now_s)
        companion = self._companion
        if companion is None:
            if wanted and not self._hopeless and not self._starting and now_s >= self._not_before_s:
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
                self._order(companion, view, now_s, captured_s)
        return pictures

    def close(self) -> None:
        """End the companion, within a moment."""
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

    def _order(self, companion: Renders, view: ViewName, now_s: float, captured_s: float) -> None:
        if view in self._ordered_s:
            return
        data = self._data
        mocap = np.concatenate([data.mocap_pos, data.mocap_quat], axis=1).tobytes() if len(data.mocap_pos) else b""
        if companion.channel.send(encode(Order(view, captured_s, data.qpos.tobytes(), mocap))):
            self._ordered_s[view] = now_s

    def _receive(self, companion: Renders, now_s: float) -> list[Picture]:
        pictures: list[Picture] = []
        for payload in companion.channel.receive():
            message = decode_from_companion(payload)
            if isinstance(message, Refusal):
                self._give_up(message.reason)
                self._end(companion, now_s)
                return pictures
            self._ordered_s.pop(message.view, None)
            self._failures, self._has_worked = 0, True
            self.took_s = [*self.took_s[-999:], message.took_s]
            pictures.append(message)
        if companion.channel.ended:
            self._died(now_s, "has ended unexpectedly")
        return pictures

    def _died(self, now_s: float, how: str) -> None:
        if self._companion is not None:
            self._end(self._companion, now_s)
        self._failed(now_s, f"the process that renders {how}")

    def _failed(self, now_s: float, why: str) -> None:
        self._failures += 1
        if self._failures >= _NEVER_BEGAN and not self._has_worked:
            self._give_up(f"{why}, {self._failures} times in a row; what is missing says: feelahead doctor")
        else:
            self._not_before_s = now_s + RETRY_S
            self._note(f"cameras: {why}; it is started again in {RETRY_S:g} s, the arm goes on")

    def _give_up(self, why: str) -> None:
        self._hopeless = True
        self._note(f"cameras: no pictures, the arm goes on without: {why}")

    def _end(self, companion: Renders, now_s: float) -> None:
        companion.channel.close()
        self._ended.append((companion, now_s + _ENDING_S))
        self._companion = None
        self._ordered_s.clear()

    def _follow_ends(self, now_s: float) -> None:
        """See those off that have been told to end; who does not is killed."""
        if self._ended and (not self._ended[0][0].running or now_s >= self._ended[0][1]):
            self._ended.pop(0)[0].close(0.0)
