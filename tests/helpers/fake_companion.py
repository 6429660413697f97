"""Stand-in for the companion process that renders pictures: the test itself answers the robot side's `Cameras`."""

import socket
from collections.abc import Callable

from common.companion.channel import Channel
from robot_side.drivers.mujoco.scene import Scene
from robot_side.viewing.exchange import Order, Picture, Ready, Refusal, Setup, Undecodable, decode_to_companion, encode
from robot_side.viewing.pictures import Cameras
from robot_side.viewing.sent_pictures import SentPictures
from robot_side.viewing.settings import CamerasSettings
from robot_side.viewing.starting import Renders


class FakeCompanion:
    """Stand-in for a companion: `channel` is the robot side's end, `other` the companion's, which the test uses."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        self.channel, self.other = Channel(ours), Channel(theirs)
        self.running = True
        self.closed: list[float] = []

    def close(self, limit_s: float = 2.0) -> bool:
        self.closed.append(limit_s)
        self.channel.close()
        self.other.close()
        self.running = False
        return True

    def heard(self) -> list[Setup | Order]:
        return [decode_to_companion(payload) for payload in self.other.receive()]

    def answer(self, message: Ready | Picture | Undecodable | Refusal) -> None:
        self.other.send(encode(message))

    def picture(self, order: Order, content: bytes = b"\xff\xd8", number: int = 0, *, whole: bool = True) -> None:
        """Send a picture to the robot side: a JPEG if `number` is 0, else the H.264 step of that number."""
        size = (320, 240) if order.halved else (640, 480)
        self.answer(Picture(order.view, order.captured_s, *size, content, 0.003, number, whole))


class Desk:
    """The robot side's `Cameras`, the stand-in companions that they have started, and their notes to a person."""

    def __init__(self, scene: Scene, settings: CamerasSettings | None = None, sent: SentPictures | None = None) -> None:
        self.scene = scene
        self.ready = Ready(h264=True)
        self.companions: list[FakeCompanion] = []
        self.notes: list[str] = []
        self.fails_to_start: str | None = None
        self.cameras = Cameras(scene, settings or CamerasSettings(), self.notes.append, self._start, sent)

    def _start(self, done: Callable[[Renders | str], None]) -> None:
        if self.fails_to_start is not None:
            done(self.fails_to_start)
            return
        self.companions.append(FakeCompanion())
        self.companions[-1].answer(self.ready)
        done(self.companions[-1])

    def orders(self) -> list[Order]:
        return [message for message in self.companions[-1].heard() if isinstance(message, Order)]

    def started(self, now_s: float = 0.0) -> FakeCompanion:
        self.cameras.update(now_s, now_s, ("overview", "first_person"))
        return self.companions[-1]

    def close(self) -> None:
        self.cameras.close()
        for companion in self.companions:
            companion.close()
