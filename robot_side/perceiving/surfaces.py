"""Robot side's end of the process that maps depth pictures: it takes surfaces as they come."""

import math
from collections import Counter
from collections.abc import Callable
from select import select
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.clock import Clock
from common.companion.process import Companion
from common.errors import ConfigurationError, FeelaheadError
from common.roles import Role
from robot_side.arm.port import Arm, ArmState
from robot_side.depth.frames import SurfaceFrames
from robot_side.drivers.mujoco.scene import Scene
from robot_side.perceiving.exchange import (
    Forget,
    Joints,
    Note,
    Ready,
    Refusal,
    RoleOf,
    Setup,
    Surfaces,
    changes_of,
    decode_from_companion,
    encode,
    unknown_of,
)
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.tick.events import Listener, Tick

MODULE: Final = "robot_side.perceiving.companion"
OLD_S: Final = 0.5
"""Age of the newest picture, in seconds, above which a note is made. Surfaces stay, so triggers stay stiff."""
_TURN_S: Final = 0.01
_JOINTS_PERIOD_S: Final = 0.008
_FIRST_MAP_S: Final = 0.5
_NEW_MAP_S: Final = 2.0
"""Times for which the first map grows, and one that replaces another"""
_NEW_MAP_PICTURES: Final = 4
"""Least number of pictures of a map that is shown: a surface is there from its second on"""
_RETRY_S: Final = 2.0
_HANGS_S: Final = 20.0
"""Time without a picture, in seconds, after which a companion that does not compute is taken to hang"""
_SILENT_S: Final = 180.0
"""Time to the first answer of a companion, in seconds, from which on it is taken to hang: slow machines compile long"""


