"""Session with the arm's driver, without I/O: states come in, commands go out."""

import math
from collections import Counter
from dataclasses import replace
from typing import Final, Literal, NamedTuple

import msgspec

from common.arrays import FloatArray
from common.errors import OtherVersionError, RemoteProtocolError
from common.periods import EARLY
from robot_side.arm.limits import ArmLimits, JointLimits
from robot_side.arm.port import ArmState
from robot_side.drivers.remote.driver_clock import DriverClock
from robot_side.drivers.remote.messages import (
    DRIVER_VERSION,
    DriverCommand,
    DriverState,
    Refusal,
    decoded,
    encode,
    floats,
)
from robot_side.drivers.remote.plausibility import Plausibility

SILENT_S: Final = 0.1
"""Silence, in seconds, after which a driver is lost"""
TAKEN_OVER_S: Final = 1.0
"""Silence, in seconds, after which another driver may take over. The arm is lost before, so nobody is armed then."""
_DOUBTED_S: Final = 0.5
"""Time, in seconds, for which the arm cannot be armed after its states were doubted"""
COMMAND_PERIOD_S: Final = 0.004
"""Period of commands, in seconds, to the nearest turn; a command that stops the arm leaves at once."""
_REFUSAL_PERIOD_S: Final = 1.0
_NEWS_PERIOD_S: Final = 1.0
"""Minimum period of notes about a driver's connection, in seconds"""
_DECODER: Final = msgspec.msgpack.Decoder(DriverState)

_UNANSWERED: Final = 250
"""Number of commands without an echo, as many as in a second, after which the driver counts as not echoing"""

_CONDITIONS: Final = {
    "protective_stop": "a protective stop",
    "fault": "a fault",
    "emergency_stop": "an emergency stop",
}
Why = Literal["second", "version", "malformed", "joints", "order", "echo", "clock", "impossible"]


class ArmShape(NamedTuple):
    """Names and limits of the joints in every state, and the gripper's values for states that lack them."""

    joint_names: tuple[str, ...]
    finger_names: tuple[str, ...]
    open_fingers: FloatArray
    """(f,) positions of the open gripper's joints"""
    opening_m: float
    """Free gap of the open gripper, in m; 0 without a gripper"""
    limits: JointLimits
    sigma_rad: float = 0.0
    """Standard deviation of a joint's reading"""


class _LastCommand(NamedTuple):
    """Last command to the arm."""

    velocities: tuple[float, ...]
    until_s: float


