"""Recording at the side that is recorded: noting an event in a turn costs one append; the rest is done in idle time.

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
from common.extras import require_packages
from common.recording.entries import pack_block
from common.recording.topics import FACTS_TOPIC, json_schema
from common.recording.wire import BLOCK, END, FACTS, HEADER, NOTE, SCHEMA, STATUS, VIEW, as_json, stamped

_RECORDER: Final = "common.recording.recorder"
_BLOCK_S: Final = 0.04
_BLOCK_BYTES: Final = 1 << 18
STATUS_PERIOD_S: Final = 0.1
_READY_LIMIT_S: Final = 20.0
_LEAVE_LIMIT_S: Final = 0.5
_FINISH_LIMIT_S: Final = 20.0
_IDLE_LIMIT_S: Final = 1.0
"""Time for which a recorder may do nothing at the end, twice: one that hangs delays the end by 2 s"""
_NOTHING: Final[Mapping[str, Any]] = {"kept_s": 0.0, "bytes": 0, "error": None}
KILLED: Final = "the recorder was killed"


class Encoder(Protocol):
    """Encoder of the events that a core notes into entries (entries.py)."""

    def encode(self, noted: Any, views: Callable[[float, bytes], None]) -> tuple[float, bytes]:
        """Return the time and the entries of a noted event; call `views(now_s, payload)` for view payloads in it."""

    def begin_epoch(self) -> None:
        """Encode the next values completely, not only if they have changed, as a block of earlier ones was dropped."""


def require_recordable(path: Path | None) -> None:
    """Raise ValueError if `path` cannot become a recording, ConfigurationError if packages are missing.

    `path` may be a recorder's socket, or None. An existing file is never overwritten: its run cannot be repeated.
    """
    if path is None or path.is_socket():
        return
    if path.suffix != ".mcap":
        raise ValueError(f"--record {path}: does not end in .mcap; valid: a file's path that ends in .mcap")
    if not path.absolute().parent.is_dir():
        raise ValueError(f"--record {path}: its folder does not exist; valid: a new file in an existing folder")
    if path.exists() or path.is_symlink():
        raise ValueError(f"--record {path}: exists already; valid: the path of a new file")
    require_packages("--record", "foxglove", "mcap")


class SideRecording:
    """Sender of a side's events to the recorder process. Only the start and `close` may block."""

    def __init__(self, path: Path, side: str, encoder: Encoder) -> None:
        """Connect to a recorder, as `connect` does. Raises ConfigurationError if that fails."""
        self.noted: list[Any] = []
        """Events noted since the last call of `idle`; noting one costs one append."""
        self.dropped = 0
        """Number of blocks that were dropped because the recorder did not keep up."""
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
        self._gone = self._closed = self._described = False

    def begin(self, header: Mapping[str, Any]) -> None:
        """Send the values from which the core was made, which a replay needs; call it before anything else is sent."""
        self._channel.send(HEADER, as_json({"side": self._side, **header}))

    def idle(self, now_s: float, status: Callable[[], msgspec.Struct] | None = None) -> list[str]:
        """Send the noted events, and ten times a second the `status`. Return lines to show to a person."""
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
        """Record a view payload of the time `now_s`."""
        self._channel.send(VIEW, stamped(now_s), payload)

    def facts(self, now_s: float, facts: msgspec.Struct) -> None:
        """Record the facts that the operator side shows at `now_s`."""
        # A full channel takes nothing; facts without their schema would have none in the whole file.
        if not self._described:
            self._described = self._channel.send(SCHEMA, as_json(json_schema(FACTS_TOPIC, type(facts))))
        if self._described:
            self._channel.send(FACTS, stamped(now_s), msgspec.json.encode(facts))

    def note(self, text: str) -> None:
        """Record a line that is now shown to people."""
        self._channel.send(NOTE, stamped(self._clock.now()), text.encode())

    def _send_block(self) -> None:
        block = pack_block(self._number, self.dropped, self._first_s, self._last_s, bytes(self._entries))
        self._number += 1
        self._entries.clear()
        if not self._channel.send(BLOCK, block):
            self.dropped += 1
            self._encoder.begin_epoch()

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
                self._notes.append(f"the recorder has ended, and nothing more is recorded; {self._kept()}")

    def _kept(self) -> str:
        return f"kept: {self._said['kept_s']:.1f} s, {self._said['bytes'] / 1e6:.1f} MB"

    def close(self) -> dict[str, Any]:
        """Send what is left and let the recorder finish; return figures of the file for the summary.

        A second call does no harm.
        """
        if self._closed:
            return {"dropped_blocks": self.dropped} | self._said
        self._closed = True
        self.idle(math.inf)
        _wait_until_sent(self._channel, _LEAVE_LIMIT_S)
        self._channel.send(END)
        # A recorder of our own is waited for as long as it works; its last answer has the whole file's figures.
        idled_s = waited_s = 0.0
        while "ended" not in self._said and not self._channel.ended:
            if idled_s >= _IDLE_LIMIT_S or waited_s >= _FINISH_LIMIT_S:
                break
            if select.select([self._channel], [], [], _LEAVE_LIMIT_S)[0]:
                self._listen()
            elif self._recorder is None:
                break
            else:
                waited_s += _LEAVE_LIMIT_S
                idled_s = 0.0 if self._recorder.works() else idled_s + _LEAVE_LIMIT_S
        if self._recorder is None:
            self._channel.close()
        else:
            self._recorder.close()
        self._said.pop("ended", None)
        return {"dropped_blocks": self.dropped} | self._said


