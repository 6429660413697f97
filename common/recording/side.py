"""A side's end of a recording: what it notes in a turn costs an append; all else waits for its idle time.

core ── notes ──▶ list ── idle ──▶ blocks ── channel ──▶ recorder process ──▶ FILE.mcap
"""

import json
import math
import select
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Protocol

import msgspec

from common.clock import MonotonicClock
from common.companion.channel import Channel
from common.companion.process import Companion
from common.errors import ConfigurationError
from common.recording.entries import pack_block
from common.recording.packages import require_packages
from common.recording.wire import BLOCK, END, FACTS, HEADER, NOTE, STATUS, VIEW, as_json, stamped

_RECORDER: Final = "common.recording.recorder"
_BLOCK_S: Final = 0.04
_BLOCK_BYTES: Final = 1 << 18
STATUS_PERIOD_S: Final = 0.1
_READY_LIMIT_S: Final = 20.0
_LEAVE_LIMIT_S: Final = 0.5
_FINISH_LIMIT_S: Final = 20.0
_NOTHING: Final[Mapping[str, Any]] = {"kept_s": 0.0, "bytes": 0, "error": None}
KILLED: Final = "the recorder was killed"


class Encoder(Protocol):
    """Turns what a core noted into entries."""

    def encode(self, noted: Any, views: Callable[[float, bytes], None]) -> tuple[float, bytes]:
        """When it happened, and its entries; a payload for who looks goes to `views` with when."""

    def begin_anew(self) -> None:
        """What was told so far may be lost: tell the next thing whole."""


def require_recordable(path: Path | None) -> None:
    """ValueError for what cannot become a recording; ConfigurationError without the packages for it.

    A file that is there stays: a run that is over cannot be recorded again, and `rm` is one word.
    """
    if path is None or path.is_socket():
        return
    if path.suffix != ".mcap":
        raise ValueError(f"--record {path}: valid: a file's path that ends in .mcap")
    if not path.absolute().parent.is_dir():
        raise ValueError(f"--record {path}: its folder is not there; valid: a file's path")
    if path.exists() or path.is_symlink():
        raise ValueError(f"--record {path}: is there already; valid: a path where nothing is yet")
    require_packages("--record", "foxglove", "mcap")


class SideRecording:
    """Sends what happened to the recorder. Nothing here ever waits but the start and `close`."""

    def __init__(self, path: Path, side: str, encoder: Encoder) -> None:
        """Record into the new file `path`, or through the recorder that listens at the socket `path`.

        ConfigurationError when that cannot be.
        """
        self.noted: list[Any] = []
        """What happened since the last idle time: whoever notes appends, and pays no more."""
        self.dropped = 0
        """Blocks that the recorder had no room for."""
        self._side = side
        self._channel, self._recorder = connect(path)
        self._clock = MonotonicClock()
        self._encoder = encoder
        self._entries = bytearray()
        self._number = 0
        self._first_s = self._last_s = 0.0
        self._status_s = -1.0
        self._said = dict(_NOTHING)
        self._notes: list[str] = []
        self._gone = self._closed = False

    def begin(self, header: Mapping[str, Any]) -> None:
        """Tell first what the core was made from, so that it can be made again."""
        self._channel.send(HEADER, as_json({"side": self._side, **header}))

    def idle(self, now_s: float, status: Callable[[], msgspec.Struct] | None = None) -> list[str]:
        """Hand over what was noted; `status` is asked for a few times a second. What a person has to know now."""
        noted, self.noted[:] = self.noted[:], []
        for one in noted:
            self._last_s, entries = self._encoder.encode(one, self.view)
            if not self._entries:
                self._first_s = self._last_s
            self._entries += entries
        if self._entries and (now_s - self._first_s >= _BLOCK_S or len(self._entries) >= _BLOCK_BYTES):
            self._send_block()
        if status is not None and now_s >= self._status_s + STATUS_PERIOD_S:
            self._status_s = now_s
            self._channel.send(STATUS, stamped(now_s), as_json(status()))
        self._listen()
        notes, self._notes = self._notes, []
        return notes

    def view(self, now_s: float, payload: bytes) -> None:
        """Keep a view payload: what people looked at."""
        self._channel.send(VIEW, stamped(now_s), payload)

    def facts(self, now_s: float, facts: msgspec.Struct) -> None:
        """Keep what the operator side showed at one moment."""
        self._channel.send(FACTS, stamped(now_s), msgspec.json.encode(facts))

    def note(self, text: str) -> None:
        """Keep a line that a person is told now."""
        self._channel.send(NOTE, stamped(self._clock.now()), text.encode())

    def _send_block(self) -> None:
        block = pack_block(self._number, self.dropped, self._first_s, self._last_s, bytes(self._entries))
        self._number += 1
        self._entries.clear()
        if not self._channel.send(BLOCK, block):
            self.dropped += 1
            self._encoder.begin_anew()

    def _listen(self) -> None:
        failed = self._said["error"] is not None
        for message in self._channel.receive():
            self._said |= json.loads(message)
        if self._said["error"] is not None and not failed:
            self._notes.append(f"recording stopped: {self._said['error']}; {self._kept()}")
        elif self._channel.ended and not self._gone:
            self._gone = True
            if self._said["error"] is None:
                self._said["error"] = KILLED
                self._notes.append(f"the recorder is gone, and nothing more is recorded; {self._kept()}")

    def _kept(self) -> str:
        return f"kept: {self._said['kept_s']:.1f} s, {self._said['bytes'] / 1e6:.1f} MB"

    def close(self) -> dict[str, Any]:
        """Hand over what is left and let the file be finished; for the summary, what is known to be in it.

        Safe to call again.
        """
        if self._closed:
            return {"dropped_blocks": self.dropped} | self._said
        self._closed = True
        self.idle(math.inf)
        _wait_until_sent(self._channel, _LEAVE_LIMIT_S)
        self._channel.send(END)
        while "ended" not in self._said and not self._channel.ended:
            if not select.select([self._channel], [], [], _LEAVE_LIMIT_S)[0]:
                break
            self._listen()
        if self._recorder is None:
            self._channel.close()
        else:
            self._recorder.close()
        self._said.pop("ended", None)
        return {"dropped_blocks": self.dropped} | self._said


