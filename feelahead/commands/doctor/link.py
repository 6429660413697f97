"""Check of the path to a robot side, up to the first fault.

The check does not disturb an operator who drives. It makes two connections to each port, one after the other, and
sends questions that the robot side answers without admitting the sender. No Hello is sent, as it would request the arm.
"""

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from common.clock import MonotonicClock
from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol.codec import PROTOCOL_VERSION, decode, encode
from common.protocol.messages import Header, LeaseNotice, MotionCommand, Telemetry
from common.sockets.authentication import public_part
from common.sockets.operator import OperatorSockets
from feelahead.commands.doctor.port import (
    VIEW_CONNECT,
    PathError,
    RobotAddress,
    host_and_port,
    judge_port,
    judge_view,
    knock,
    resolved,
)

_ROUND_TRIPS: Final = 20
_MEASURE_S: Final = 5.0
"""Time limit for measuring round trips, in seconds; on a path with a long delay fewer are measured."""
_PAUSE_S: Final = 0.11
"""Pause between questions, in seconds: the robot side answers programs without a Hello ten times a second at most."""
_TELEMETRY_LIMIT_S: Final = 2.0
_ANSWER_LIMIT_S: Final = 2.5
_HANDSHAKE_LIMIT_S: Final = 4.0
"""Time limit of a handshake, in seconds. A robot side hangs up after 5 s of silence, so an earlier end is a refusal."""
_STEP_S: Final = 0.05
_LARGE: Final = bytes(4000)
"""Payload that is no valid message; it fills three packets of full size, to test whether the path carries these."""
_LARGE_LIMIT_S: Final = 2.5
_MOST_LOST: Final = 2
"""Number of missing answers that end the measurement; an emulated link or other askers may cost some."""


@dataclass(frozen=True)
class Talk:
    """What the robot side's answers told; without an answer `round_trips_s` is empty."""

    round_trips_s: tuple[float, ...] = ()
    place: int = 0
    """Place that this machine would get as an operator: 0 owns the arm, 1 and more observe"""
    waiting: int = 0
    """Number of operators that observe"""


def check_path(address: RobotAddress) -> tuple[Talk, PathError | None]:
    """Check the path up to the first fault; return what the robot side answered, and the fault if there is one."""
    clock, talk = MonotonicClock(), Talk()
    try:
        to_control, to_view = resolved(address.control, "--connect"), resolved(address.view, "--view-connect")
        opening = knock(to_control, clock)
        judge_port(address, address.control, opening, loopback=to_control.is_loopback())
        topics = (b"telemetry",)
        with OperatorSockets(
            address.control.address, address.view.address, topics=topics, keys=address.keys
        ) as sockets:
            questions = _Questions(sockets, address, clock, opening.took_s)
            talk = questions.talk()
            judge_view(address, knock(to_view, clock), loopback=to_view.is_loopback())
            questions.expect_telemetry()
            questions.expect_large()
    except PathError as error:
        return talk, error
    return talk, None


def as_json(address: RobotAddress, talk: Talk, error: PathError | None) -> dict[str, object]:
    """Return the result of the check as a JSON object, for programs."""
    trips_s = talk.round_trips_s
    return {
        "connect": host_and_port(address.control),
        "view_connect": host_and_port(address.view),
        "reached": error is None,
        "wrong": error and error.wrong,
        "said": error and error.said,
        "remedy": error and error.remedy,
        "protocol": PROTOCOL_VERSION,
        "round_trip_ms": 1e3 * min(trips_s) if trips_s else None,
        "round_trips": len(trips_s),
        "arm": ("taken" if talk.place else "free") if trips_s else None,
        "waiting": talk.waiting if trips_s else None,
    }


def reached(talk: Talk) -> str:
    """Return the line that reports a path without fault."""
    trips_s = talk.round_trips_s
    arm = "the arm is free (you would own it)"
    if talk.place:
        arm = f"somebody has the arm (you would observe, as number {talk.place} of those who wait)"
    best_ms = 1e3 * min(trips_s)
    return f"reached: protocol {PROTOCOL_VERSION}, round trip {best_ms:.1f} ms (best of {len(trips_s)}), {arm}"