@contextmanager
def recording_to(path: Path | None, side: str, encoder: Encoder) -> Iterator[SideRecording | None]:
    """Open a recording that ends with the context; yield None if `path` is None."""
    recording = None if path is None else SideRecording(path, side, encoder)
    try:
        yield recording
    finally:
        if recording is not None:
            recording.close()


class RecorderProcess:
    """Recorder process that writes one file, for this side or, at `socket_path`, for all sides that connect there."""

    def __init__(self, path: Path, socket_path: Path | None = None) -> None:
        """Start the process and wait until it has made the file `path`; raises ConfigurationError if it cannot."""
        listening = [] if socket_path is None else [str(socket_path)]
        self._companion = Companion(_RECORDER, [str(path), *listening])
        self.channel = self._companion.channel
        answer = _wait_for_answer(self.channel, _READY_LIMIT_S)
        said = {"error": "the recorder did not start"} if answer is None else json.loads(answer)
        self._said = dict(_NOTHING)
        if said.get("error"):
            self._companion.close()
            raise ConfigurationError(
                f"--record {path}: {said['error']}; valid: a new file in a folder that this user may write to"
            )

    @property
    def process_id(self) -> int:
        """Process id of the recorder."""
        return self._companion.process_id

    def error(self) -> str | None:
        """Return why nothing more is recorded; None while all is well. Call it before `finish`."""
        for message in self.channel.receive():
            self._said |= json.loads(message)
        if self.channel.ended and self._said["error"] is None:
            self._said["error"] = KILLED
        error: str | None = self._said["error"]
        return error

    def finish(self) -> dict[str, Any]:
        """Finish the file, once all sides have ended; return figures of the file."""
        self.error()  # reads its earlier messages first: a send to an ended process would lose them
        said, ended = self._said, False
        self.channel.send(END)
        while not ended and (answer := _wait_for_answer(self.channel, _READY_LIMIT_S)) is not None:
            said |= json.loads(answer)
            ended = said.pop("ended", False)
        if not ended and said["error"] is None:
            said["error"] = KILLED
        self.close()
        return said

    def close(self) -> None:
        """Close our channel and wait for the process, which ends once all channels are closed."""
        # On a busy machine it may still have much to write: killing it would lose the end of the run.
        self._companion.close(_FINISH_LIMIT_S, _IDLE_LIMIT_S)

    def works(self) -> bool:
        """Return whether the process does anything, as Companion.works does."""
        return self._companion.works()


def connect(path: Path) -> tuple[Channel, RecorderProcess | None]:
    """If `path` is a socket, connect to the recorder that listens there; otherwise start one that writes to `path`.

    Return the channel to the recorder, and the recorder if it was started here.
    """
    if not path.is_socket():
        recorder = RecorderProcess(path)
        return recorder.channel, recorder
    part = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        part.connect(str(path))
    except OSError as error:
        part.close()
        raise ConfigurationError(
            f"--record {path}: no recorder listens at this socket; valid: the path of a new file"
        ) from error
    return Channel(part), None


def _wait_until_sent(channel: Channel, limit_s: float) -> None:
    """Send the waiting messages; give up when nothing can be sent for `limit_s`."""
    while channel.waiting and not channel.ended:
        if not select.select([], [channel], [], limit_s)[1]:
            return
        channel.flush()


def _wait_for_answer(channel: Channel, limit_s: float) -> bytes | None:
    """Wait for messages and return the newest; None if the channel has ended or `limit_s` passes without one."""
    while not channel.ended and select.select([channel], [], [], limit_s)[0]:
        if messages := channel.receive():
            return messages[-1]
    return None
