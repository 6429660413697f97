"""The process's loop with a clock and sockets of the test's own."""

from typing import Any

import pytest

from common.command.status import Status
from common.emulation.spec import LinkSpec
from common.realtime.stages import Stages
from common.sockets.tcp_figures import TcpFigures
from robot_side import main
from robot_side.core import RobotSide
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.turn_stages import STAGES
from robot_side.viewing.scene_view import SceneView
from robot_side.viewing.settings import CamerasSettings
from robot_side.viewing.shapes import SceneModel


class SteppedClock:
    """A clock that only the test moves on."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def now(self) -> float:
        return self.now_s


class SuspendedSockets:
    """Sockets of a process that is suspended for a second while it receives; nothing leaves them."""

    def __init__(self, clock: SteppedClock) -> None:
        self._clock = clock

    def receive(self) -> list[tuple[bytes, bytes]]:
        self._clock.now_s += 1.0
        return [(b"peer", b"payload")]

    def send(self, *_: Any) -> bool:
        return True

    publish = wait = send

    def tcp_figures(self, _: bytes) -> TcpFigures:
        return TcpFigures()


class Once:
    """A stop signal that comes after the first turn."""

    turns = 0

    @property
    def is_set(self) -> bool:
        self.turns += 1
        return self.turns > 1


def test_the_clock_is_read_after_receiving(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that was suspended meanwhile must not take old commands for new."""
    clock, heard = SteppedClock(), []
    monkeypatch.setattr(main, "MonotonicClock", lambda: clock)
    settings = RobotSettings(cameras=CamerasSettings(on=False))
    parts = build_parts(settings, 1, "clock")
    core = RobotSide(parts)
    monkeypatch.setattr(core, "receive", lambda *message: heard.append(message))
    monkeypatch.setattr(core, "tick", lambda _: [])
    monkeypatch.setattr(main._Loop, "_use_idle_time", lambda *_: None)
    stages = Stages(STAGES, clock, clock)
    with Status("none", "robot") as status:
        view = SceneView(SceneModel(parts.scene), parts.kinematics, parts.explains)
        sockets: Any = SuspendedSockets(clock)
        loop = main._Loop(settings, core, parts, view, LinkSpec.parse(""), sockets, status, None, stages)
        loop.run(Once())  # type: ignore[arg-type]
        loop.close()
    assert heard == [(b"peer", b"payload", 101.0)]
