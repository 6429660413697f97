"""Monitoring of a bound socket: when connections begin and end."""

import resource

import zmq
from zmq.utils.monitor import parse_monitor_message

from common.sockets.descriptors import hold_little
from common.sockets.port_connections import PortConnections
from common.sockets.readable import readable


class Gate:
    """Monitor of one socket's connections, to find those beyond the limit. Make it before the socket is bound."""

    def __init__(
        self,
        context: "zmq.Context[zmq.Socket[bytes]]",
        part: "zmq.Socket[bytes]",
        most: int,
        introduced_s: float,
        unsent_bytes: int,
    ) -> None:
        """Allow `most` connections, but no more than a quarter of the descriptors that this process may open.

        `introduced_s`: as in PortConnections. `unsent_bytes`: as in hold_little.
        """
        self._part = part
        self._unsent_bytes = unsent_bytes
        self.connections = PortConnections(min(most, resource.getrlimit(resource.RLIMIT_NOFILE)[0] // 4), introduced_s)
        address = f"inproc://gate-{id(part)}"
        part.monitor(address, zmq.EVENT_ACCEPTED | zmq.EVENT_DISCONNECTED)
        self.events = context.socket(zmq.PAIR)
        """Socket on which ZeroMQ reports events. Only Gate reads it, so that its descriptor signals each new event."""
        self.events.setsockopt(zmq.RCVHWM, 0)  # at a mark ZeroMQ's thread would wait for us
        self.events.connect(address)

    def poll(self, now_s: float) -> bool:
        """Process the next begin or end of a connection; return False if there is none. Never blocks."""
        if not readable(self.events):
            return False
        event = parse_monitor_message(self.events.recv_multipart())
        if event["event"] == zmq.EVENT_ACCEPTED:
            self.connections.accepted(event["value"], now_s)
            hold_little(event["value"], self._unsent_bytes)
        else:
            self.connections.ended(event["value"])
        return True

    def close(self) -> None:
        """Stop watching; call before the watched socket is closed."""
        # In this order: ZeroMQ's thread would block forever on an event for a closed watcher.
        self._part.disable_monitor()
        self.events.close(linger=0)
