"""Messages that a port holds until the process that ticks asks for them: the newest ones, never a queue."""

from common.sockets.driver_port import Received

MOST_PEERS = 2
EACH = 2
"""Number of peers whose messages are held, and of messages of each: a picture of each of two views"""


class Held:
    """Newest messages of the peers that were heard last; others are dropped unread."""

    def __init__(self) -> None:
        self._asked = False
        self._newest: dict[bytes, list[Received]] = {}
        """Messages of each peer, the one that was heard last at the end"""

    def add(self, received: list[Received]) -> list[Received]:
        """Take messages that have arrived; return those to pass on now, which are some only if they were asked for."""
        for message in received:
            mine = [*self._newest.pop(message.peer, []), message]
            self._newest[message.peer] = mine[-EACH:]
        while len(self._newest) > MOST_PEERS:
            del self._newest[next(iter(self._newest))]
        return self._pass()

    def ask(self) -> list[Received]:
        """Ask once; return what is held. If nothing is, the next messages to arrive are passed on."""
        self._asked = True
        return self._pass()

    def _pass(self) -> list[Received]:
        if not (self._asked and self._newest):
            return []
        passed = [message for mine in self._newest.values() for message in mine]
        self._newest, self._asked = {}, False
        return passed
