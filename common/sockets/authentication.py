"""Authentication: CURVE key pairs, and the answers to ZeroMQ's handshake requests.

ZeroMQ asks over a separate socket whether a key is allowed (ZAP, rfc.zeromq.org/spec/27). The thread that waits for
messages answers, so that there is no other thread that could die unnoticed. Without answers no peer is admitted.
"""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import zmq
from zmq.utils import z85
from zmq.utils.monitor import parse_monitor_message

from common.errors import ConfigurationError
from common.sockets.allow_list import AllowList
from common.sockets.descriptors import hold_little
from common.sockets.key_files import KeyRole
from common.sockets.keys import KeyFolder, read_public_key
from common.sockets.readable import readable

_ZAP_ENDPOINT = "inproc://zeromq.zap.01"
_ZAP_DOMAIN = b"feelahead"
_ANSWERS_PER_CALL = 4
"""Maximum number of handshakes answered per call, so that a storm of handshakes does not block the caller."""
_EVENTS_PER_CALL = 16
_REMEMBERED_REFUSALS = 64
MOST_HANDSHAKES = 50
"""Maximum number of handshakes of a key in a window of the caller's: an operator side that connects again has nine"""


def make_key_pair() -> tuple[str, str]:
    """Make a (public, secret) pair of keys, as hexadecimal digits."""
    public, secret = zmq.curve_keypair()
    return z85.decode(public).hex(), z85.decode(secret).hex()


def public_part(secret: str) -> str:
    """Return the public key of `secret`."""
    return z85.decode(zmq.curve_public(z85.encode(bytes.fromhex(secret)))).hex()


@dataclass(frozen=True)
class RobotKeys:
    """Keys of the robot side: its secret key, and the list of admitted public keys."""

    secret: str
    allowed: AllowList

    @classmethod
    def load(cls, folder: Path) -> "RobotKeys":
        """Load a folder of keys. Raises ConfigurationError, which names the command that mends the fault."""
        keys = KeyFolder(folder)
        secret = keys.secret("robot")
        allowed = AllowList(keys)
        allowed.refresh()
        if allowed.unreadable is not None:
            raise ConfigurationError(f"--keys {folder}: {allowed.unreadable}")
        return cls(secret, allowed)

    def notes(self) -> list[str]:
        """Return a line with the names of the admitted peers, to be shown at the start."""
        folder, names = self.allowed.folder, ", ".join(sorted(self.allowed.names.values()))
        change = folder.command("allow NAME KEY")
        who = f"lets in {names}" if names else f"lets nobody in yet; to let an operator in: {change}"
        return [f"keys: {who}"]

    def secure(self, part: "zmq.Socket[bytes]") -> None:
        """Make the socket `part` admit only allowed keys; call before it is bound."""
        part.setsockopt(zmq.CURVE_SERVER, 1)
        part.setsockopt(zmq.CURVE_SECRETKEY, bytes.fromhex(self.secret))
        part.setsockopt(zmq.ZAP_DOMAIN, _ZAP_DOMAIN)
        part.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)


@dataclass(frozen=True)
class OperatorKeys:
    """Keys of the operator side: its own secret key, and the robot side's public key."""

    secret: str
    robot: str

    @classmethod
    def load(cls, folder: Path, robot_key: str | None) -> "OperatorKeys":
        """Load our secret key from `folder`; `robot_key`: the robot side's public key. Errors as in RobotKeys.load."""
        secret = KeyFolder(folder).secret("operator")
        if robot_key is None:
            raise ConfigurationError(
                f"--keys {folder}: the robot side's public key is not given; valid: also --robot-key KEY, "
                "where KEY is what `feelahead keys show robot` prints on the robot's machine"
            )
        return cls(secret, read_public_key(robot_key, "--robot-key"))

    def secure(self, part: "zmq.Socket[bytes]") -> None:
        """Make the socket `part` connect only to the owner of the robot side's key; call before it is connected."""
        part.setsockopt(zmq.CURVE_SERVERKEY, bytes.fromhex(self.robot))
        part.setsockopt(zmq.CURVE_PUBLICKEY, bytes.fromhex(public_part(self.secret)))
        part.setsockopt(zmq.CURVE_SECRETKEY, bytes.fromhex(self.secret))


