"""Base of both sides' sockets: options, waiting, sending, closing."""

import os
import select
from collections.abc import Sequence
from typing import Self

import zmq

from common.clock import MonotonicClock
from common.errors import ConfigurationError
from common.sockets.authentication import Authenticator
from common.sockets.endpoints import Endpoint
from common.sockets.gate import Gates
from common.sockets.inbox import Inbox
from common.sockets.readable import EVENTS
from common.sockets.round_robin import Offered

CONTROL_HIGH_WATER_MARK = 2
"""Length of the send queue of each control connection, in messages. Four connections take a burst of eight messages."""
VIEW_HIGH_WATER_MARK = 8
"""Length of the view's queue at either side, in messages: enough for both cameras' pictures, the scene and the
telemetry of one tick. ZeroMQ frees places only in steps of half the mark. A length of 4 lost the telemetry; 2 lost the
scene, too."""
CONTROL_UNSENT_BYTES = 1024
"""Maximum number of unsent bytes of each control connection in the kernel: a few messages."""
VIEW_UNSENT_BYTES = 16 * 1024
RECEIVE_HIGH_WATER_MARK = 100_000
"""Length of a connected control socket's receive queue, in messages: never reached by a caller that empties it each
turn. A low mark would not keep messages fresh: the kernel's buffers hold thousands more."""
_WITHOUT_LIMIT = 0
"""Length of a bound socket's receive queue: peers are cut off by rate and by bytes, and the process has a limit of
memory. libzmq up to 4.3.5 aborts the process when a socket at its mark finds a heartbeat, or the end of the connection,
before it has room again (libzmq issues 3937, 4364 and 4767)."""
CONTROL_LIMIT_BYTES = 4096
"""Largest control payload, in bytes; the codec decodes no larger one."""
VIEW_LIMIT_BYTES = 4 * 1024 * 1024
_CONTROL_THREAD, _VIEW_THREAD = 0b01, 0b10
"""Masks that assign sockets to ZeroMQ's I/O threads (option AFFINITY)."""
_NOBLOCK, _NOBLOCK_AND_MORE = int(zmq.NOBLOCK), int(zmq.NOBLOCK | zmq.SNDMORE)


