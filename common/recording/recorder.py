"""Recorder process: receives the sides' events, decodes them for people, and writes the file.

    python -m common.recording.recorder FD FILE.mcap [SOCKET]

FD is the channel to the process that started it; at SOCKET other sides connect. It runs until all these channels have
ended, even if the processes were killed. Every 0.75 s all events received so far are written completely to the file.
"""

import os
import select
import signal
import socket
import struct
import sys
from pathlib import Path
from typing import Final

from common.clock import MonotonicClock, wall_clock_offset_s
from common.companion.channel import Channel
from common.companion.process import companion_channel
from common.recording.content import Content
from common.recording.mcap_file import RecordingFile
from common.recording.wire import END, as_json

FLUSH_PERIOD_S: Final = 0.75
"""Time between flushes, in seconds. With the 40 ms of a block, at most a second is lost, even on a loaded machine."""
_NICENESS: Final = 5
_SIDES_LIMIT: Final = 8


def main() -> None:
    """Run the recorder until all channels have ended."""
    owner, arguments = companion_channel(sys.argv[1:])
    # A file at its size limit is an error to report, and must not end the process.
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    os.nice(_NICENESS)
    try:
        file = RecordingFile(Path(arguments[0]), wall_clock_offset_s())
    except OSError as error:
        owner.send(as_json({"error": error.strerror}))
        return
    listener = None
    if len(arguments) > 1:
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        listener.bind(arguments[1])
        listener.listen(_SIDES_LIMIT)
    owner.send(as_json(file.figures()))
    _Writer(file, owner, listener).run()


class _Writer:
    def __init__(self, file: RecordingFile, owner: Channel, listener: socket.socket | None) -> None:
        self._file = file
        self._owner = owner
        self._listener = listener
        self._content = Content(file)
        self._open = [owner]
        self._through: list[Channel] = []
        self._clock = MonotonicClock()

    def run(self) -> None:
        flush_s = self._clock.now() + FLUSH_PERIOD_S
        try:
            while self._open:
                self._wait(max(0.0, flush_s - self._clock.now()))
                for channel in tuple(self._open):
                    self._take(channel)
                self._open = [one for one in self._open if not one.ended and one not in self._through]
                if self._through or self._clock.now() >= flush_s:
                    flush_s = self._clock.now() + FLUSH_PERIOD_S
                    if self._open:
                        self._file.flush()
                        self._tell()
        finally:
            self._file.close()
            self._tell()

    def _wait(self, limit_s: float) -> None:
        waited: list[Channel | socket.socket] = [*self._open]
        if self._listener is not None and self._owner in self._open:
            waited.append(self._listener)
        ready = select.select(waited, [one for one in self._open if one.waiting], [], limit_s)[0]
        if self._listener is not None and self._listener in ready:
            self._open.append(Channel(self._listener.accept()[0]))

    def _take(self, channel: Channel) -> None:
        for message in channel.receive():
            if message == END:
                self._through.append(channel)
                continue
            try:
                self._content.write(id(channel), message)
            except (ValueError, KeyError, TypeError, struct.error) as error:
                # One side's invalid messages must not lose the other's.
                print(
                    f"feelahead recorder: an invalid message is left out of the recording: {error!r}", file=sys.stderr
                )

    def _tell(self) -> None:
        figures = self._file.figures()
        for channel in self._open:
            channel.send(as_json(figures))
        # The owner ends the recording, and gets the answer when the file is finished.
        ended = [one for one in self._through if one is not self._owner or not self._open]
        for channel in ended:
            channel.send(as_json(figures | {"ended": True}))
        self._through = [one for one in self._through if one not in ended]


if __name__ == "__main__":
    main()
