"""Look at the way to a robot side, no farther than to the first thing that is wrong with it.

Harmless to the person who drives: two connections to each port, one after the other, and questions that the robot side
answers without letting anybody in. A Hello would ask for the arm, so none is sent.
"""

import contextlib
import errno
import secrets
import socket
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from typing import Final

from common.clock import MonotonicClock
from common.errors import ConfigurationError, OtherVersionError, RemoteProtocolError
from common.protocol.codec import decode, encode
from common.protocol.messages import AnyMessage, Header, LeaseNotice, MotionCommand, Telemetry
from common.sockets.authentication import OperatorKeys, public_part
from common.sockets.endpoints import Endpoint, following, resolve, split_connect
from common.sockets.greeting import GREETING_BYTES, KNOCK
from common.sockets.operator import OperatorSockets
from feelahead.commands.doctor.link_judgement import CONNECT_LIMIT_S, LinkFacts, Opening, Talk, judge

_ROUND_TRIPS: Final = 20
_MEASURE_S: Final = 5.0
"""A long way allows fewer round trips."""
_PAUSE_S: Final = 0.11
"""The robot side answers strangers ten times a second."""
_KNOCKS: Final = ((KNOCK, 2.0), (b"\r\n\r\n", 1.0))
"""Words for a port, and how long it may stay silent after them beside the round trips. Some wait for a line's end."""
_TELEMETRY_LIMIT_S: Final = 2.0
_ANSWER_LIMIT_S: Final = 2.5
_HANDSHAKE_LIMIT_S: Final = 4.0
"""Less than the 5 s after which a robot side hangs up: what ends earlier was refused."""
_STEP_S: Final = 0.05
_LARGE: Final = bytes(4000)
"""No message; three packets of full size."""
_LARGE_LIMIT_S: Final = 2.5
_MOST_LOST: Final = 2
"""Answers, where links are emulated, or where other strangers ask."""


@dataclass(frozen=True)
class Way:
    """The address of a robot side, and the keys to it."""

    connect: str
    view_connect: str | None = None
    keys: OperatorKeys | None = None

    def ports(self) -> tuple[Endpoint, Endpoint]:
        """Control and view; ConfigurationError for what is no address."""
        control = Endpoint(*split_connect(self.connect, "--connect"), ipv6=False)
        if self.view_connect is None:
            return control, following(control, self.connect, "--view-connect")
        return control, Endpoint(*split_connect(self.view_connect, "--view-connect"), ipv6=False)


def look_along(way: Way) -> LinkFacts:
    """Everything up to the first thing that is wrong; ConfigurationError for what is no address."""
    control, view = way.ports()
    ours = None if way.keys is None else public_part(way.keys.secret)
    facts = LinkFacts(_place(control), _place(view), keys=ours)
    with contextlib.closing(_looks(way, facts, control, view)) as looks:
        for known in looks:
            facts = known
            if judge(facts) is not None:
                break
    return facts


def _looks(way: Way, facts: LinkFacts, control: Endpoint, view: Endpoint) -> Generator[LinkFacts]:
    """Yield the facts after each look. Each look needs the ones before."""
    try:
        to_control, _ = resolve(control.host, way.connect, "--connect")
        to_view, _ = resolve(view.host, way.view_connect or way.connect, "--view-connect")
    except ConfigurationError as error:
        yield replace(facts, unresolved=str(error))
        return
    clock = MonotonicClock()
    facts = replace(facts, loopback=replace(control, host=to_control).is_loopback())
    yield (facts := replace(facts, control_opening=(opening := _knock(to_control, control.port, clock))))
    with OperatorSockets(control.address, view.address, topics=(b"telemetry",), keys=way.keys) as sockets:
        questions = _Questions(sockets, clock, opening.took_s)
        yield (facts := replace(facts, talk=questions.talk()))
        yield (facts := replace(facts, view_opening=_knock(to_view, view.port, clock)))
        yield (facts := replace(facts, telemetry=questions.telemetry()))
        yield replace(facts, large_arrive=questions.large_arrive())


def _place(endpoint: Endpoint) -> str:
    return endpoint.address.removeprefix("tcp://")


def _knock(host: str, port: int, clock: MonotonicClock) -> Opening:
    began_s = clock.now()
    try:
        connection = socket.create_connection((host, port), CONNECT_LIMIT_S)
    except TimeoutError:
        return Opening(errno.ETIMEDOUT)
    except OSError as error:
        return Opening(error.errno or errno.EIO)
    with connection:
        took_s = clock.now() - began_s
        said, hung_up = b"", False
        for knock, limit_s in _KNOCKS:
            with contextlib.suppress(OSError):
                connection.sendall(knock)
            said, hung_up = _listen(connection, clock, clock.now() + limit_s + 2.0 * took_s)
            if said or hung_up:
                break
    return Opening(None, said, hung_up, took_s)


