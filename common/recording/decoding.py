"""Decoding of a core's entries into JSON messages for people and tools, in the recorder's process."""

import math
import struct
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import msgspec

from common.episode import EpisodeMark
from common.errors import RemoteProtocolError
from common.protocol.codec import decode, decode_view
from common.protocol.messages import MotionCommand, StiffnessUpdate, Telemetry
from common.protocol.view_messages import AnyViewMessage, SceneState
from common.recording.entries import FRAME, HAS_UNKNOWN, SHARES, Block, Entry, Kind, split_text
from common.recording.topics import Unseen, by_name
from common.recording.wire import as_json

AGES_PERIOD_S: Final = 0.01


class Shown(NamedTuple):
    """Decoded message of a topic, as JSON."""

    topic: str
    now_s: float
    content: bytes


class Decoder:
    """Decoder of one side's entries; it remembers the stamps from which ages are measured.

    If both sides are recorded, stiffnesses are taken from the robot side and commands from the operator side, as they
    were sent. If only one side is recorded, the messages that it received are used, too.
    """

    def __init__(self, side: str) -> None:
        self.alone = True
        """Whether only this side is recorded in the file."""
        self.offset_s = math.nan
        """Clock of the other side minus this side's, from this side's status; NaN while unknown."""
        self._side = side
        self._ages_s = -math.inf
        self._field_sent_s = self._frame_s = math.nan
        self._field_number = 0
        self._unseen: tuple[float, ...] = ()

    def shown(self, block: Block) -> Iterator[Shown]:
        """Yield the messages decoded from a block's entries; entries that cannot be decoded are passed over."""
        for entry in block.unpacked():
            try:
                yield from self._shown(entry)
            except (RemoteProtocolError, ValueError, struct.error):
                continue

    def _shown(self, entry: Entry) -> Iterator[Shown]:
        if entry.kind in (Kind.SENT, Kind.RECEIVED):
            rest = split_text(entry.content)[1]
            yield from self._message(entry, split_text(rest)[1] if entry.kind == Kind.SENT else rest)
        elif entry.kind == Kind.EPISODE and (self.alone or self._side == "operator"):
            yield _shown("/episode", entry.now_s, {"time_s": entry.now_s, "side": self._side}, _mark(entry))
        elif entry.kind == Kind.TRUTH:
            yield Shown("/truth", entry.now_s, entry.content)
        elif entry.kind == Kind.FRAME:
            self._frame_s, flags = FRAME.unpack_from(entry.content)
            if flags & HAS_UNKNOWN and (shares := SHARES.unpack_from(entry.content, FRAME.size)) != self._unseen:
                self._unseen = shares
                yield Shown("/unseen", entry.now_s, as_json(Unseen(entry.now_s, *shares)))
        elif entry.kind in (Kind.TICK, Kind.MOTION) and entry.now_s >= self._ages_s + AGES_PERIOD_S - 1e-6:
            self._ages_s = entry.now_s
            applied_s = struct.unpack_from("<d", entry.content)[0] if entry.kind == Kind.TICK else math.nan
            ages_ms = {
                "command_ms": self._since_ms(entry.now_s, applied_s),
                "field_ms": self._since_ms(entry.now_s, self._field_sent_s),
                "frame_ms": 1e3 * (entry.now_s - self._frame_s),
            }
            yield _shown("/ages", entry.now_s, {"time_s": entry.now_s, "side": self._side}, ages_ms)

    def _message(self, entry: Entry, payload: bytes) -> Iterator[Shown]:
        message = decode(payload)
        header, sent = message.header, entry.kind == Kind.SENT
        stamps: dict[str, Any] = {
            "time_s": entry.now_s,
            "side": self._side,
            "sequence": header.sequence,
            "sent_s": header.sent_s,
            "age_ms": 0.0 if sent else self._since_ms(entry.now_s, header.sent_s),
            "loop_age_ms": None if sent or header.echo_sent_s is None else 1e3 * (entry.now_s - header.echo_sent_s),
        }
        if isinstance(message, StiffnessUpdate):
            if not sent and header.sequence > self._field_number:
                self._field_number, self._field_sent_s = header.sequence, header.sent_s
            if sent or self.alone:
                yield _shown("/stiffness", entry.now_s, stamps, by_name(message))
        elif isinstance(message, MotionCommand) and (sent or self.alone):
            yield _shown("/command", entry.now_s, stamps, by_name(message))

    def _since_ms(self, now_s: float, sent_s: float) -> float:
        """Return the time from the other side's stamp `sent_s` to `now_s`, in milliseconds."""
        return 1e3 * (now_s - (sent_s - self.offset_s))


def _mark(entry: Entry) -> dict[str, Any]:
    return {"mark": msgspec.json.decode(entry.content, type=EpisodeMark)}


def view_message(payload: bytes) -> AnyViewMessage | Telemetry | None:
    """Decode a view payload; return None if it is invalid."""
    try:
        return decode_view(payload)
    except RemoteProtocolError:
        pass
    try:
        message = decode(payload)
    except RemoteProtocolError:
        return None
    return message if isinstance(message, Telemetry) else None


def shown_view(message: AnyViewMessage | Telemetry, now_s: float, objects: tuple[str, ...]) -> Iterator[Shown]:
    """Yield the messages shown for a view message: enlargement and overlaps of a SceneState, or a Telemetry.

    objects: the objects' names in the newest SceneShapes.
    """
    stamps = {"time_s": now_s, "sequence": message.header.sequence, "sent_s": message.header.sent_s}
    if isinstance(message, Telemetry):
        yield _shown("/telemetry", now_s, stamps, by_name(message))
    elif isinstance(message, SceneState):
        yield _shown("/enlargement", now_s, stamps, {"l2": by_name(message.l2), "r2": by_name(message.r2)})
        of_objects = [
            {"object": (*objects, "surfaces")[min(index, len(objects))], "l2_mm3": 1e9 * l2, "r2_mm3": 1e9 * r2}
            for index, l2, r2 in message.overlaps
        ]
        yield _shown("/overlap", now_s, stamps, {"objects": of_objects})


def _shown(topic: str, now_s: float, stamps: dict[str, Any], values: dict[str, Any]) -> Shown:
    return Shown(topic, now_s, as_json(stamps | values))
