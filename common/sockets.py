"""The only module that knows ZeroMQ: a control and a view socket for each of the two processes.

Control (ROUTER and DEALER) carries small messages both ways, view (PUB and SUB) frames and telemetry to
the operator, apart so that a frame never delays a stiffness. No call but `wait` blocks; a message that cannot
leave now is dropped and counted, because a newer one follows. A shell belongs to one thread.
"""

import os
import select
from collections.abc import Sequence
from types import TracebackType
from typing import Self

import zmq

from common.clock import MonotonicClock
from common.endpoints import Endpoint, following, parse_bind, parse_connect
from common.errors import ConfigurationError

CONTROL_HIGH_WATER_MARK = 16
"""Control messages that wait to leave for each peer: a burst after a hiccup of 16 ms at 1 kHz passes whole.

With 2, half of a burst of five was lost, and a peer that stood still got no fewer stale ones: those wait in
the kernel's buffers, until the heartbeat ends the connection.
"""
VIEW_HIGH_WATER_MARK = 8
"""View messages that wait on either side: both cameras' frames, telemetry, and as many again."""
RECEIVE_HIGH_WATER_MARK = 100_000
"""Control messages that wait to be received: out of reach for whoever drains once per tick.

A low mark would not keep them fresh (the kernel's buffers hold thousands more, and a drain would end at the
mark instead of at the newest), and libzmq up to 4.3.5 aborts the process when a socket at its mark finds a
heartbeat before the end of the connection (libzmq issues 3937, 4364 and 4767).
"""
CONTROL_LIMIT_BYTES = 64 * 1024
VIEW_LIMIT_BYTES = 4 * 1024 * 1024
MESSAGES_PER_RECEIVE = 1000
"""At most so many messages in one call of `receive`, so that a flood cannot hold the caller."""