class Authenticator:
    """Authenticator of the handshakes of one ZeroMQ context, by an allow-list. Make it before any socket is bound."""

    def __init__(
        self,
        context: "zmq.Context[zmq.Socket[bytes]]",
        allowed: AllowList,
        roles: Collection[KeyRole] = ("operator", "observer"),
    ) -> None:
        """roles: those that are let in."""
        self.refused = 0
        """Number of handshakes with a key that is not allowed."""
        self._allowed, self._roles = allowed, roles
        self._handshakes: Counter[str] = Counter()
        self.refusals: list[tuple[str, str]] = []
        """Keys that were refused for the first time, and their addresses; the caller empties it"""
        self._refused_keys: dict[str, bool] = {}
        self._questions = context.socket(zmq.REP)
        self._questions.setsockopt(zmq.LINGER, 0)
        self._questions.bind(_ZAP_ENDPOINT)

    def fileno(self) -> int:
        """Return a descriptor that becomes readable when a handshake waits for an answer."""
        return self._questions.fileno()

    def begin_window(self) -> set[str]:
        """Count the handshakes of each key anew; return the keys that had more than MOST_HANDSHAKES."""
        rushing = {key for key, count in self._handshakes.items() if count > MOST_HANDSHAKES}
        self._handshakes.clear()
        return rushing

    def serve(self) -> bool:
        """Answer a few waiting handshakes; return whether more may wait. Never blocks."""
        for _ in range(_ANSWERS_PER_CALL):
            if not readable(self._questions):
                return False
            question = self._questions.recv_multipart(zmq.NOBLOCK)
            self._questions.send_multipart(self._answer(question))
        return True

    def news(self) -> list[str]:
        """Return a line for each unknown key newly refused since the last call, with the command that allows it."""
        new = [key for key, is_new in self._refused_keys.items() if is_new]
        self._refused_keys.update(dict.fromkeys(new, False))
        return [self._line(key) for key in new]

    def _line(self, key: str) -> str:
        command, name = self._allowed.folder.command, self._allowed.names.get(key)
        if name is None:
            role = "" if "operator" in self._roles else f" --role {next(iter(self._roles))}"
            return f"refused an unknown key; to let it in: {command(f'allow NAME {key}{role}')}"
        had, wanted = self._allowed.roles[key], " or ".join(self._roles)
        return f"refused {name}, whose role is {had}, where {wanted} is let in (feelahead keys allow --help)"

    def _answer(self, question: list[bytes]) -> list[bytes]:
        # version, request, domain, address, identity, mechanism, and for CURVE the client's public key
        request = question[1] if len(question) > 1 else b""
        is_curve = len(question) == 7 and question[5] == b"CURVE" and question[2] == _ZAP_DOMAIN
        key = question[6].hex() if is_curve else ""
        admitted = self._allowed.admits(key, self._roles)
        self._handshakes[key] += admitted
        if admitted and self._handshakes[key] <= MOST_HANDSHAKES:
            return [b"1.0", request, b"200", b"", key.encode(), b""]
        self.refused += 1
        is_new = not admitted and key not in self._refused_keys and key not in self._allowed.barred
        room = len(self._refused_keys) < _REMEMBERED_REFUSALS or key in self._allowed.names
        if is_curve and is_new and room:
            self._refused_keys[key] = True
            self.refusals.append((key, question[3].decode("ascii", "replace")))
        return [b"1.0", request, b"400", b"not allowed", b"", b""]


class HandshakeWatch:
    """Monitor of the handshakes of a connecting socket; it explains failures in words."""

    def __init__(self, part: "zmq.Socket[bytes]", keys: OperatorKeys | None, unsent_bytes: int) -> None:
        """`keys` None: we have no keys. `unsent_bytes`: as in hold_little, which is applied to each connection."""
        self.trouble: str | None = None
        """Reason why the newest handshake failed, with a remedy; None after a successful one."""
        self.failed = False
        """Whether the newest handshake failed; the caller connects again, as ZeroMQ does not, and sets this to
        False."""
        self.key_refused = False
        """Whether the newest handshake failed because the robot side does not allow our key."""
        self._keys = keys
        self._unsent_bytes = unsent_bytes
        self._part = part
        self._events = part.get_monitor_socket(
            zmq.EVENT_CONNECTED
            | zmq.EVENT_HANDSHAKE_SUCCEEDED
            | zmq.EVENT_HANDSHAKE_FAILED_AUTH
            | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
            | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
        )

    def poll(self) -> None:
        """Process ZeroMQ's handshake events since the last call; never blocks."""
        for _ in range(_EVENTS_PER_CALL):
            try:
                event_fields = parse_monitor_message(self._events.recv_multipart(zmq.NOBLOCK))
            except zmq.Again:
                return
            event = event_fields["event"]
            if event == zmq.EVENT_CONNECTED:
                hold_little(event_fields["value"], self._unsent_bytes)
                continue
            self.failed = event != zmq.EVENT_HANDSHAKE_SUCCEEDED
            self.trouble = self._reason(event) if self.failed else None
            self.key_refused = event == zmq.EVENT_HANDSHAKE_FAILED_AUTH

    def close(self) -> None:
        """Stop watching; call before the watched socket is closed."""
        # In this order: ZeroMQ's thread would block forever on an event for a closed watcher.
        self._part.disable_monitor()
        self._events.close(linger=0)

    def _reason(self, event: int) -> str:
        if event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL and self._keys is None:
            return "its port is open, but does not answer: it is still starting, or another program listens there"
        if self._keys is None:
            return "the robot side asks for keys; valid: with --keys FOLDER --robot-key KEY (feelahead keys --help)"
        if event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            key = public_part(self._keys.secret)
            return f"the robot side does not let this key in; to let it in, run there: feelahead keys allow NAME {key}"
        return (
            "the robot side is still starting, has no keys, or has another key than --robot-key; "
            "to see its key, run there: feelahead keys show robot"
        )
