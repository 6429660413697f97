"""Messages between an arm's driver and the robot side (docs/drivers.md): maps in MessagePack."""

from typing import Annotated, Any, Final, Literal, TypeVar

import msgspec
import numpy as np
from msgspec import Meta, Struct

from common.arrays import FloatArray
from common.errors import OtherVersionError, RemoteProtocolError

DRIVER_VERSION: Final = 1
STATE_LIMIT_BYTES: Final = 4096
MOST_JOINTS: Final = 64

_Count = Annotated[int, Meta(ge=0, le=2**53)]
_Duration = Annotated[float, Meta(ge=0.0, lt=1e6)]
_Stamp = Annotated[float, Meta(ge=-1e12, le=1e12)]
"""Time in s; beyond these limits a double no longer resolves milliseconds."""
_Opening = Annotated[float, Meta(ge=0.0, le=1.0)]
"""Free gap between the fingers, in m"""
_Value = Annotated[float, Meta(ge=-1e6, le=1e6)]
_Values = Annotated[tuple[_Value, ...], Meta(max_length=MOST_JOINTS)]
Message = TypeVar("Message", bound=Struct)


_Limits = Annotated[tuple[Annotated[float, Meta(ge=1e-3, le=1e6)], ...], Meta(max_length=MOST_JOINTS)]
Condition = Literal["ready", "protective_stop", "fault", "emergency_stop"]


class SaidLimits(Struct, frozen=True, forbid_unknown_fields=True):
    """Limits that a driver says of its arm, (n,) each; as in `ArmLimits`."""

    velocity_rad_s: _Limits | None = None
    acceleration_rad_s2: _Limits | None = None
    deceleration_rad_s2: _Limits | None = None
    jerk_rad_s3: _Limits | None = None
    latency_s: Annotated[float, Meta(ge=0.0, le=1.0)] | None = None
    load_nm: _Limits | None = None


class DriverState(Struct, frozen=True, forbid_unknown_fields=True):
    """State of the arm as its driver measured it; times are on the driver's clock."""

    version: int
    sequence: _Count
    """Number that rises with every message of a connection"""
    sent_s: _Stamp
    measured_s: _Stamp
    """Time of the measurement, no later than `sent_s`"""
    joint_positions: _Values
    """(n,) positions in the model's order, in rad, or in m for a prismatic joint"""
    joint_velocities: _Values
    """(n,) velocities, in rad/s or m/s"""
    echo_s: _Stamp | None = None
    """`sent_s` of the newest command that the driver has read; None before the first"""
    held_s: _Duration = 0.0
    """Time between reading that command and sending this message, in s"""
    finger_positions: _Values | None = None
    """(f,) positions of the joints beyond the tool's, in the model's order"""
    opening_m: _Opening | None = None
    holding: bool = False
    joint_loads: _Values | None = None
    """(n,) torques in N m, or forces in N, from the carried load"""
    condition: Condition = "ready"
    """Whether the arm's own controller lets it move, and if not, why"""
    condition_text: Annotated[str, Meta(max_length=200)] = ""
    """The arm's own words for its condition"""
    limits: SaidLimits | None = None
    """Limits of the arm; those of the driver's first state count"""


class DriverCommand(Struct, frozen=True):
    """Command to the driver's arm."""

    version: int
    sequence: int
    sent_s: float
    """Time of sending on the robot side's clock, which the driver echoes"""
    joint_velocities: tuple[float, ...]
    closing: float
    """Share of the gripper's full speed: 1 closes, -1 opens, 0 holds"""
    valid_until_s: float
    """Time on the driver's clock at which the arm stops, unless a newer command has come"""


class Heard(Struct, frozen=True):
    """Answer to a message whose sender echoes answers."""

    version: int
    sent_s: float
    """Time of sending on the robot side's clock"""


class Refusal(Struct, frozen=True):
    """Reason why the last message of the program that receives this was rejected."""

    version: int
    refused: str


_ENCODER: Final = msgspec.msgpack.Encoder()
_VERSION: Final = msgspec.msgpack.Decoder(dict[str, Any])
BAD_BYTES: Final = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)


def encode(message: DriverCommand | Refusal) -> bytes:
    """Pack a message."""
    return _ENCODER.encode(message)


def decoded(payload: bytes, decoder: "msgspec.msgpack.Decoder[Message]", version: int) -> Message:
    """Unpack and validate a message; RemoteProtocolError names an invalid field.

    OtherVersionError, a subclass of it, for a message of another version.
    """
    try:
        message = decoder.decode(payload)
    except BAD_BYTES as error:
        _require_version(payload, version)
        # It may quote a whole message.
        raise RemoteProtocolError(f"{error!s:.300}; valid: finite numbers, and fields as in docs/drivers.md") from error
    if (said := getattr(message, "version", None)) != version:
        raise OtherVersionError(f"version {said}; valid: {version}")
    return message


def _require_version(payload: bytes, version: int) -> None:
    """Raise OtherVersionError if the payload is a map of another version, whatever else the map holds."""
    try:
        said = _VERSION.decode(payload).get("version")
    except BAD_BYTES:
        return
    if isinstance(said, int) and said != version:
        raise OtherVersionError(f"version {said}; valid: {version}")


def floats(values: tuple[float, ...]) -> FloatArray:
    """Return a tuple of numbers as an array."""
    return np.array(values, dtype=np.float64)