class _Sockets:
    """What both processes' shells have in common: the context, two sockets, waiting and closing."""

    def __init__(self, control_type: int, view_type: int, heartbeat_timeout_s: float) -> None:
        if not 0.03 <= heartbeat_timeout_s <= 60.0:
            raise ValueError(f"heartbeat_timeout_s = {heartbeat_timeout_s}; valid: 0.03 to 60 seconds")
        self.dropped = 0
        """Messages that could not leave at once: the peer is gone, or does not keep up."""
        self.rejected = 0
        """Messages received with a wrong number of frames."""
        self._clock = MonotonicClock()
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._control = self._context.socket(control_type)
        self._view = self._context.socket(view_type)
        self._control.setsockopt(zmq.SNDHWM, CONTROL_HIGH_WATER_MARK)
        self._control.setsockopt(zmq.RCVHWM, RECEIVE_HIGH_WATER_MARK)
        self._control.setsockopt(zmq.MAXMSGSIZE, CONTROL_LIMIT_BYTES)
        timeout_ms = round(1e3 * heartbeat_timeout_s)
        self._control.setsockopt(zmq.HEARTBEAT_IVL, timeout_ms // 3)
        self._control.setsockopt(zmq.HEARTBEAT_TIMEOUT, timeout_ms)
        self._control.setsockopt(zmq.HEARTBEAT_TTL, timeout_ms * 4 // 3)
        self._view.setsockopt(zmq.SNDHWM, VIEW_HIGH_WATER_MARK)
        self._view.setsockopt(zmq.RCVHWM, VIEW_HIGH_WATER_MARK)
        self._view.setsockopt(zmq.MAXMSGSIZE, VIEW_LIMIT_BYTES)
        # Not heartbeats: a viewer may well stay at its mark, and a frame can hold up an answer for long.
        self._view.setsockopt(zmq.TCP_KEEPALIVE, 1)
        self._view.setsockopt(zmq.TCP_KEEPALIVE_IDLE, 1)
        self._view.setsockopt(zmq.TCP_KEEPALIVE_INTVL, 1)
        self._view.setsockopt(zmq.TCP_KEEPALIVE_CNT, 3)
        for part in (self._control, self._view):
            part.setsockopt(zmq.LINGER, 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close at once, whatever has not left yet; closing twice does no harm."""
        self._context.destroy(linger=0)

    def _wait(self, timeout_s: float | None, awaited: Sequence["zmq.Socket[bytes]"]) -> bool:
        """Whether one of `awaited` has something before the time is up.

        zmq's own poll counts whole milliseconds, hence select on the sockets' descriptors. These signal only
        changes, and only until EVENTS is read: it has the last word before and after each select.
        """
        if timeout_s is not None and not timeout_s >= 0.0:
            raise ValueError(f"timeout_s = {timeout_s}; valid: 0 or more seconds, or None for no limit")
        descriptors = [part.fileno() for part in awaited]
        deadline_s = None if timeout_s is None else self._clock.now() + timeout_s
        while not any(_readable(part) for part in awaited):
            remaining_s = None
            if deadline_s is not None:
                remaining_s = deadline_s - self._clock.now()
                if remaining_s <= 0.0:
                    return False
            select.select(descriptors, [], [], remaining_s)
        return True

    def _drain(self, part: "zmq.Socket[bytes]", frames: int) -> list[list[bytes]]:
        """What has arrived, oldest first; messages of another number of frames are rejected and counted."""
        received: list[list[bytes]] = []
        for _ in range(MESSAGES_PER_RECEIVE):
            try:
                message = part.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                break
            if len(message) == frames:
                received.append(message)
            else:
                self.rejected += 1
        return received

    def _send(self, part: "zmq.Socket[bytes]", frames: list[bytes], limit_bytes: int) -> bool:
        if len(frames[-1]) > limit_bytes:
            raise ValueError(f"payload of {len(frames[-1])} bytes; valid: up to {limit_bytes} bytes")
        for _ in range(2):
            try:
                part.send_multipart(frames, zmq.NOBLOCK)
            except zmq.Again:
                # The socket may only not have noticed yet what has left: that happens when EVENTS is read.
                part.getsockopt(zmq.EVENTS)
            except zmq.ZMQError as error:
                if error.errno != zmq.EHOSTUNREACH:
                    raise
                break
            else:
                return True
        self.dropped += 1
        return False


class RobotSockets(_Sockets):
    """The robot side's end: it binds, and tells its peers apart."""

    def __init__(
        self,
        bind: str,
        view_bind: str | None = None,
        *,
        insecure: bool = False,
        heartbeat_timeout_s: float = 3.0,
    ) -> None:
        """Bind control to `bind` and view to `view_bind`, by default the port after.

        A silent connection ends after `heartbeat_timeout_s`, which must exceed the link's real one-way delay.
        ConfigurationError when an address is malformed, in use, not this machine's, or open to the network
        without `insecure`, as there are no keys yet.
        """
        control = parse_bind(bind, "--bind")
        view = following(control, bind, "--view-bind") if view_bind is None else parse_bind(view_bind, "--view-bind")
        if not insecure:
            _refuse_open(control, bind, "--bind")
            _refuse_open(view, view_bind or bind, "--view-bind")
        super().__init__(zmq.ROUTER, zmq.PUB, heartbeat_timeout_s)
        try:
            self._control.setsockopt(zmq.ROUTER_MANDATORY, 1)
            # What viewers send, subscriptions, is little, but hitting the mark could end the process.
            self._view.setsockopt(zmq.RCVHWM, RECEIVE_HIGH_WATER_MARK)
            _bind(self._control, control, "--bind")
            _bind(self._view, view, "--view-bind")
        except BaseException:
            self.close()
            raise

    @property
    def control_endpoint(self) -> str:
        """The address that control is bound to, with the port that the system chose."""
        return self._control.getsockopt_string(zmq.LAST_ENDPOINT)

    @property
    def view_endpoint(self) -> str:
        """The address that view is bound to, with the port that the system chose."""
        return self._view.getsockopt_string(zmq.LAST_ENDPOINT)

    def receive(self) -> list[tuple[bytes, bytes]]:
        """(peer, payload) of every control message that has arrived, oldest first."""
        return [(peer, payload) for peer, payload in self._drain(self._control, 2)]

    def send(self, peer: bytes, payload: bytes) -> bool:
        """Send to `peer`; False, and counted in `dropped`, when it is gone or does not keep up.

        ValueError for more than CONTROL_LIMIT_BYTES.
        """
        return self._send(self._control, [peer, payload], CONTROL_LIMIT_BYTES)

    def publish(self, topic: bytes, payload: bytes) -> None:
        """Send to whoever subscribed to `topic`; a viewer that does not keep up loses it, alone.

        ValueError for more than VIEW_LIMIT_BYTES.
        """
        self._send(self._view, [topic, payload], VIEW_LIMIT_BYTES)

    def wait(self, timeout_s: float | None) -> bool:
        """Wait for a control message, at most `timeout_s` (None: no limit); whether there is one."""
        return self._wait(timeout_s, [self._control])


class OperatorSockets(_Sockets):
    """The operator side's end: it connects, and reconnects by itself."""

    def __init__(
        self,
        connect: str,
        view_connect: str | None = None,
        *,
        topics: Sequence[bytes] = (b"",),
        heartbeat_timeout_s: float = 3.0,
    ) -> None:
        """Connect control to `connect` and view to `view_connect`, by default the port after.

        `topics` are prefixes of the topics to receive; the empty one means all. The robot side need not be
        there yet. `heartbeat_timeout_s` as in RobotSockets. ConfigurationError when an address is malformed
        or its host unknown.
        """
        control = parse_connect(connect, "--connect")
        view = (
            following(control, connect, "--view-connect")
            if view_connect is None
            else parse_connect(view_connect, "--view-connect")
        )
        super().__init__(zmq.DEALER, zmq.SUB, heartbeat_timeout_s)
        try:
            # Nothing is queued for a robot that is not there: it would be replayed when it comes back.
            self._control.setsockopt(zmq.IMMEDIATE, 1)
            for topic in topics:
                self._view.setsockopt(zmq.SUBSCRIBE, topic)
            _connect(self._control, control, "--connect")
            _connect(self._view, view, "--view-connect")
        except BaseException:
            self.close()
            raise

    def receive(self) -> list[bytes]:
        """Every control message that has arrived, oldest first."""
        return [payload for (payload,) in self._drain(self._control, 1)]

    def receive_view(self) -> list[tuple[bytes, bytes]]:
        """(topic, payload) of every view message that has arrived, oldest first."""
        return [(topic, payload) for topic, payload in self._drain(self._view, 2)]

    def send(self, payload: bytes) -> bool:
        """Send to the robot side; False, and counted in `dropped`, when it is gone or does not keep up.

        ValueError for more than CONTROL_LIMIT_BYTES.
        """
        return self._send(self._control, [payload], CONTROL_LIMIT_BYTES)

    def wait(self, timeout_s: float | None) -> bool:
        """Wait for a control or view message, at most `timeout_s` (None: no limit); whether there is one."""
        return self._wait(timeout_s, [self._control, self._view])


def _readable(part: "zmq.Socket[bytes]") -> bool:
    return bool(int(part.getsockopt(zmq.EVENTS)) & zmq.POLLIN)


def _refuse_open(endpoint: Endpoint, text: str, flag: str) -> None:
    if not endpoint.is_loopback():
        raise ConfigurationError(
            f"{flag}: {text!r} would be open to anyone on the network, as keys (CURVE) are not supported yet; "
            "valid: a loopback address such as tcp://127.0.0.1:5555, or --insecure"
        )


def _bind(part: "zmq.Socket[bytes]", endpoint: Endpoint, flag: str) -> None:
    part.setsockopt(zmq.IPV6, endpoint.ipv6)
    try:
        part.bind(endpoint.address)
    except zmq.ZMQError as error:
        if error.errno == zmq.EADDRINUSE:
            other = Endpoint(endpoint.host, endpoint.port + 2 if endpoint.port < 65000 else 5555, endpoint.ipv6)
            advice = f"the port is in use; valid: another one such as {other.address}"
        else:
            advice = f"{os.strerror(error.errno or 0)}; valid: an address of this machine such as tcp://127.0.0.1:5555"
        raise ConfigurationError(f"{flag}: cannot bind {endpoint.address}: {advice}") from error


def _connect(part: "zmq.Socket[bytes]", endpoint: Endpoint, flag: str) -> None:
    part.setsockopt(zmq.IPV6, endpoint.ipv6)
    try:
        part.connect(endpoint.address)
    except zmq.ZMQError as error:
        raise ConfigurationError(
            f"{flag}: cannot connect to {endpoint.address}: {os.strerror(error.errno or 0)}; valid: tcp://HOST:PORT"
        ) from error
