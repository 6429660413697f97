"""Arm whose driver is a separate process, written in any language."""

from collections.abc import Callable, Sequence
from typing import Protocol

from common.arrays import FloatArray
from common.errors import FeelaheadError
from robot_side.arm.port import Arm, ArmState
from robot_side.drivers.remote.driver_session import ArmShape, DriverSession


class Wire(Protocol):
    """Port over which messages of a driver's program arrive and leave."""

    def receive(self) -> Sequence[tuple[bytes, bytes, float]]:
        """Return the messages that have arrived: (peer, payload, time of reading from the socket)."""
        ...

    def send(self, peer: bytes, payload: bytes) -> bool:
        """Send the payload at once or not at all; return whether it was sent."""
        ...


class RemoteArm(Arm):
    """Arm that is a driver's states and commands.

    A state's `time_s` is the earliest possible time of its measurement.
    """

    joint_count = 0

    def __init__(
        self, wire: Wire, shape: ArmShape, show: Callable[[ArmState], None], note: Callable[[str], None]
    ) -> None:
        """show: called with each new state. note: called with one line for each fault of a driver."""
        self.session = DriverSession(shape)
        self.joint_count = len(shape.joint_names)
        self._wire, self._show, self._note = wire, show, note
        self._shown: ArmState | None = None
        self._now_s = 0.0

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Follow `joint_velocity_rad_s` (n,) until `valid_until_s`; it is sent with the gripper's next command.

        ValueError for a wrong shape or a value that is not finite; nothing of such a command is applied.
        """
        self.session.command(joint_velocity_rad_s, valid_until_s)

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        """Move the gripper until `valid_until_s`, and send this and the arm's command.

        closing: share of the gripper's full speed, +1 closes, 0 holds, -1 opens. ValueError for a value outside [-1, 1]
        or a time that is not finite.
        """
        self.session.command_gripper(closing, valid_until_s)
        self._send()

    def exchange(self, now_s: float) -> bool:
        """Take the driver's messages that have arrived; return whether there has ever been a state."""
        session, self._now_s = self.session, now_s
        for message in self._wire.receive():
            session.receive(*message)
        session.expire(now_s)
        for text in session.take_notes():
            self._note(text)
        if session.state is not None and session.state is not self._shown:
            self._shown = session.state
            self._show(session.state)
        return session.state is not None

    def begin(self, now_s: float) -> bool:
        """Take messages before the first tick, and command to stand still; return whether there has been a state."""
        ready = self.exchange(now_s)
        self._send()
        return ready

    def state(self, now_s: float) -> ArmState:
        """Return the newest state that has arrived by `now_s`, however old; FeelaheadError before the first state."""
        self.exchange(now_s)
        if self.session.state is None:
            raise FeelaheadError("the driver has not sent a state yet")
        return self.session.state

    def _send(self) -> None:
        for peer, payload in self.session.outgoing(self._now_s):
            self._wire.send(peer, payload)