class SocketShell:
    """ZeroMQ context of one side's sockets; no call but `wait_for` blocks."""

    def __init__(self, heartbeat_timeout_s: float, handshake_limit_s: float) -> None:
        """A connection ends after `heartbeat_timeout_s` of silence, or `handshake_limit_s` without a handshake."""
        if not 0.03 <= heartbeat_timeout_s <= 60.0:
            raise ValueError(f"heartbeat_timeout_s = {heartbeat_timeout_s}; valid: 0.03 to 60 seconds")
        self.dropped = 0
        """Number of messages dropped because they could not leave at once: the peer is gone, or does not keep up."""
        self.rejected = 0
        """Number of received messages that had a wrong number of frames."""
        self._clock = MonotonicClock()
        self._inbox: Inbox
        self._ports = Gates([])
        self._authenticator: Authenticator | None = None
        # A thread each: each connection of the view resolves its host's name, and a silent name server blocks the
        # thread that asks.
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context(io_threads=2)
        self._heartbeat_ms = round(1e3 * heartbeat_timeout_s)
        self._handshake_ms = round(1e3 * handshake_limit_s)

    def _open_control(self, control_type: int) -> "zmq.Socket[bytes]":
        part = self._context.socket(control_type)
        for option, value in (
            (zmq.AFFINITY, _CONTROL_THREAD),
            (zmq.SNDHWM, CONTROL_HIGH_WATER_MARK),
            (zmq.RCVHWM, _WITHOUT_LIMIT if control_type == zmq.ROUTER else RECEIVE_HIGH_WATER_MARK),
            (zmq.MAXMSGSIZE, CONTROL_LIMIT_BYTES),
            (zmq.HEARTBEAT_IVL, self._heartbeat_ms // 3),
            (zmq.HEARTBEAT_TIMEOUT, self._heartbeat_ms),
            (zmq.HEARTBEAT_TTL, self._heartbeat_ms * 4 // 3),
            (zmq.HANDSHAKE_IVL, self._handshake_ms),
            (zmq.LINGER, 0),
        ):
            part.setsockopt(option, value)
        return part

    def _open_view(self, view_type: int) -> "zmq.Socket[bytes]":
        part = self._context.socket(view_type)
        publishes = view_type == zmq.XPUB
        for option, value in (
            (zmq.AFFINITY, _VIEW_THREAD),
            (zmq.SNDHWM, VIEW_HIGH_WATER_MARK),
            (zmq.RCVHWM, _WITHOUT_LIMIT if publishes else VIEW_HIGH_WATER_MARK),
            (zmq.MAXMSGSIZE, CONTROL_LIMIT_BYTES if publishes else VIEW_LIMIT_BYTES),
            # No heartbeats: a viewer may stay at its mark, and a frame can delay an answer for long.
            (zmq.TCP_KEEPALIVE, 1),
            (zmq.TCP_KEEPALIVE_IDLE, 1),
            (zmq.TCP_KEEPALIVE_INTVL, 1),
            (zmq.TCP_KEEPALIVE_CNT, 3),
            (zmq.HANDSHAKE_IVL, self._handshake_ms),
            (zmq.LINGER, 0),
        ):
            part.setsockopt(option, value)
        return part

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close at once and drop unsent messages; closing twice does no harm."""
        self._context.destroy(linger=0)

    @property
    def descriptors(self) -> list[int]:
        """Descriptors of a bound socket to wait for, once `pending` has returned False."""
        served = [] if self._authenticator is None else [self._authenticator.fileno()]
        return [self._inbox.descriptor, *served, *(gate.events.fileno() for gate in self._ports.gates)]

    @property
    def refused(self) -> int:
        """Number of handshakes with a key that is not allowed."""
        return 0 if self._authenticator is None else self._authenticator.refused

    def begin_window(self) -> set[str]:
        """Count the handshakes of each key at a bound socket anew; return the keys that had too many."""
        return set() if self._authenticator is None else self._authenticator.begin_window()

    def take_refusals(self) -> list[tuple[str, str]]:
        """Return the keys that a bound socket has refused for the first time since the last call, with addresses."""
        if self._authenticator is None:
            return []
        refusals, self._authenticator.refusals = self._authenticator.refusals, []
        return refusals

    @property
    def heavy(self) -> int:
        """Number of connections to a bound socket that were ended because they sent too many bytes."""
        return self._ports.heavy

    def pending(self) -> bool:
        """Answer handshakes at a bound socket; return whether anything waits to be received."""
        return (self._authenticator is not None and self._authenticator.serve()) or self._inbox.has_some()

    def wait_for(self, timeout_s: float | None, awaited: Sequence[Inbox], served: Authenticator | None = None) -> bool:
        """Wait at most `timeout_s` for a message in one of `awaited`; return whether there is one.

        Meanwhile answer the handshakes of `served`. Uses select on the descriptors, because zmq's poll counts whole
        milliseconds.
        """
        if timeout_s is not None and not timeout_s >= 0.0:
            raise ValueError(f"timeout_s = {timeout_s}; valid: 0 or more seconds, or None for no limit")
        remaining_s, deadline_s = timeout_s, None
        while True:
            pending = served is not None and served.serve()
            for inbox in awaited:
                if inbox.has_some():
                    return True
            if remaining_s is not None:
                if remaining_s <= 0.0:
                    return False
                if deadline_s is None:
                    deadline_s = self._clock.now() + remaining_s
            descriptors = [inbox.descriptor for inbox in awaited]
            if served is not None:
                descriptors.append(served.fileno())
            signalled, _, _ = select.select(descriptors, [], [], 0.0 if pending else remaining_s)
            if not signalled and not pending:
                return False
            if deadline_s is not None:
                remaining_s = deadline_s - self._clock.now()

    def offer(self, part: "zmq.Socket[bytes]", *frames: bytes) -> Offered:
        """Send one message of `frames` over the socket `part` without waiting."""
        for _ in range(2):
            try:
                for frame in frames[:-1]:
                    part.send(frame, _NOBLOCK_AND_MORE)
                part.send(frames[-1], _NOBLOCK)
            except zmq.Again:
                # The queue may be emptier than the socket knows: it counts sent messages when EVENTS is read.
                part.getsockopt(EVENTS)
            except zmq.ZMQError as error:
                if error.errno != zmq.EHOSTUNREACH:
                    raise
                return Offered.GONE
            else:
                return Offered.TAKEN
        return Offered.FULL


def check_size(payload: bytes, limit_bytes: int) -> None:
    """Raise ValueError if the payload is too long to send."""
    if len(payload) > limit_bytes:
        raise ValueError(f"the payload has {len(payload)} bytes; valid: up to {limit_bytes} bytes")


def bind_socket(part: "zmq.Socket[bytes]", endpoint: Endpoint, flag: str) -> None:
    """Bind the socket `part`; if that fails, raises ConfigurationError with one line that names `flag`."""
    part.setsockopt(zmq.IPV6, endpoint.ipv6)
    try:
        part.bind(endpoint.address)
    except zmq.ZMQError as error:
        if error.errno == zmq.EADDRINUSE:
            other = Endpoint(endpoint.host, endpoint.port + 2 if endpoint.port < 65000 else 5555, endpoint.ipv6)
            advice = f"the port is in use; valid: another address, such as {other.address}"
        else:
            advice = f"{os.strerror(error.errno or 0)}; valid: an address of this machine such as tcp://127.0.0.1:5555"
        raise ConfigurationError(f"{flag}: cannot bind {endpoint.address}: {advice}") from error


def connect_socket(part: "zmq.Socket[bytes]", endpoint: Endpoint, flag: str) -> None:
    """Connect the socket `part`, now or when the other side runs. ConfigurationError names `flag` if it never can."""
    part.setsockopt(zmq.IPV6, endpoint.ipv6)
    try:
        part.connect(endpoint.address)
    except zmq.ZMQError as error:
        raise ConfigurationError(
            f"{flag}: cannot connect to {endpoint.address}: {os.strerror(error.errno or 0)}; valid: tcp://HOST:PORT"
        ) from error
