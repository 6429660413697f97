"""Sorting of the messages that a side records into topics: inputs are kept unchanged, and also decoded for people."""

import json
import math
from collections.abc import Iterable
from typing import Any, Final

import msgspec

from common.protocol.view_messages import SceneShapes, SceneState, VideoFrame
from common.recording.decoding import Decoder, Shown, shown_view, view_message
from common.recording.drawing import Drawing
from common.recording.entries import unpack_block
from common.recording.mcap_file import RecordingFile
from common.recording.topics import FACTS_TOPIC
from common.recording.wire import BLOCK, FACTS, FORMAT, HEADER, NOTE, SCHEMA, STATUS, VIEW, as_json, unstamped

_OTHER: Final = {"robot": "operator", "operator": "robot"}


class Content:
    """Sorter that writes one or both sides' messages into the topics of a file."""

    def __init__(self, file: RecordingFile) -> None:
        self._file = file
        self._sides: dict[int, str] = {}
        self._decoders: dict[str, Decoder] = {}
        self._dropped: dict[str, int] = {}
        self._stopped_because: str | None = None
        self._drawing = Drawing(file)
        self._objects: tuple[str, ...] = ()

    def write(self, source: int, message: bytes) -> None:
        """Write a message of the side `source`; ValueError if it is invalid, KeyError if it precedes the header."""
        kind, content = message[:1], message[1:]
        if kind == HEADER:
            self._begin(source, content)
            return
        side = self._sides[source]
        if kind == BLOCK:
            self._block(side, content)
            return
        if kind == SCHEMA:
            self._file.schemas[FACTS_TOPIC] = json.loads(content)
            return
        now_s, content = unstamped(content)
        if kind == VIEW:
            self._view(side, now_s, content)
        elif kind == STATUS:
            self._status(side, now_s, json.loads(content))
        elif kind == FACTS:
            self._file.write(FACTS_TOPIC, now_s, content)
        elif kind == NOTE:
            self._drawing.log(side, now_s, content.decode(errors="replace"))
        else:
            raise ValueError(f"the message has the unknown kind {kind!r}")

    def _begin(self, source: int, content: bytes) -> None:
        header = json.loads(content)
        side = header["side"]
        if side not in _OTHER or side in self._decoders:
            raise ValueError(f"side = {side!r}; valid: robot or operator, each once in a recording")
        self._sides[source] = side
        self._decoders[side] = Decoder(side)
        for decoder in self._decoders.values():
            decoder.alone = len(self._decoders) == 1
        values = {name: value if isinstance(value, str) else json.dumps(value) for name, value in header.items()}
        self._file.describe(f"feelahead.{side}", {"format": str(FORMAT), **values})

    def _block(self, side: str, content: bytes) -> None:
        block = unpack_block(content)
        self._file.write(f"/{side}/inputs", block.first_s, content)
        lost = block.dropped - self._dropped.get(side, 0)
        if lost > 0:
            self._dropped[side] = block.dropped
            self._drawing.log(
                side, block.first_s, f"{lost} blocks of inputs before this time were not recorded", warning=True
            )
        self._write(self._decoders[side].shown(block))

    def _view(self, side: str, now_s: float, payload: bytes) -> None:
        if side == "operator" and "robot" in self._decoders:
            return  # the robot side has recorded it as sent
        message = view_message(payload)
        if message is None:
            return
        if isinstance(message, VideoFrame):
            # The picture has a separate topic, at the same time.
            self._drawing.image(message, now_s)
            payload = _without_picture(payload)
        elif isinstance(message, SceneShapes):
            self._objects = message.objects
            self._drawing.shapes(message, now_s)
        elif isinstance(message, SceneState):
            self._drawing.state(message, now_s)
        self._file.write("/view", now_s, payload)
        self._write(shown_view(message, now_s, self._objects))

    def _status(self, side: str, now_s: float, status: dict[str, Any]) -> None:
        offset_s = status.get("offset_s")
        self._decoders[side].offset_s = math.nan if offset_s is None else offset_s
        self._file.write(f"/{side}/status", now_s, as_json({"time_s": now_s} | status))
        why = status.get("stopped_because")
        if side == "robot" and why != self._stopped_because:
            self._stopped_because = why
            if why is not None:
                self._drawing.log(side, now_s, f"stopped: {why}", warning=True)

    def _write(self, messages: Iterable[Shown]) -> None:
        for shown in messages:
            self._file.write(*shown)


def _without_picture(payload: bytes) -> bytes:
    version, message = msgspec.msgpack.decode(payload)
    message[-1] = b""
    return msgspec.msgpack.encode([version, message])
