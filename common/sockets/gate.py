"""Monitoring of bound sockets: when connections begin and end, and which are too many or send too much."""

import resource
import select
from collections.abc import Sequence
from typing import Final

import zmq
from zmq.utils.monitor import parse_monitor_message

from common.sockets.descriptors import hold_little, shut_down
from common.sockets.port_connections import PortConnections
from common.sockets.readable import EVENTS, readable
from common.sockets.tcp_figures import received_bytes
from common.sockets.traffic import Traffic

_EVENTS_PER_CALL: Final = 256
"""Maximum number of events of each port per call, 5 us each, so that a storm of connections cannot block the caller."""


class Gate:
    """Monitor of one socket's connections, to find those beyond the limit. Make it before the socket is bound."""

    def __init__(
        self,
        context: "zmq.Context[zmq.Socket[bytes]]",
        part: "zmq.Socket[bytes]",
        most: int,
        introduced_s: float,
        unsent_bytes: int,
        bytes_per_s: float,
        first_bytes: int = 1 << 16,
    ) -> None:
        """Allow `most` connections, but no more than a quarter of the descriptors that this process may open.

        `introduced_s`: as in PortConnections. `unsent_bytes`: as in hold_little. `bytes_per_s`: budget of each;
        `first_bytes`: of one that has not been introduced, in all.
        """
        self.heavy = 0
        """Number of connections that were ended because they sent too many bytes"""
        self._traffic, self._first_bytes = Traffic(bytes_per_s), first_bytes
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

    def cut_off(self, now_s: float) -> tuple[int, int, list[int]]:
        """End connections beyond their budget.

        Return the heaviest one's bytes since the last call and its descriptor, and the descriptors that were ended.
        """
        descriptors = {number: descriptor for descriptor, number in self.connections.numbers().items()}
        received = {number: received_bytes(descriptor) for number, descriptor in descriptors.items()}
        over, new = self._traffic.over(received, now_s)
        ended = {descriptors[number] for number in over}
        ended |= {
            descriptors[number]
            for number, size in received.items()
            if size > self._first_bytes and self.connections.is_new(descriptors[number])
        }
        for descriptor in ended:
            shut_down(descriptor)
        self.heavy += len(ended)
        size, descriptor = max(((size, descriptors[number]) for number, size in new.items()), default=(0, -1))
        return size, descriptor, sorted(ended)

    def close(self) -> None:
        """Stop watching; call before the watched socket is closed."""
        # In this order: ZeroMQ's thread would block forever on an event for a closed watcher.
        self._part.disable_monitor()
        self.events.close(linger=0)


class Gates:
    """Gates of the ports of one process, whose events are processed together.

    A descriptor may belong to another connection by now, even at another port. So its owner is certain only when no
    gate has further events.
    """

    def __init__(self, gates: Sequence[Gate], piling: "Sequence[zmq.Socket[bytes]]" = ()) -> None:
        """piling: sockets whose events pile up until they are used, as they are only sent to."""
        self.gates = list(gates)
        self.all_seen = False
        """Whether all of ZeroMQ's events have been processed, so that descriptors surely belong to their connections"""
        self._piling = piling
        self._comings = select.poll()
        for part in (*piling, *(gate.events for gate in gates)):
            self._comings.register(part.fileno(), select.POLLIN)

    def update(self, now_s: float) -> int:
        """Process begins and ends of connections since the last call; end those beyond the limit, and count them.

        If there are more events than one call processes, no connection is ended.
        """
        if self.all_seen and not self._comings.poll(0):
            return 0
        for part in self._piling:
            part.getsockopt(EVENTS)
        self.all_seen = any(sum(gate.poll(now_s) for gate in self.gates) == 0 for _ in range(_EVENTS_PER_CALL))
        surplus = [each for gate in self.gates for each in gate.connections.surplus(now_s)] if self.all_seen else []
        for descriptor in surplus:
            shut_down(descriptor)
        return len(surplus)

    @property
    def heavy(self) -> int:
        """Number of connections that were ended because they sent too many bytes"""
        return sum(gate.heavy for gate in self.gates)

    def cut_off(self, now_s: float) -> tuple[int, int, list[int]]:
        """Do `Gate.cut_off` for all gates, after `update`."""
        found = [gate.cut_off(now_s) for gate in self.gates] if self.all_seen else []
        size, descriptor = max(((size, descriptor) for size, descriptor, _ in found), default=(0, -1))
        return size, descriptor, [each for _, _, ended in found for each in ended]
