"""Who comes to a bound socket and who goes."""

import resource

import zmq
from zmq.utils.monitor import parse_monitor_message

from common.sockets.crowd import Crowd
from common.sockets.descriptors import hold_little
from common.sockets.readable import readable


class Gate:
    """Watches the connections to one bound socket, to tell which are too many; before it is bound."""

    def __init__(
        self,
        context: "zmq.Context[zmq.Socket[bytes]]",
        part: "zmq.Socket[bytes]",
        most: int,
        introduced_s: float,
        unsent_bytes: int,
    ) -> None:
        """At most `most` connections, and never more than a quarter of the descriptors that this process may open.

        `introduced_s` as for Crowd, `unsent_bytes` as for hold_little.
        """
        self._part = part
        self._unsent_bytes = unsent_bytes
        self.crowd = Crowd(min(most, resource.getrlimit(resource.RLIMIT_NOFILE)[0] // 4), introduced_s)
        address = f"inproc://gate-{id(part)}"
        part.monitor(address, zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED)
        self.events = context.socket(zmq.PAIR)
        """Where ZeroMQ tells it; nobody else asks it anything, so that its descriptor tells all that is new."""
        self.events.setsockopt(zmq.RCVHWM, 0)  # at a mark ZeroMQ's own thread would wait for us
        self.events.connect(address)

    def look(self, now_s: float) -> bool:
        """Take note of the next that has come or gone; False when there is none; never blocks."""
        if not readable(self.events):
            return False
        event = parse_monitor_message(self.events.recv_multipart())
        if event["event"] == zmq.EVENT_ACCEPTED:
            self.crowd.came(event["value"], now_s)
            hold_little(event["value"], self._unsent_bytes)
        else:
            self.crowd.went(event["value"])
        return True

    def close(self) -> None:
        """Look no more; before the watched socket is closed."""
        # In this order: ZeroMQ's own thread would wait forever to tell an event to a watcher that is gone.
        self._part.disable_monitor()
        self.events.close(linger=0)
