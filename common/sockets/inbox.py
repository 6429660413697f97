"""What has arrived at one socket: asked for as seldom as it can be, read frame by frame."""

import select
from collections.abc import Iterator

import zmq

from common.sockets.readable import readable

MESSAGES_PER_RECEIVE = 64
"""At most so many messages in one call of `receive`, so that a flood cannot hold the caller."""
_NOBLOCK = int(zmq.NOBLOCK)


class Inbox:
    """One socket's receiving side.

    Its descriptor signals changes only, and only until somebody asks the socket anything: EVENTS has the last word.
    Asking for EVENTS takes four times as long as looking at the descriptor, so that is done only where it may have
    news: from the moment that EVENTS said no until the descriptor signals, or somebody else uses the socket.
    """

    def __init__(self, part: "zmq.Socket[bytes]", frames: int) -> None:
        """`part` carries messages of so many frames."""
        self.descriptor = part.fileno()
        self._part = part
        self._frames = frames
        self._begun: list[zmq.Frame] = []
        self._signals = select.poll()
        self._signals.register(self.descriptor, select.POLLIN)
        self._settled = False
        self._waiting = False
        """Whether EVENTS said yes, and nothing has been read since."""

    def has_some(self) -> bool:
        """Whether something can be received at once."""
        if self._waiting or (self._settled and not self._signals.poll(0)):
            return self._waiting
        self._waiting = readable(self._part)
        self._settled = not self._waiting
        return self._waiting

    def used(self) -> None:
        """Somebody else has used the socket: sending may have taken the signal of what came meanwhile."""
        self._settled = False

    def read(self) -> Iterator[list[zmq.Frame]]:
        """What has arrived, oldest first, each at most one frame longer than it should be.

        Frame by frame: one of a million frames must not hold the caller either.
        """
        more = bool(self._begun)
        for _ in range(MESSAGES_PER_RECEIVE * self._frames):
            # Asked first: an exception takes four times as long.
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
