"""Robot side with an operator who watches its views, run in virtual time as the real loop runs it."""

from dataclasses import dataclass, field
from typing import Any

from common.emulation.delay_line import DelayLine
from common.emulation.spec import LinkSpec
from common.protocol.codec import decode, decode_view, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import StiffnessUpdate, Watch
from common.protocol.view_messages import AnyViewMessage, SceneShapes, SceneState, VideoFrame, VideoStep
from robot_side.core.robot_side import RobotSide
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.tick.outgoing import Outgoing, OutgoingStream
from robot_side.viewing.exchange import Order
from robot_side.viewing.scene_view import SceneView
from robot_side.viewing.sent_pictures import SentPictures
from robot_side.viewing.settings import CamerasSettings
from robot_side.viewing.shapes import SceneModel
from robot_side.viewing.view_scheduler import ViewScheduler
from tests.helpers.fake_companion import Desk

TICK_S = 0.001


TABLES: list["Table"] = []


@dataclass
class Table:
    """Robot side, an operator who watches its views, and a stand-in companion that answers after 4 ms."""

    settings: RobotSettings = field(default_factory=RobotSettings)
    link: LinkSpec = field(default_factory=LinkSpec)
    always: tuple[str, ...] = ()
    jpeg_bytes: int = 18_000
    left_bit_s: float = 1e9
    begins: bool = False
    sent: SentPictures | None = None
    cameras: CamerasSettings | None = None

    def __post_init__(self) -> None:
        self.parts = build_parts(self.settings, 1, "clock")
        self.robot = RobotSide(self.parts)
        self.desk = Desk(self.parts.scene, self.cameras, self.sent)
        self.lines: dict[str, DelayLine[Outgoing]] = {
            stream: DelayLine(self.link.profile("to_operator", stream))
            for stream in ("haptics", "telemetry", "video", "scene")
        }
        view = SceneView(
            SceneModel(self.parts.scene),
            self.parts.kinematics,
            self.parts.explains,
            self.parts.enlarged,
            self.parts.surroundings,
        )
        self.looking = ViewScheduler(self.robot.session, view, self.desk.cameras, self, always=self.always)
        self.end = LinkEnd("operator", 5, "clock")
        self.watching: dict[str, Any] = {}
        self.ticks = 0
        self.ages_s: dict[str, list[float]] = {stream: [] for stream in self.lines}
        self.seen: list[AnyViewMessage] = []
        self._sent_s: dict[int, float] = {}
        self._orders: list[tuple[float, Order]] = []
        self._encoded: dict[str, tuple[object, int]] = {}
        self.hear(encode(self.end.hello(0.0)))

        TABLES.append(self)

    def backlog_s(self, stream: OutgoingStream, now_s: float) -> float:
        return self.lines[stream].backlog_s(now_s)

    @property
    def now_s(self) -> float:
        return self.ticks * TICK_S

    def hear(self, payload: bytes) -> None:
        self.robot.receive(b"peer", payload, self.now_s)

    def watch(self, **what: Any) -> None:
        self.watching = what

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.ticks += 1
            if self.watching and self.ticks % 250 == 1:
                self.hear(encode(Watch(self.end.stamp(self.now_s), **self.watching)))
            if self.ticks % 100 == 0:
                self.hear(encode(self.end.hello(self.now_s)))
            self._push(self.robot.tick(self.now_s))
            self._push(self.looking.idle(self.now_s, self.now_s, self.robot.newest))
            self._render()
            for stream, line in self.lines.items():
                for message in line.pop(self.now_s):
                    self.ages_s[stream].append(self.now_s - self._sent_s.pop(id(message)))
                    if stream in ("video", "scene"):
                        self.seen.append(decode_view(message.payload))

    def _push(self, messages: list[Outgoing]) -> None:
        for message in messages:
            if message.stream == "haptics" and not isinstance(decode(message.payload), StiffnessUpdate):
                continue
            self._sent_s[id(message)] = self.now_s
            self.lines[message.stream].push(self.now_s, message, len(message.payload))

    def _render(self) -> None:
        for companion in self.desk.companions:
            if companion.running:
                self._orders += [(self.now_s + 0.004, order) for order in self.desk.orders()]
        while self._orders and self._orders[0][0] <= self.now_s:
            order = self._orders.pop(0)[1]
            size_bytes, number, whole = self.jpeg_bytes, 0, True
            if order.h264:
                kind, (before, last) = (order.quality, order.halved), self._encoded.get(order.view, (None, 0))
                number, whole = last + 1, order.whole or before != kind
                self._encoded[order.view] = kind, number
                size_bytes = int(
                    (11_000 if whole else 1_000) * self.desk.cameras.picture_rate_control.step.bytes_share(h264=True)
                )
            self.desk.companions[-1].picture(order, bytes(size_bytes), number, whole=whole)

    def steps(self) -> list[VideoStep]:
        return [message for message in self.seen if isinstance(message, VideoStep)]

    def frames(self) -> list[VideoFrame]:
        return [message for message in self.seen if isinstance(message, VideoFrame)]

    def states(self) -> list[SceneState]:
        return [message for message in self.seen if isinstance(message, SceneState)]

    def shapes(self) -> list[SceneShapes]:
        return [message for message in self.seen if isinstance(message, SceneShapes)]