class _Questions:
    """Questions that the robot side answers even to programs without a Hello, and checks of what else arrives."""

    def __init__(
        self, sockets: OperatorSockets, address: RobotAddress, clock: MonotonicClock, round_trip_s: float
    ) -> None:
        self._sockets = sockets
        self._address, self._place = address, host_and_port(address.control)
        self._clock = clock
        self._round_trip_s = round_trip_s
        self._epoch = secrets.randbits(53)
        """Epoch of the questions; as no Hello has this epoch, the robot side opens no session"""
        self._sequence = 0
        self._notices: list[LeaseNotice] = []
        self._telemetry = False

    def talk(self) -> Talk:
        """Ask until enough round trips are measured; raise PathError if no answer comes."""
        end_s = self._clock.now() + _HANDSHAKE_LIMIT_S + self._round_trip_s
        while not self._ask():
            self._until(_STEP_S)
            if self._sockets.trouble is not None:
                raise self._no_handshake()
            if self._clock.now() >= end_s:
                raise self._no_answer()
        trips_s: list[float] = []
        lost, enough_s = 0, self._clock.now() + _MEASURE_S
        while True:
            asked_s = self._clock.now()
            if self._answered(_ANSWER_LIMIT_S):
                trips_s.append(self._clock.now() - asked_s)
            else:
                lost += 1
            if len(trips_s) >= _ROUND_TRIPS or lost >= _MOST_LOST or (trips_s and self._clock.now() >= enough_s):
                break
            self._until(_PAUSE_S)
            self._ask()
        if not trips_s:
            raise self._no_answer()
        return Talk(tuple(trips_s), self._notices[-1].place, self._notices[-1].waiting)

    def expect_telemetry(self) -> None:
        """Raise PathError unless telemetry arrives at the view connection."""
        if not self._until(_TELEMETRY_LIMIT_S + 2.0 * self._round_trip_s, lambda: self._telemetry):
            said = (
                f"the control port works, but {host_and_port(self._address.view)} is no view port of a robot side, "
                "or not of this one: it sends no telemetry"
            )
            raise PathError("view port", said, VIEW_CONNECT)

    def expect_large(self) -> None:
        """Raise PathError unless a question is answered that was sent behind packets of full size."""
        self._until(_PAUSE_S)
        if not self._sockets.send(_LARGE):
            return
        # Both questions fit in 2.5 s: after 3 s without a heartbeat the robot side would hang up, and a new connection
        # would have no large packet in its way.
        if not any(self._ask() and self._answered(_LARGE_LIMIT_S / 2) for _ in range(2)):
            said = f"small packets reach {self._place}, large ones do not: the path drops packets of full size"
            remedy = "a smaller MTU here, such as: sudo ip link set DEVICE mtu 1280 (VPNs and tunnels need that)"
            raise PathError("large packets", said, remedy)

    def _no_handshake(self) -> PathError:
        place = self._place
        if self._address.keys is None:
            return self._no_answer()
        if self._sockets.key_refused:
            said = f"the robot side at {place} does not let this key in: it was never allowed there, or was revoked"
            return PathError(
                "our key",
                said,
                f"run on the robot's machine: feelahead keys allow NAME {public_part(self._address.keys.secret)}",
            )
        said = f"the program at {place} has another key than --robot-key says, or is no robot side's control port"
        remedy = "give --robot-key the key that this shows on the robot's machine: feelahead keys show robot"
        return PathError("robot key", said, remedy)

    def _no_answer(self) -> PathError:
        said = (
            f"{self._place} speaks ZeroMQ and does not answer: "
            "a robot side that is starting or paused, its view port, or another program"
        )
        remedy = "wait until it listens (its first start compiles for about half a minute), and give its control port"
        return PathError("no answer", said, remedy)

    def _ask(self) -> bool:
        """Send a command without lease and session, which the robot side answers but never applies.

        Return whether it could be sent.
        """
        self._sequence += 1
        header = Header(epoch=self._epoch, sequence=self._sequence, sent_s=self._clock.now())
        return self._sockets.send(encode(MotionCommand(header, l2=0.0, r2=0.0)))

    def _answered(self, limit_s: float) -> bool:
        before = len(self._notices)
        return self._until(limit_s, lambda: len(self._notices) > before)

    def _until(self, limit_s: float, done: Callable[[], bool] = lambda: False) -> bool:
        """Process messages until `done()` is true; return False if `limit_s` is over first."""
        end_s = self._clock.now() + limit_s
        while not done():
            if (left_s := end_s - self._clock.now()) <= 0.0:
                return False
            self._sockets.wait(min(left_s, _STEP_S))
            for payload in [*self._sockets.receive(), *(payload for _, payload in self._sockets.receive_view())]:
                self._take(payload)
        return True

    def _take(self, payload: bytes) -> None:
        try:
            message = decode(payload)
        except OtherVersionError as error:
            said = f"the robot side speaks {str(error).partition(';')[0]}, this machine {PROTOCOL_VERSION}"
            raise PathError("version", said, "install the same release of feelahead on both") from error
        except RemoteProtocolError:
            return
        self._telemetry |= isinstance(message, Telemetry)
        if isinstance(message, LeaseNotice):
            self._notices.append(message)