@contextmanager
def recording_to(path: Path | None, side: str, encoder: Encoder) -> Iterator[SideRecording | None]:
    """A recording, where one was asked for, that ends with the context."""
    recording = None if path is None else SideRecording(path, side, encoder)
    try:
        yield recording
    finally:
        if recording is not None:
            recording.close()


class Recorder:
    """The recorder process that writes one file: for one side, or for all that connect to `socket_path`."""

    def __init__(self, path: Path, socket_path: Path | None = None) -> None:
        """Start it and wait until the file is there; ConfigurationError when it cannot be."""
        listening = [] if socket_path is None else [str(socket_path)]
        self._companion = Companion(_RECORDER, [str(path), *listening])
        self.channel = self._companion.channel
        answer = _wait_for_answer(self.channel, _READY_LIMIT_S)
        said = {"error": "the recorder did not start"} if answer is None else json.loads(answer)
        if said.get("error"):
            self._companion.close()
            raise ConfigurationError(f"--record {path}: {said['error']}; valid: a place that can be written to")

    @property
    def process_id(self) -> int:
        """The operating system's number for it."""
        return self._companion.process_id

    def finish(self) -> dict[str, Any]:
        """Let the file be finished once every side is through; what is in it."""
        said, ended = dict(_NOTHING), False
        # What it said up to now comes first: to send something to one that is gone would lose it.
        for message in self.channel.receive():
            said |= json.loads(message)
        self.channel.send(END)
        while not ended and (answer := _wait_for_answer(self.channel, _READY_LIMIT_S)) is not None:
            said |= json.loads(answer)
            ended = said.pop("ended", False)
        if not ended and said["error"] is None:
            said["error"] = KILLED
        self.close()
        return said

    def close(self) -> None:
        """Let go of it: it ends by itself as soon as nobody speaks to it any more."""
        # It may still have much to write on a busy machine: what would be lost by killing it is the end of the run.
        self._companion.close(_FINISH_LIMIT_S)


def connect(path: Path) -> tuple[Channel, Recorder | None]:
    """A channel to the recorder that listens at the socket `path`, or to a new one that writes the file `path`."""
    if not path.is_socket():
        recorder = Recorder(path)
        return recorder.channel, recorder
    part = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        part.connect(str(path))
    except OSError as error:
        part.close()
        raise ConfigurationError(f"--record {path}: nobody listens there; valid: a file's path") from error
    return Channel(part), None


def _wait_until_sent(channel: Channel, limit_s: float) -> None:
    """Let leave what waits, as long as some of it leaves every so often."""
    while channel.waiting and not channel.ended:
        if not select.select([], [channel], [], limit_s)[1]:
            return
        channel.flush()


def _wait_for_answer(channel: Channel, limit_s: float) -> bytes | None:
    """The first message from the other end; None when it is gone or silent."""
    while not channel.ended and select.select([channel], [], [], limit_s)[0]:
        if messages := channel.receive():
            return messages[-1]
    return None
