"""Judge the way from this machine to a robot side, first things first, from facts alone."""

import errno
import os
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Literal

from common.protocol.codec import PROTOCOL_VERSION
from common.sockets.greeting import mechanism_of

CONNECT_LIMIT_S: Final = 4.0
"""A second more than it takes Linux to find out that nobody on the network has an address."""
_OTHERS: Final = {
    b"HTTP/": "an HTTP server",
    b"SSH-": "an SSH server",
    b"<": "an HTTP server",
    b"\x15\x03": "a TLS server",
}
"""Servers by the bytes that they begin with."""
_STEPS: Final = "feelahead keys --help has the steps on both machines"

_VIEW_CONNECT: Final = "say --view-connect tcp://HOST:PORT with the port that the robot side names at its start"


class Wrong(StrEnum):
    """The kinds of faults, in the order of looking."""

    NAME = "name"
    ROUTE = "route"
    CLOSED = "closed port"
    FIREWALL = "firewall"
    OTHER = "something else"
    KEYS = "keys"
    ROBOT_KEY = "robot key"
    OUR_KEY = "our key"
    SILENT = "no answer"
    VERSION = "version"
    VIEW = "view port"
    LARGE = "large packets"


@dataclass(frozen=True)
class Opening:
    """A port's answer to a TCP connection, and its first bytes."""

    error: int | None = None
    """The errno of a connection that failed, ETIMEDOUT for one that nobody answered; None for one that stands."""
    said: bytes = b""
    hung_up: bool = False
    """Whether it ended the connection by itself."""
    took_s: float = 0.0
    """The time until the connection stood."""


@dataclass(frozen=True)
class Talk:
    """The answers to questions that ask for nothing, over ZeroMQ."""

    handshake: Literal["key refused", "failed"] | None = None
    """The handshake's failure, if it failed."""
    answered: bool = False
    other_version: str | None = None
    """The robot side's protocol, where it is not ours."""
    round_trips_s: tuple[float, ...] = ()
    place: int = 0
    """The place that we would get: 0 owns the arm."""
    waiting: int = 0
    """The number of observers."""


@dataclass(frozen=True)
class LinkFacts:
    """The facts about the way; None for those not looked at yet."""

    control: str
    """HOST:PORT of the control port."""
    view: str
    keys: str | None = None
    """Our public key, where we have been given keys."""
    loopback: bool = False
    """Whether the robot side is sought on this machine."""
    unresolved: str | None = None
    """Why a name cannot be resolved."""
    control_opening: Opening | None = None
    talk: Talk | None = None
    view_opening: Opening | None = None
    telemetry: bool | None = None
    """Whether the view port said what it is for."""
    large_arrive: bool | None = None
    """Whether packets of full size reach the robot side."""


@dataclass(frozen=True)
class Fault:
    """The first thing that is wrong."""

    wrong: Wrong
    said: str
    remedy: str


def judge(facts: LinkFacts) -> Fault | None:
    """The first thing that is wrong with what has been looked at; None if nothing is."""
    if facts.unresolved is not None:
        said, _, valid = facts.unresolved.partition("; valid: ")
        return Fault(Wrong.NAME, said, f"say {valid}, in /etc/hosts for example")
    if facts.control_opening and (fault := _judge_port(facts, facts.control, facts.control_opening)):
        return fault
    if facts.talk and (fault := _judge_talk(facts, facts.talk)):
        return fault
    if facts.view_opening and (fault := _judge_port(facts, facts.view, facts.view_opening)):
        remedy = f"{fault.remedy}; or {_VIEW_CONNECT}" if fault.wrong is Wrong.FIREWALL else _VIEW_CONNECT
        return Fault(Wrong.VIEW, f"the control port works, but not the view port: {fault.said}", remedy)
    if facts.telemetry is False:
        no_port = f"{facts.view} is no view port of a robot side, or not of this one: it sends no telemetry"
        return Fault(Wrong.VIEW, f"the control port works, but {no_port}", _VIEW_CONNECT)
    if facts.large_arrive is False:
        return Fault(
            Wrong.LARGE,
            f"small packets reach {facts.control}, large ones do not: the way swallows what is longer than it can "
            "carry",
            "a smaller MTU here, such as: sudo ip link set DEVICE mtu 1280 (VPNs and tunnels need that)",
        )
    return None


def told(facts: LinkFacts) -> dict[str, object]:
    """Tell the facts to programs."""
    fault, talk = judge(facts), facts.talk
    trips_s = talk.round_trips_s if talk is not None else ()
    answered = talk is not None and talk.answered
    return {
        "connect": facts.control,
        "view_connect": facts.view,
        "reached": fault is None,
        "wrong": None if fault is None else fault.wrong.value,
        "said": None if fault is None else fault.said,
        "remedy": None if fault is None else fault.remedy,
        "protocol": PROTOCOL_VERSION,
        "round_trip_ms": 1e3 * min(trips_s) if trips_s else None,
        "round_trips": len(trips_s),
        "arm": None if talk is None or not answered else "free" if talk.place == 0 else "taken",
        "waiting": None if talk is None or not answered else talk.waiting,
    }