def _listen(connection: socket.socket, clock: MonotonicClock, end_s: float) -> tuple[bytes, bool]:
    """Read until `end_s`, a greeting at most; return the bytes, and whether the other side hung up."""
    said = b""
    while len(said) < GREETING_BYTES and (said[:1] in (b"", KNOCK[:1])) and (left_s := end_s - clock.now()) > 0.0:
        connection.settimeout(left_s)
        try:
            piece = connection.recv(GREETING_BYTES - len(said))
        except TimeoutError:
            break
        except OSError:
            return said, True
        if not piece:
            return said, True
        said += piece
    return said, False


class _Questions:
    """Asks the robot side what it answers to anybody, and watches whether it sends telemetry."""

    def __init__(self, sockets: OperatorSockets, clock: MonotonicClock, round_trip_s: float) -> None:
        self._sockets = sockets
        self._clock = clock
        self._round_trip_s = round_trip_s
        self._epoch = secrets.randbits(53)
        """One that no Hello opens."""
        self._sequence = 0
        self._other_version: str | None = None
        self._telemetry = False

    def talk(self) -> Talk:
        """Ask until the best round trip is known."""
        end_s = self._clock.now() + _HANDSHAKE_LIMIT_S + self._round_trip_s
        while not self._ask():
            self._notice(_STEP_S)
            if self._sockets.trouble is not None:
                return Talk("key refused" if self._sockets.key_refused else "failed")
            if self._clock.now() >= end_s:
                return Talk()
        answers: list[tuple[float, LeaseNotice]] = []
        lost = 0
        enough_s = self._clock.now() + _MEASURE_S
        while True:
            asked_s = self._clock.now()
            notice = self._notice(_ANSWER_LIMIT_S)
            if self._other_version is not None:
                return Talk(other_version=self._other_version)
            if notice is None:
                lost += 1
            else:
                answers.append((self._clock.now() - asked_s, notice))
            if len(answers) >= _ROUND_TRIPS or lost >= _MOST_LOST or (answers and self._clock.now() >= enough_s):
                break
            self._listen(_PAUSE_S)
            self._ask()
        if not answers:
            return Talk()
        newest = answers[-1][1]
        trips_s = tuple(trip_s for trip_s, _ in answers)
        return Talk(answered=True, round_trips_s=trips_s, place=newest.place, waiting=newest.waiting)

    def telemetry(self) -> bool:
        """Whether some comes."""
        end_s = self._clock.now() + _TELEMETRY_LIMIT_S + 2.0 * self._round_trip_s
        while not self._telemetry and self._clock.now() < end_s:
            self._listen(_STEP_S)
        return self._telemetry

    def large_arrive(self) -> bool | None:
        """Whether a question gets through behind packets of full size; None where they cannot be sent."""
        self._listen(_PAUSE_S)
        if not self._sockets.send(_LARGE):
            return None
        # The robot side would hang up after 3 s without a heartbeat, and the next connection would be a free one.
        return any(self._ask() and self._notice(_LARGE_LIMIT_S / 2) is not None for _ in range(2))

    def _ask(self) -> bool:
        """A command under no lease of an epoch that has not begun: it is answered, and moves nothing."""
        self._sequence += 1
        header = Header(epoch=self._epoch, sequence=self._sequence, sent_s=self._clock.now())
        return self._sockets.send(encode(MotionCommand(header, l2=0.0, r2=0.0)))

    def _notice(self, limit_s: float) -> LeaseNotice | None:
        """The next answer, unless none comes in time, or one of another version."""
        end_s = self._clock.now() + limit_s
        while (left_s := end_s - self._clock.now()) > 0.0 and self._other_version is None:
            self._sockets.wait(min(left_s, _STEP_S))
            for message in self._read():
                if isinstance(message, LeaseNotice):
                    return message
        return None

    def _listen(self, for_s: float) -> None:
        """Read whatever comes, and let it go."""
        end_s = self._clock.now() + for_s
        while (left_s := end_s - self._clock.now()) > 0.0:
            self._sockets.wait(left_s)
            list(self._read())

    def _read(self) -> Iterator[AnyMessage]:
        """Each valid message that has arrived."""
        for payload in [*self._sockets.receive(), *(payload for _, payload in self._sockets.receive_view())]:
            try:
                message = decode(payload)
            except OtherVersionError as error:
                self._other_version = str(error).partition(";")[0]
            except RemoteProtocolError:
                continue
            else:
                self._telemetry |= isinstance(message, Telemetry)
                yield message
