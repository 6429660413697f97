"""Open a port where a robot side should listen, and diagnose the answer."""

import errno
import os
import socket
from dataclasses import dataclass, replace
from typing import Final

from common.clock import MonotonicClock
from common.errors import ConfigurationError
from common.sockets.authentication import OperatorKeys
from common.sockets.endpoints import Endpoint, resolve, split_connect, view_after
from common.sockets.greeting import GREETING_BYTES, KNOCK, mechanism_of

_CONNECT_LIMIT_S: Final = 4.0
"""Time limit of a connection, in seconds: 1 s more than Linux needs to find that nobody has an address."""
_GREETING_LIMIT_S: Final = 3.0
_STEPS: Final = "feelahead keys --help has the steps on both machines"
VIEW_CONNECT: Final = "say --view-connect tcp://HOST:PORT with the port that the robot side names at its start"


class PathError(Exception):
    """First fault of the path; `wrong` names its kind in a word or two."""

    def __init__(self, wrong: str, said: str, remedy: str) -> None:
        super().__init__(f"{wrong}: {said}; to mend it: {remedy}")
        self.wrong, self.said, self.remedy = wrong, said, remedy


@dataclass(frozen=True)
class RobotAddress:
    """Addresses of a robot side, and the keys for it."""

    control: Endpoint
    view: Endpoint
    keys: OperatorKeys | None = None

    @classmethod
    def to(cls, connect: str, view_connect: str | None = None, keys: OperatorKeys | None = None) -> "RobotAddress":
        """Read the addresses, without looking their names up; raises ConfigurationError for an invalid address."""
        control = Endpoint(*split_connect(connect, "--connect"), ipv6=False)
        if view_connect is None:
            return cls(control, view_after(control, connect, "--view-connect"), keys)
        return cls(control, Endpoint(*split_connect(view_connect, "--view-connect"), ipv6=False), keys)


@dataclass(frozen=True)
class Opening:
    """Answer of a port to a TCP connection, and the first bytes that it sends."""

    error: int | None = None
    """Errno of a failed connection, ETIMEDOUT if no answer came; None if the connection was established"""
    said: bytes = b""
    hung_up: bool = False
    """Whether the port ended the connection by itself."""
    took_s: float = 0.0
    """Time until the connection was established."""


def judge_port(address: RobotAddress, port: Endpoint, opening: Opening, *, loopback: bool = False) -> None:
    """Raise PathError if `opening` shows that `port` is no robot side's. loopback: the port is on this machine."""
    place = host_and_port(port)
    if opening.error is not None:
        raise _no_connection(address, port, opening.error, loopback=loopback)
    see_who = f"give the robot side's port; this shows there what listens at this one: ss -ltnp 'sport = :{port.port}'"
    match mechanism_of(opening.said), address.keys is not None:
        case ("NULL", False) | ("CURVE", True):
            return
        case "CURVE", _:
            said = f"the robot side at {place} asks for keys, and none were given"
            raise PathError("keys", said, f"--keys FOLDER --robot-key KEY ({_STEPS})")
        case "NULL", _:
            remedy = f"start it with --keys FOLDER ({_STEPS}), or leave --keys out if anyone may move the arm"
            raise PathError("keys", f"the robot side at {place} runs without keys, and --keys was given", remedy)
    if opening.said:
        said = f"{place} is no robot side's: what listens there begins with {opening.said[:24]!r}"
    elif opening.hung_up:
        said = (
            f"{place} takes connections and hangs up at once: "
            "a forwarded port with nothing behind it, or a robot side with too many connections"
        )
        see_who = "start the robot side behind it, or end the program that keeps connecting"
    else:
        said = f"{place} takes connections and says nothing: no robot side, or a paused one"
        see_who += "; a stopped process continues after: kill -CONT PID"
    raise PathError("something else", said, see_who)


def judge_view(address: RobotAddress, opening: Opening, *, loopback: bool = False) -> None:
    """Raise PathError if the view port is no robot side's, after the control port was found to work."""
    try:
        judge_port(address, address.view, opening, loopback=loopback)
    except PathError as error:
        remedy = f"{error.remedy}; or {VIEW_CONNECT}" if error.wrong == "firewall" else VIEW_CONNECT
        raise PathError("view port", f"the control port works, but not the view port: {error.said}", remedy) from error


def _no_connection(address: RobotAddress, port: Endpoint, error: int, *, loopback: bool) -> PathError:
    place = host_and_port(port)
    if error == errno.ECONNREFUSED:
        remedy = f"start feelahead-robot, or say where it is: --connect tcp://ROBOT:{port.port}"
        if not loopback:
            remedy = (
                f"start feelahead-robot there with --bind tcp://0.0.0.0:{port.port} and --keys FOLDER: "
                "without --bind it listens on its own loopback alone"
            )
        return PathError("closed port", f"{place} refuses connections: nothing listens there", remedy)
    if error == errno.ETIMEDOUT:
        ports = list(dict.fromkeys(str(each.port) for each in (address.control, address.view)))
        said = (
            f"{place} gave no answer in {_CONNECT_LIMIT_S:g} s: "
            "a firewall drops the packets, or no machine has that address"
        )
        remedy = (
            f"let TCP ports {' and '.join(ports)} in on the robot's machine, "
            f"such as: sudo ufw allow proto tcp from any to any port {','.join(ports)}; "
            f"whether it is on: ping {port.host}"
        )
        return PathError("firewall", said, remedy)
    reason = {
        errno.EHOSTUNREACH: "no machine has that address, no router knows a way, or a firewall rejects it",
        errno.ENETUNREACH: "this machine is in no network from which it can be reached",
    }.get(error, "this machine does not send there")
    remedy = f"see that the robot's machine is on, and both are in one network: ip route get {port.host}"
    return PathError("route", f"no way to {place} ({os.strerror(error)}): {reason}", remedy)


def resolved(port: Endpoint, flag: str) -> Endpoint:
    """Return `port` with the host's name replaced by its first address; raises PathError if the name has none."""
    try:
        return replace(port, host=resolve(port.host, port.address, flag)[0])
    except ConfigurationError as error:
        said, _, valid = str(error).partition("; valid: ")
        raise PathError("name", said, f"say {valid}, in /etc/hosts for example") from error


def host_and_port(port: Endpoint) -> str:
    """Return HOST:PORT, for people."""
    return port.address.removeprefix("tcp://")


def knock(port: Endpoint, clock: MonotonicClock) -> Opening:
    """Connect to the port by TCP, and read the first bytes that it sends."""
    began_s = clock.now()
    try:
        connection = socket.create_connection((port.host, port.port), _CONNECT_LIMIT_S)
    except TimeoutError:
        return Opening(errno.ETIMEDOUT)
    except OSError as error:
        return Opening(error.errno or errno.EIO)
    took_s, said = clock.now() - began_s, b""
    with connection:
        connection.settimeout(_GREETING_LIMIT_S + 2.0 * took_s)
        try:
            # Some servers wait for a line's end.
            connection.sendall(KNOCK + b"\r\n\r\n")
            while len(said) < GREETING_BYTES and said[:1] in (b"", KNOCK[:1]):
                if not (piece := connection.recv(GREETING_BYTES - len(said))):
                    return Opening(None, said, hung_up=True, took_s=took_s)
                said += piece
        except OSError as error:
            return Opening(None, said, hung_up=not isinstance(error, TimeoutError), took_s=took_s)
    return Opening(None, said, took_s=took_s)