class DriverSession:
    """Session with one driver at a time: the first that sends, until it falls silent."""

    def __init__(self, shape: ArmShape) -> None:
        self.state: ArmState | None = None
        """Newest state; None before the first state whose age is known"""
        self.rejected: Counter[Why] = Counter()
        """Number of rejected states by reason; a state is rejected as a whole."""
        self.accepted = 0
        self._said_limits: ArmLimits | None = None
        self._shape = shape
        self._peer: bytes | None = None
        self._last_peer: bytes | None = None
        self._heard_s = self._measured_s = -math.inf
        self._sequence = -1
        self._clock = DriverClock()
        self._plausibility = Plausibility(shape.joint_names, shape.limits, shape.sigma_rad)
        self._doubt: str | None = None
        self._doubted_s = -math.inf
        self._closing = (0.0, -math.inf)
        self._last_command = _LastCommand((0.0,) * len(shape.joint_names), -math.inf)
        self._sent = self._sent_before = 0
        self._sent_s, self._first_sent_s = -math.inf, math.inf
        self._turned_s = self._turn_s = 0.0
        self._moves = False
        self._refused_s = -math.inf
        self._outgoing: list[tuple[bytes, bytes]] = []
        self._told_present, self._told_s = False, -math.inf
        self._said: set[Why] = set()
        self._notes: list[str] = []

    @property
    def said_limits(self) -> ArmLimits | None:
        """Limits that the first state said; None if it said none"""
        return self._said_limits

    def read_limits(self) -> None:
        """Judge states by the shape's limits as they are now."""
        self._plausibility.read_limits()

    @property
    def driver(self) -> bytes | None:
        """Peer of the driver; None while none is connected"""
        return self._peer

    def receive(self, peer: bytes, payload: bytes, received_s: float) -> None:
        """Take one message; an invalid message is rejected as a whole, counted and reported."""
        silent_s = received_s - self._heard_s
        if self._peer not in (None, peer) or (self._last_peer not in (None, peer) and silent_s <= TAKEN_OVER_S):
            why = f"a second driver sends, {silent_s:.2f} s after the first one did; valid: after {TAKEN_OVER_S:g} s"
            self._reject("second", why, peer, received_s)
            return
        try:
            said = decoded(payload, _DECODER, DRIVER_VERSION)
            self._require_fitting(said)
        except OtherVersionError as error:
            self._reject("version", str(error), peer, received_s)
        except RemoteProtocolError as error:
            self._reject("malformed", str(error), peer, received_s)
        except ValueError as error:
            self._reject("joints", str(error), peer, received_s)
        else:
            self._take(peer, said, received_s)

    def expire(self, now_s: float) -> None:
        """Forget a silent driver, so that another may connect; call this after `receive` of all arrived messages."""
        if self._peer is not None and now_s - self._heard_s > SILENT_S:
            self._peer = None
        if self._doubt is not None and now_s - self._doubted_s > _DOUBTED_S:
            self._doubt_states(None, now_s)
        present = self._peer is not None
        if present is not self._told_present and now_s - self._told_s >= _NEWS_PERIOD_S:
            self._told_present, self._told_s = present, now_s
            gone = f"arm lost: nothing heard from the driver for {now_s - self._heard_s:.2f} s"
            self._notes.append("driver: connected" if present else gone)

    def command(self, velocities_rad_s: FloatArray, until_s: float) -> None:
        """Store the arm's command for `outgoing`; until_s: when it expires, on our clock.

        ValueError as for `Arm.command`.
        """
        velocities = tuple(velocities_rad_s.tolist())
        if velocities_rad_s.shape != (len(self._shape.joint_names),) or not all(map(math.isfinite, velocities)):
            raise ValueError(
                f"joint_velocity_rad_s = {velocities_rad_s}; valid: {len(self._shape.joint_names)} finite numbers"
            )
        if not math.isfinite(until_s):
            raise ValueError(f"valid_until_s = {until_s}; valid: a finite time")
        self._last_command = _LastCommand(velocities, until_s)

    def command_gripper(self, closing: float, until_s: float) -> None:
        """Store the gripper's command, which expires at `until_s`. ValueError as for `Arm.command_gripper`."""
        if not (-1.0 <= closing <= 1.0 and math.isfinite(until_s)):
            raise ValueError(
                f"closing = {closing}, valid_until_s = {until_s}; valid: closing from -1 to 1, and a finite time"
            )
        self._closing = closing, until_s

    def outgoing(self, now_s: float) -> list[tuple[bytes, bytes]]:
        """Return the messages that must leave at `now_s`: (peer, payload)."""
        leaving, self._outgoing = self._outgoing, []
        closing = self._closing[0] if self._closing[1] > now_s else 0.0
        moves = (any(self._last_command.velocities) and self._last_command.until_s > now_s) or closing != 0.0
        if now_s > self._turned_s:
            self._turn_s, self._turned_s = now_s - self._turned_s, now_s
        due = now_s - self._sent_s + EARLY * self._turn_s >= COMMAND_PERIOD_S or (self._moves and not moves)
        if self._peer is not None and due:
            self._sent += 1
            self._sent_s, self._moves = now_s, moves
            self._first_sent_s = min(self._first_sent_s, now_s)
            velocities, until_s = self._last_command.velocities, self._clock.drivers_s(self._last_command.until_s)
            command = DriverCommand(DRIVER_VERSION, self._sent, now_s, velocities, closing, until_s)
            leaving.append((self._peer, encode(command)))
        return leaving

    def take_notes(self) -> list[str]:
        """Return the notes made since the last call, one line each."""
        notes, self._notes = self._notes, []
        return notes

    def summary(self) -> dict[str, int]:
        """Return the number of accepted states, and of rejected states by reason."""
        return {"accepted": self.accepted} | {str(why): count for why, count in self.rejected.items()}

    def _require_fitting(self, said: DriverState) -> None:
        """Raise ValueError for joints other than the model's, RemoteProtocolError if `measured_s` is after `sent_s`."""
        for name, values, names in (
            ("joint_positions", said.joint_positions, self._shape.joint_names),
            ("joint_velocities", said.joint_velocities, self._shape.joint_names),
            ("joint_loads", said.joint_loads, self._shape.joint_names),
            ("finger_positions", said.finger_positions, self._shape.finger_names),
        ):
            if values is not None and len(values) != len(names):
                raise ValueError(
                    f"{name} holds {len(values)} values; valid: {len(names)} ({', '.join(names) or 'none'})"
                )
        if said.limits is not None:
            ArmLimits(**msgspec.structs.asdict(said.limits)).of_joints(len(self._shape.joint_names))
        if not said.condition_text.isprintable():
            raise RemoteProtocolError(f"condition_text = {said.condition_text!r:.100}; valid: printable characters")
        if said.measured_s > said.sent_s:
            raise RemoteProtocolError(f"measured_s = {said.measured_s}; valid: up to sent_s = {said.sent_s}")

    def _take(self, peer: bytes, said: DriverState, received_s: float) -> None:
        if self._peer is None:
            # A driver that returns after a silence keeps its clock, so that its earlier messages count as old.
            if self._last_peer != peer or said.sequence <= self._sequence:
                self._begin(said.sequence)
                if self._last_peer == peer:
                    self._doubt_states("the driver was started again: look where the arm is", received_s)
            if self._last_peer not in (None, peer):
                self._doubt_states("another driver drives the arm now: look where it is", received_s)
                self._notes.append("driver: another one has taken over")
            self._peer = self._last_peer = peer
        if said.sequence <= self._sequence:
            why = f"sequence = {said.sequence}; valid: above that of the message before, {self._sequence}"
            self._reject("order", why, peer, received_s)
            return
        since_s = received_s - self._heard_s
        self._heard_s, self._sequence = received_s, said.sequence
        ours = said.echo_s is not None and self._first_sent_s <= said.echo_s <= received_s
        echoed = (said.echo_s, said.held_s) if ours and said.echo_s is not None else None
        if not self._clock.update(said.sent_s, received_s, echoed):
            self._clock = DriverClock()
            self._plausibility.new_clock(said.measured_s, since_s)
            why = "the driver's clock jumped, or echo_s and held_s are not from our commands"
            self._reject("clock", why, peer, received_s)
            return
        if said.limits is not None:
            limits = ArmLimits(**msgspec.structs.asdict(said.limits))
            if self.accepted == 0:
                self._said_limits = limits
            elif limits != self._said_limits:
                why = "the driver says other limits than at the start: start feelahead-robot again"
                self._doubt_states(why, received_s)
        positions, velocities = floats(said.joint_positions), floats(said.joint_velocities)
        if (fault := self._plausibility.fault(said.measured_s, positions, velocities)) is not None:
            self._doubt_states(f"the driver's states cannot be true: {fault}", received_s)
            self._reject("impossible", fault, peer, received_s)
            return
        if not self._clock.known:
            if self._sent - self._sent_before > _UNANSWERED:
                why = "echo_s is no time from our commands; valid: sent_s of the newest command that was read"
                self._reject("echo", why, peer, received_s)
            return
        # A late state has its true age: the arm is lost by that age until younger states come.
        measured_s = min(self._clock.ours_s(said.measured_s), received_s)
        self.accepted += 1
        self._measured_s = max(self._measured_s, measured_s)
        shape, fingers = self._shape, said.finger_positions
        self.state = ArmState(
            time_s=self._measured_s,
            joint_positions_rad=positions,
            joint_velocities_rad_s=velocities,
            finger_positions=shape.open_fingers if fingers is None else floats(fingers),
            gripper_opening_m=shape.opening_m if said.opening_m is None else said.opening_m,
            gripper_holding=said.holding,
            joint_loads_nm=None if said.joint_loads is None else floats(said.joint_loads),
            doubt=self._doubt,
            condition=_condition(said),
        )

    def _begin(self, sequence: int) -> None:
        """Begin with a new driver; sequence: number of its first message."""
        self._clock, self._sequence, self._sent_before = DriverClock(), sequence - 1, self._sent
        self._plausibility.restart()

    def _doubt_states(self, why: str | None, now_s: float) -> None:
        """Doubt the states for a while, for the first reason meanwhile; None: believe them again."""
        self._doubt, self._doubted_s = why and (self._doubt or why), now_s
        if self.state is not None:
            self.state = replace(self.state, doubt=self._doubt)

    def _reject(self, why: Why, text: str, peer: bytes, now_s: float) -> None:
        self.rejected[why] += 1
        if why not in self._said:
            self._said.add(why)
            self._notes.append(
                f"driver: a message was refused as a whole: {text} (further messages with this fault are only counted)"
            )
        if now_s - self._refused_s >= _REFUSAL_PERIOD_S:
            self._refused_s = now_s
            self._outgoing.append((peer, encode(Refusal(DRIVER_VERSION, text))))


def _condition(said: DriverState) -> str | None:
    """Return why the arm's own controller lets nothing move, in words; None if it is ready."""
    if said.condition == "ready":
        return None
    words = f"the arm is in {_CONDITIONS[said.condition]}"
    return f"{words}: {said.condition_text}" if said.condition_text else words
