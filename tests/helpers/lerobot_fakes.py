"""Fakes for drivers that run in LeRobot's environment: its arm, the port's socket, a clock."""

import importlib.util
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import msgpack
import zmq

from tests.helpers.repository import ROOT

SCRIPT = ROOT / "docs" / "drivers" / "lerobot_arm.py"
START = {
    **{"shoulder_pan.pos": 10.0, "shoulder_lift.pos": -20.0, "elbow_flex.pos": 0.0},
    **{"wrist_flex.pos": 0.0, "wrist_roll.pos": 0.0, "gripper.pos": 100.0},
}


def lerobot_arm(socket: "FakeSocket") -> ModuleType:
    """Import the driver for LeRobot's arms from its file, anew, with `socket` as its only one; return the module."""
    found = importlib.util.spec_from_file_location("lerobot_arm", SCRIPT)
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    use(socket, module)
    return module


def use(socket: "FakeSocket", module: Any) -> None:
    """Let the driver's module have no other sockets than this."""
    context = SimpleNamespace(socket=lambda _: socket)
    module.zmq = SimpleNamespace(Context=lambda: context, DEALER=zmq.DEALER, POLLOUT=zmq.POLLOUT)


class FakeFollower:
    """LeRobot's SO-101, whose servos reach each goal at once; its gripper may be blocked, its bus dead."""

    def __init__(self) -> None:
        self.at = dict(START)
        self.blocked_at = 0.0
        self.moves = True
        self.status = dict.fromkeys((name.removesuffix(".pos") for name in START), 0)
        self.dead = False
        self.bus = SimpleNamespace(sync_read=self._sync_read)

    def get_observation(self) -> dict[str, Any]:
        """Return positions; ConnectionError of two lines while the bus is dead."""
        if self.dead:
            raise ConnectionError("Failed to sync read 'Present_Position' after 3 tries.\nThere is no status packet!")
        return dict(self.at)

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        """Go to the goals."""
        assert action.keys() == self.at.keys()
        if self.moves:
            self.at = action | {"gripper.pos": min(max(action["gripper.pos"], self.blocked_at), 100.0)}
        return action

    def _sync_read(self, register: str, *, normalize: bool) -> dict[str, int]:
        assert (register, normalize) == ("Status", False)
        return self.status


class FakeSocket:
    """Socket without a network: what was sent, and what will be received."""

    def __init__(self) -> None:
        self.sent: list[dict[str, Any]] = []
        self.waiting: list[dict[str, Any]] = []
        self.address = ""

    def command(self, velocities: list[float], until_s: float, closing: float = 0.0) -> None:
        """Let the driver receive a command."""
        said = {"version": 1, "sequence": 1, "sent_s": 5.0, "joint_velocities": velocities}
        self.waiting.append(said | {"closing": closing, "valid_until_s": until_s})

    def connect(self, address: str) -> None:
        """Keep the address."""
        self.address = address

    def poll(self, _: int, flags: int = zmq.POLLIN) -> bool:
        """Return whether something waits, or can be sent."""
        return flags == zmq.POLLOUT or bool(self.waiting)

    def recv(self) -> bytes:
        """Return the oldest message that waits."""
        return bytes(msgpack.packb(self.waiting.pop(0)))

    def send(self, payload: bytes, _: int = 0) -> None:
        """Keep a message."""
        self.sent.append(msgpack.unpackb(payload))


class FakeTime:
    """Module `time` in which only `sleep` lets time pass."""

    def __init__(self, happens: Callable[[float], None]) -> None:
        """happens: called after each sleep with the seconds since the start."""
        self._since_s, self._happens = 0.0, happens

    def monotonic(self) -> float:
        """Return the time, in s."""
        return 100.0 + self._since_s

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self._since_s += seconds
        self._happens(self._since_s)
