"""Receiving of messages from one ZeroMQ socket: polled as seldom as possible, read frame by frame."""

import select
from collections.abc import Iterator

import zmq

from common.sockets.readable import readable

MESSAGES_PER_RECEIVE = 64
"""Maximum number of messages per `read`, so that a flood cannot block the caller."""
_NOBLOCK = int(zmq.NOBLOCK)


class Inbox:
    """Receiver of the messages of one ZeroMQ socket.

    The socket's descriptor signals only changes, and any call on the socket clears the signal. So only the option
    EVENTS tells whether a message waits, but reading it takes four times as long as polling the descriptor. Once EVENTS
    has said that none waits, it is read again only when the descriptor signals or other code has used the socket
    (`used`).
    """

    def __init__(self, part: "zmq.Socket[bytes]", frames: int) -> None:
        """Receive from the socket `part`, whose valid messages have `frames` frames."""
        self.descriptor = part.fileno()
        self._part = part
        self._frames = frames
        self._begun: list[zmq.Frame] = []
        self._signals = select.poll()
        self._signals.register(self.descriptor, select.POLLIN)
        self._settled = False
        self._waiting = False
        """Whether EVENTS said that a message waits, and none has been read since."""

    def has_some(self) -> bool:
        """Return whether a frame can be received at once."""
        if self._waiting or (self._settled and not self._signals.poll(0)):
            return self._waiting
        self._waiting = readable(self._part)
        self._settled = not self._waiting
        return self._waiting

    def used(self) -> None:
        """Note that the socket was used otherwise: a call such as sending may have cleared the signal of an arrival."""
        self._settled = False

    def read(self) -> Iterator[list[zmq.Frame]]:
        """Yield the messages that have arrived, oldest first. Of a longer message only one frame too many is kept.

        Reads frame by frame, so that a message of a million frames does not block the caller.
        """
        more = bool(self._begun)
        for _ in range(MESSAGES_PER_RECEIVE * self._frames):
            # Checked first: an exception takes four times as long.
            if not more and not self.has_some():
                return
            self._waiting = False
            try:
                frame = self._part.recv(_NOBLOCK, copy=False)
            except zmq.Again:
                return
            if len(self._begun) <= self._frames:
                self._begun.append(frame)
            more = frame.more
            if not more:
                message, self._begun = self._begun, []
                yield message