class Surfaced(Listener):
    """Source of the objects that depth cameras see, from a companion process that is started again when it ends."""

    def __init__(
        self,
        setup: Setup,
        frames: Callable[[], SurfaceFrames],
        note: Callable[[str], None],
        start: Callable[[], Companion] = lambda: Companion(MODULE),
    ) -> None:
        """frames: makes empty frames. note: called with lines that people read. start: starts a companion."""
        self._setup, self._new_frames, self._note = encode(setup), frames, note
        self._simulates = setup.port is None
        self._scene: Scene | None = None
        self._start = start
        self._companion: Companion | None = None
        self._frames: SurfaceFrames | None = None
        """Frames that are shown; None before the first map"""
        self._growing: tuple[SurfaceFrames, float] | None = None
        """Frames of a new map, and the time of its first surfaces"""
        self._begins_s, self._taken_s, self._told_s = -math.inf, -math.inf, -math.inf
        self._is_old, self._is_new, self._is_ready = False, False, False
        self._looked_s, self._pictures, self._said_crowded = -math.inf, 0, False
        self._solids: bytes | None = None
        """Solids of known models; None if there are none"""
        self._news: bytes | None = None
        """What of these the companion has not been told"""
        self._figures: Counter[str] = Counter()
        self._newest: dict[str, float] = {}
        self._ages_s: list[float] = []
        self.endpoint = ""

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest frame at `now_s`; FeelaheadError before the first one."""
        self._update(now_s)
        if self._frames is None:
            raise FeelaheadError("no depth picture has been mapped yet")
        return self._frames.at(now_s)

    def set_role(self, name: str, role: Role) -> None:
        """Change the role of the object `name`, from a later frame on."""
        # Until a new map is shown, its names are others than those that people see.
        if self._companion is not None and self._growing is None and not self._is_new:
            self._companion.channel.send(encode(RoleOf(name, role)))

    def explain(self, solids: FloatArray) -> None:
        """Take solids (k, 16) of known models out of the map, from the next picture on."""
        self._solids = self._news = solids.tobytes()

    def put_back(self) -> None:
        """Forget what was seen, as the objects were put back."""
        if self._companion is not None:
            self._companion.channel.send(encode(Forget()))

    def on_tick(self, tick: Tick) -> None:
        """Tell where the robot is."""
        if tick.measured is not None and tick.now_s - self._told_s >= _JOINTS_PERIOD_S:
            self.tell(tick.measured, tick.now_s, None if tick.found is None else tick.found.held)

    def tell(self, state: ArmState, now_s: float, held: FloatArray | None = None) -> None:
        """Tell where the robot is, and what it holds."""
        self._told_s = now_s
        if self._companion is not None:
            joints = state.joint_positions_rad.tobytes(), state.finger_positions.tobytes()
            positions = b"" if self._scene is None else self._scene.data.qpos.tobytes()
            models, self._news = self._news, None
            self._companion.channel.send(
                encode(Joints(state.time_s, *joints, b"" if held is None else held.tobytes(), models, positions))
            )

    def begin(self, now_s: float) -> None:
        """Start a companion."""
        self._begins_s, self._is_new, self._is_ready, self._pictures = now_s, True, False, 0
        self._companion = self._start()
        self._companion.channel.send(self._setup)
        self._news = self._solids

    def wait(self, arm: Arm, scene: Scene, clock: Clock, meanwhile: Callable[[], object]) -> None:
        """Wait for the first map, however long; a signal ends the wait. meanwhile: called some 100 times a second.

        ConfigurationError if nothing can be seen.
        """
        told, self._scene = False, scene if self._simulates else None
        while self._frames is None:
            now_s = clock.now()
            self._update(now_s)
            self.tell(arm.state(now_s), now_s)
            if self.endpoint and not told:
                told = True
                self._note(f"waiting for depth pictures at {self.endpoint}")
            meanwhile()
            select([] if self._companion is None else [self._companion.channel], [], [], _TURN_S)

    def _update(self, now_s: float) -> None:
        companion = self._companion
        if companion is None:
            if now_s >= self._begins_s:
                self.begin(now_s)
            return
        for payload in companion.channel.receive():
            self._take(payload, now_s)
        grows_s = _FIRST_MAP_S if self._frames is None else _NEW_MAP_S
        if self._growing is not None and now_s - self._growing[1] >= grows_s and self._pictures >= _NEW_MAP_PICTURES:
            if self._frames is not None:
                self._note("depth: there is a new map; what no camera sees now is forgotten")
            self._frames, self._growing = self._growing[0], None
        silent = not self._is_ready and now_s - self._begins_s > _SILENT_S
        if now_s - max(self._taken_s, self._looked_s) > _HANGS_S:
            self._looked_s = now_s
            silent |= self._is_ready and not companion.works()
        if companion.channel.ended or silent:
            self._note(f"depth: the process that maps pictures has ended; it is started again in {_RETRY_S:g} s")
            companion.close(0.0)
            self._companion, self._growing, self._begins_s = None, None, now_s + _RETRY_S
            self._figures["restarts"] += 1
        if self._frames is not None and (now_s - self._taken_s > OLD_S) is not self._is_old:
            self._is_old = not self._is_old
            age = f"the newest picture is {now_s - self._taken_s:.1f} s old; what was seen stays"
            self._note(f"depth: {age if self._is_old else 'pictures arrive again'}")

    def _take(self, payload: bytes, now_s: float) -> None:
        message = decode_from_companion(payload)
        if isinstance(message, Refusal) and self._frames is None:
            raise ConfigurationError(f"depth: {message.reason}")
        if isinstance(message, Refusal):
            self._note(f"depth: {message.reason}")
        elif isinstance(message, Note):
            self._note(message.text)
        elif isinstance(message, Ready):
            self.endpoint, self._is_ready = message.endpoint, True
            if message.endpoint:
                self._note(f"depth pictures are taken at {message.endpoint}")
        else:
            self._show(message, now_s)

    def _show(self, message: Surfaces, now_s: float) -> None:
        changes = changes_of(message)
        if self._is_new:
            self._growing, self._is_new = (self._new_frames(), now_s), False
        shown = self._growing[0] if self._growing is not None else self._frames
        if shown is not None:
            shown.take(changes, message.taken_s, unknown_of(message))
        self._taken_s, self._pictures = message.taken_s[0], self._pictures + 1
        if not self._said_crowded and (message.crowded_out or message.seen.get("without_room")):
            self._said_crowded = True
            text = (
                "surfaces far from the gripper are left out; more: --depth-map.slots, or a greater --depth-map.cell-m"
            )
            self._note(f"depth: there are too many surfaces: {text}")
        self._newest = message.seen | {"crowded_out": float(message.crowded_out)}
        self._ages_s = [*self._ages_s[-999:], now_s - message.taken_s[0]]
        self._figures["frames"] += 1
        self._figures["changed"] += len(changes.slots)

    def close(self) -> None:
        """End the companion."""
        if self._companion is not None:
            self._companion.close()

    def summary(self) -> dict[str, Any]:
        """Return the numbers of frames and changes, and the figures of the newest picture."""
        ages = [] if not self._ages_s else np.percentile(self._ages_s, (50, 99)).tolist()
        aged = {name: 1e3 * age for name, age in zip(("p50", "p99"), ages, strict=False)}
        return {**self._figures, "age_ms": aged, "newest": self._newest}
