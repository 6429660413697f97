"""Limits of the arm's joints and the latency of its drives: as set or said by a driver, and as everything uses them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Final

import numpy as np
from msgspec import Meta

from common.arrays import BoolArray, FloatArray
from common.limits import check_limits

VELOCITY_RAD_S: Final = 2.0
"""Below the 3.14 rad/s of a UR5e and the 2.17 rad/s of a Franka arm's large joints (data sheets)"""
ACCELERATION_RAD_S2: Final = 8.0
DECELERATION_RAD_S2: Final = 12.0

_Limit = Annotated[float, Meta(ge=1e-3, le=1e6)]
_LATEST_S: Final = 1.0
"""Longest time in which an arm may respond"""
EachJoint = _Limit | tuple[_Limit, ...]


@dataclass(frozen=True)
class ArmLimits:
    """Limits of the arm's own controller, for any command: one number for all joints, or one for each.

    Metres instead of radians for a joint that slides. A real arm's are in its data sheet, come from its driver, or are
    measured by --measure-limits.
    """

    velocity_rad_s: EachJoint | None = None
    """Largest velocity of a joint, 2 unless known. The robot side commands no more."""
    acceleration_rad_s2: EachJoint | None = None
    """Largest acceleration while a command is followed, also of a joint that slows down; 8 unless known."""
    deceleration_rad_s2: EachJoint | None = None
    """Deceleration after the last command has expired, 12 unless known. Only a simulated arm needs it."""
    jerk_rad_s3: EachJoint | None = None
    """Largest change of the acceleration in a second; unless known, the acceleration changes at once."""
    latency_s: Annotated[float, Meta(ge=0.0, le=1.0)] | None = None
    """Time from a command's arrival at the driver until the joints begin to follow it; 0 unless known."""
    load_nm: EachJoint | None = None
    """Load of a joint, beyond what moves and holds the arm itself, at which the arm stops; N of a joint that slides."""

    def __post_init__(self) -> None:
        check_limits(self)

    def of_joints(
        self,
        count: int,
        lower_rad: FloatArray | None = None,
        upper_rad: FloatArray | None = None,
        slides: BoolArray | bool = False,
    ) -> "JointLimits":
        """Return these limits for `count` joints (n); the other arguments are as in `JointLimits`.

        ValueError names a limit that has another number of values than there are joints, and for a late response.
        """

        def each(name: str, value: EachJoint | None, unless_known: float) -> FloatArray:
            values: float | Sequence[float] = unless_known if value is None else value
            if isinstance(value, tuple) and len(value) != count:
                raise ValueError(f"arm.limits.{name} holds {len(value)} values; valid: one number, or {count}")
            return np.broadcast_to(np.asarray(values, dtype=np.float64), (count,)).copy()

        limits = JointLimits(
            each("velocity_rad_s", self.velocity_rad_s, VELOCITY_RAD_S),
            each("acceleration_rad_s2", self.acceleration_rad_s2, ACCELERATION_RAD_S2),
            lower_rad,
            upper_rad,
            slides,
            each("deceleration_rad_s2", self.deceleration_rad_s2, DECELERATION_RAD_S2),
            each("jerk_rad_s3", self.jerk_rad_s3, math.inf),
            self.latency_s or 0.0,
            each("load_nm", self.load_nm, math.inf),
        )
        if limits.response_s > _LATEST_S:
            raise ValueError(
                f"arm.limits: latency, and half of acceleration by jerk, are {limits.response_s:.3g} s; valid: up to"
                f" {_LATEST_S:g} s"
            )
        return limits

    def unless_known(self, others: "ArmLimits") -> "ArmLimits":
        """Return these limits, with the others' where these are not known."""
        return replace(others, **self._known())

    def sources(self, said: "ArmLimits") -> str:
        """Tell which limits are these, the settings', and which are those that the arm's driver said."""
        sources = ("from the settings", self._known()), ("from its driver", said._known().keys() - self._known().keys())
        told = [f"{', '.join(sorted(names))} {source}" for source, names in sources if names]
        both = self.unless_known(said)
        if both.velocity_rad_s is None or both.acceleration_rad_s2 is None:
            told.append(
                f"where velocity or acceleration is not known, {VELOCITY_RAD_S:g} rad/s and {ACCELERATION_RAD_S2:g}"
                " rad/s² are assumed (to measure them: feelahead-robot --measure-limits)"
            )
        return "; ".join(told)

    def _known(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if value is not None}


@dataclass
class JointLimits:
    """Limits of the joints in the arm's own controller, (n,) each; metres instead of radians for a prismatic joint.

    They change at most once, before the first turn: when a driver's first state says its arm's.
    """

    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray
    lower_rad: FloatArray | None = None
    """Lower end of each joint's range; None if all are unknown or without ends"""
    upper_rad: FloatArray | None = None

    slides: BoolArray | bool = False
    """Whether each joint slides"""
    deceleration_rad_s2: FloatArray = field(default_factory=lambda: np.array([DECELERATION_RAD_S2]))
    """Deceleration of a simulated arm after the last command has expired"""
    jerk_rad_s3: FloatArray = field(default_factory=lambda: np.array([np.inf]))
    latency_s: float = 0.0
    load_nm: FloatArray = field(default_factory=lambda: np.array([np.inf]))
    """Load at which the arm stops; infinite without a limit"""

    def __post_init__(self) -> None:
        infinite = np.full(self.velocity_rad_s.size, np.inf)
        self.ends_rad: tuple[FloatArray, FloatArray] = (
            -infinite if self.lower_rad is None else np.ascontiguousarray(self.lower_rad),
            infinite if self.upper_rad is None else np.ascontiguousarray(self.upper_rad),
        )
        """Lower and upper ends of the joints' ranges; infinite if not given"""

    @property
    def response_s(self) -> float:
        """Time by which the arm answers a command later than one of unlimited jerk and no latency, in s.

        A ramp of velocity with limited jerk ends a/j later than one without, and is half of that behind on the way: v²
        / 2a + v a / 2j. A ramp too short to reach a is behind by less.
        """
        return self.latency_s + 0.5 * float((self.acceleration_rad_s2 / self.jerk_rad_s3).max(initial=0.0))

    def take(self, said: "JointLimits") -> None:
        """Take the limits that a driver says of its arm; the ranges' ends stay."""
        for name in ("velocity_rad_s", "acceleration_rad_s2", "deceleration_rad_s2", "jerk_rad_s3", "load_nm"):
            setattr(self, name, getattr(said, name))
        self.latency_s = said.latency_s
