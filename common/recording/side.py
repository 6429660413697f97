"""A side's end of a recording: a note in a turn costs an append; all else waits for idle time.

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
    """Encoder of a core's notes as entries."""

    def encode(self, noted: Any, views: Callable[[float, bytes], None]) -> tuple[float, bytes]:
        """Return the note's time and entries; pass view payloads to `views`, with their times."""

    def begin_epoch(self) -> None:
        """Encode the next values whole: earlier ones may be lost."""


def require_recordable(path: Path | None) -> None:
    """Raise ValueError if `path` cannot become a recording, ConfigurationError if packages are missing.

    An existing file is never overwritten: its run cannot be recorded again.
    """
    if path is None or path.is_socket():
        return
    if path.suffix != ".mcap":
        raise ValueError(f"--record {path}: valid: a file's path that ends in .mcap")
    if not path.absolute().parent.is_dir():
        raise ValueError(f"--record {path}: its folder is not there; valid: a file's path")
    if path.exists() or path.is_symlink():
        raise ValueError(f"--record {path}: exists already; valid: a new file's path")
    require_packages("--record", "foxglove", "mcap")


class SideRecording:
    """Sender of a side's events to the recorder. Only the start and `close` wait."""

    def __init__(self, path: Path, side: str, encoder: Encoder) -> None:
        """Record into the new file `path`, or through the recorder that listens at the socket `path`.

        Raises ConfigurationError if that fails.
        """
        self.noted: list[Any] = []
        """Notes since the last idle time; a note costs one append."""
        self.dropped = 0
        """Number of blocks for which the recorder had no room."""
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
        """Send first the values from which the core was made, for replay."""
        self._channel.send(HEADER, as_json({"side": self._side, **header}))

    def idle(self, now_s: float, status: Callable[[], msgspec.Struct] | None = None) -> list[str]:
        """Send the notes, and ten times a second the `status`. Return lines for a person."""
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
        """Record a view payload."""
        self._channel.send(VIEW, stamped(now_s), payload)

    def facts(self, now_s: float, facts: msgspec.Struct) -> None:
        """Record the facts that the operator side showed at one moment."""
        self._channel.send(FACTS, stamped(now_s), msgspec.json.encode(facts))

    def note(self, text: str) -> None:
        """Record a line that is shown to a person now."""
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
                self._notes.append(f"the recorder is gone, and nothing more is recorded; {self._kept()}")

    def _kept(self) -> str:
        return f"kept: {self._said['kept_s']:.1f} s, {self._said['bytes'] / 1e6:.1f} MB"

    def close(self) -> dict[str, Any]:
        """Send the rest and let the recorder finish; return figures of the file for the summary.

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
    """Open a recording, unless `path` is None; it ends with the context."""
    recording = None if path is None else SideRecording(path, side, encoder)
    try:
        yield recording
    finally:
        if recording is not None:
            recording.close()


class Recorder:
    """Recorder process that writes one file: for one side, or for all that connect to `socket_path`."""

    def __init__(self, path: Path, socket_path: Path | None = None) -> None:
        """Start the process and wait for the file; raises ConfigurationError if it cannot be made."""
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
        """Process id."""
        return self._companion.process_id

    def finish(self) -> dict[str, Any]:
        """Finish the file once every side has ended; return its figures."""
        said, ended = dict(_NOTHING), False
        # Read its earlier messages first: a send to an ended process would lose them.
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
        """Release the process: it ends by itself once all channels are closed."""
        # On a busy machine it may still have much to write: killing it would lose the end of the run.
        self._companion.close(_FINISH_LIMIT_S)


def connect(path: Path) -> tuple[Channel, Recorder | None]:
    """Connect to the recorder that listens at the socket `path`, or to a new one that writes the file `path`."""
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
    """Send the waiting messages; give up when none leaves for `limit_s`."""
    while channel.waiting and not channel.ended:
        if not select.select([], [channel], [], limit_s)[1]:
            return
        channel.flush()


def _wait_for_answer(channel: Channel, limit_s: float) -> bytes | None:
    """Return the newest message from the other end; None if it is gone or silent."""
    while not channel.ended and select.select([channel], [], [], limit_s)[0]:
        if messages := channel.receive():
            return messages[-1]
    return None