def reached(facts: LinkFacts) -> str:
    """The line for a way on which nothing is wrong."""
    talk = facts.talk or Talk()
    trips_s = talk.round_trips_s
    measured = f"round trip {1e3 * min(trips_s):.1f} ms (best of {len(trips_s)})" if trips_s else "round trip unknown"
    if talk.place == 0:
        arm = "the arm is free (you would own it)"
    else:
        arm = f"somebody has the arm (you would observe, as number {talk.place} of those who wait)"
    return f"reached: protocol {PROTOCOL_VERSION}, {measured}, {arm}"


def _judge_port(facts: LinkFacts, place: str, opening: Opening) -> Fault | None:
    see_who = _see_who(place)
    if opening.error is not None:
        return _judge_error(facts, place, opening.error)
    match mechanism_of(opening.said), facts.keys:
        case ("NULL", None) | ("CURVE", str()):
            return None
        case "CURVE", None:
            said = f"the robot side at {place} asks for keys, and none were given"
            return Fault(Wrong.KEYS, said, f"--keys FOLDER --robot-key KEY ({_STEPS})")
        case "NULL", _:
            remedy = f"start it with --keys FOLDER ({_STEPS}), or leave --keys out if anyone may move the arm"
            return Fault(Wrong.KEYS, f"the robot side at {place} runs without keys, and --keys was given", remedy)
        case str() as mechanism, _:
            said = f"{place} speaks ZeroMQ with {mechanism!r:.24}, as no robot side does"
            return Fault(Wrong.OTHER, said, see_who)
    if opening.said:
        known = (name for start, name in _OTHERS.items() if opening.said.startswith(start))
        who = next(known, f"something that begins with {opening.said[:16]!r}")
        return Fault(Wrong.OTHER, f"at {place} is {who}, and no robot side", see_who)
    if opening.hung_up:
        said = "a forwarded port with nothing behind it, or a robot side with too many connections"
        remedy = "start the robot side behind it, or end the program that keeps connecting"
        return Fault(Wrong.OTHER, f"{place} takes connections and hangs up at once: {said}", remedy)
    said = f"{place} takes connections and says nothing: no robot side, or one that stands still"
    return Fault(Wrong.OTHER, said, f"{see_who}; a stopped process goes on after: kill -CONT PID")


def _see_who(place: str) -> str:
    port = place.rpartition(":")[2]
    return f"say the robot side's own port; who has this one is shown on that machine by: ss -ltnp 'sport = :{port}'"


def _judge_error(facts: LinkFacts, place: str, error: int) -> Fault:
    host, _, port = place.rpartition(":")
    if error == errno.ECONNREFUSED:
        remedy = f"start feelahead-robot, or say where it is: --connect tcp://ROBOT:{port}"
        if not facts.loopback:
            start = f"start feelahead-robot there with --bind tcp://0.0.0.0:{port} and --keys FOLDER"
            remedy = f"{start}: without --bind it listens on its own loopback alone"
        return Fault(Wrong.CLOSED, f"{place} refuses connections: nothing listens there", remedy)
    if error == errno.ETIMEDOUT:
        ports = list(dict.fromkeys(one.rpartition(":")[2] for one in (facts.control, facts.view)))
        opened = f"sudo ufw allow proto tcp from any to any port {','.join(ports)}"
        return Fault(
            Wrong.FIREWALL,
            f"{place} gave no answer in {CONNECT_LIMIT_S:g} s: a firewall drops what is sent there, or nothing has "
            "that address",
            f"let TCP ports {' and '.join(ports)} in on the robot's machine, such as: {opened}; whether it is on: "
            f"ping {host.strip('[]')}",
        )
    reason = {
        errno.EHOSTUNREACH: "no machine on its network has that address, a router knows no way, or a firewall "
        "rejects it",
        errno.ENETUNREACH: "this machine is in no network from which it can be reached",
    }.get(error, "this machine does not send there")
    return Fault(
        Wrong.ROUTE,
        f"no way to {place} ({os.strerror(error)}): {reason}",
        f"see that the robot's machine is on, and both are in one network: ip route get {host.strip('[]')}",
    )


def _judge_talk(facts: LinkFacts, talk: Talk) -> Fault | None:
    place = facts.control
    if talk.handshake == "key refused":
        said = f"the robot side at {place} does not let this key in: it was never allowed there, or was revoked"
        return Fault(Wrong.OUR_KEY, said, f"run there: feelahead keys allow NAME {facts.keys}")
    if talk.handshake is not None and facts.keys is None:
        said = f"{place} speaks ZeroMQ and is no control port, but perhaps a view port"
        return Fault(Wrong.OTHER, said, _see_who(place))
    if talk.handshake is not None:
        said = f"the program at {place} has another key than --robot-key says, or is no such port of a robot side"
        remedy = "--robot-key with what is shown on the robot's machine by: feelahead keys show robot"
        return Fault(Wrong.ROBOT_KEY, said, remedy)
    if talk.other_version is not None:
        said = f"the robot side speaks {talk.other_version}, this machine {PROTOCOL_VERSION}"
        return Fault(Wrong.VERSION, said, "install the same release of feelahead on both")
    if not talk.answered:
        return Fault(
            Wrong.SILENT,
            f"{place} speaks ZeroMQ and does not answer: a robot side that still starts or stands still, its view "
            "port, or another program",
            "wait until it says that it listens (its first start compiles for a minute), and say its control port",
        )
    return None
