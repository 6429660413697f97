"""How a gripper moves with nothing in the way, from samples taken between the two ends of its inputs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from common.arrays import BoolArray, FloatArray, IntArray

# Without a force limit of its own, a servo leads a blocked drive by this share of the stroke at most.
_DEFAULT_FORCE_LEAD = 0.3
# Surfaces that come within this of the nearest pair when the gripper is closed take part in the grasp.
_GRASP_BAND_M = 2e-3
_SMALLEST_STROKE_M = 1e-3


@dataclass(frozen=True)
class GripperSample:
    """Where a gripper came to rest at one input."""

    control: FloatArray
    """(g,) the actuators' inputs"""
    fingers: FloatArray
    """(f,) positions of the fingers' joints"""
    length: float
    """the first actuator's own position, in its transmission's unit"""
    gaps_m: FloatArray
    """(p,) distances between pairs of the gripper's geoms, negative where they overlap"""


@dataclass(frozen=True)
class GripperServo:
    """The gripper's actuators: force = gain u - stiffness l - damping dl/dt, at most the limit; all (g,)."""

    gain: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    force_limit: FloatArray
    """infinite where there is none"""


@dataclass(frozen=True)
class GripperTravel:
    """The way from open to closed."""

    open_control: FloatArray
    """(g,) the actuators' inputs at which it is open"""
    closed_control: FloatArray
    """(g,) and closed"""
    open_fingers: FloatArray
    """(f,) positions of the fingers' joints when it is open"""
    references: FloatArray
    """(k,) shares of the way from the open to the closed input, increasing from 0"""
    lengths: FloatArray
    """(k,) where the first actuator stands then, increasing or decreasing"""
    openings_m: FloatArray
    """(k,) and the free gap between the fingers"""
    force_lead: float
    """The share of the stroke by which the reference leads a blocked drive at the largest allowed force."""
    lag_s: float
    """By how many shares of the stroke a moving drive lags behind its reference, for each share per second."""

    def __post_init__(self) -> None:
        for name in ("references", "lengths", "openings_m"):
            values = getattr(self, name)
            if values.shape != self.references.shape or values.size < 2 or not np.isfinite(values).all():
                raise ValueError(f"{name} = {values}; valid: (k,) finite values with k of 2 or more")
        steps = np.diff(self.lengths)
        if not (np.diff(self.references) > 0.0).all() or not ((steps > 0.0).all() or (steps < 0.0).all()):
            raise ValueError("references or lengths are not strictly monotone; valid: one way from open to closed")
        for name in ("force_lead", "lag_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} = {value}; valid: finite and 0 or more")


def candidate_ends(lower: FloatArray, upper: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """The pairs of inputs (g,) between which a gripper may open and close, from its actuators' ranges (g,).

    Two actuators may run the same way or against each other; more than two are taken to run the same way.
    """
    count = lower.size
    choices = product((False, True), repeat=count - 1) if count <= 2 else [(False,) * (count - 1)]
    swapped = [np.array((False, *choice)) for choice in choices]
    return [(np.where(swap, upper, lower), np.where(swap, lower, upper)) for swap in swapped]


def jaw_pairs(geoms: IntArray, bodies: IntArray, on_finger: BoolArray) -> list[tuple[int, int]]:
    """The pairs of a gripper's geoms between which something can be gripped; all arguments (k,).

    At least one of the two is on a finger, and they are on different bodies.
    """
    return [
        (int(geoms[a]), int(geoms[b]))
        for a in range(geoms.size)
        for b in range(a)
        if (on_finger[a] or on_finger[b]) and bodies[a] != bodies[b]
    ]


def jaw_stroke_m(samples: Sequence[GripperSample]) -> float:
    """By how much the gap that changes most changes over `samples`."""
    gaps = np.array([sample.gaps_m for sample in samples])
    return float(np.ptp(gaps, axis=0).max(initial=0.0))


def travel_from_samples(samples: Sequence[GripperSample], servo: GripperServo) -> GripperTravel | None:
    """The gripper's travel from samples at evenly spaced inputs from one end to the other.

    The free gap is between those surfaces that move far and are nearest to each other when it is closed.
    None when no gap changes or the drive does not move. ValueError for fewer than two samples.
    """
    if len(samples) < 2:
        raise ValueError(f"samples holds {len(samples)}; valid: 2 or more")
    if jaw_stroke_m(samples) < _SMALLEST_STROKE_M:
        return None
    gaps = np.array([sample.gaps_m for sample in samples])
    jaws = gaps[:, np.ptp(gaps, axis=0) > 0.5 * jaw_stroke_m(samples)]
    if jaws[0].min() < jaws[-1].min():
        samples, jaws = samples[::-1], jaws[::-1]
    jaws = jaws[:, jaws[-1] <= jaws[-1].min() + _GRASP_BAND_M]
    openings = np.maximum(jaws.min(axis=1), 0.0)

    lengths = np.array([sample.length for sample in samples])
    stroke = lengths[-1] - lengths[0]
    if stroke == 0.0:
        return None
    closures = (lengths - lengths[0]) / stroke
    # Fingers that press on each other stop the drive before its input ends.
    highest_before = np.concatenate([[-np.inf], np.maximum.accumulate(closures)[:-1]])
    moving = closures > highest_before + 1e-3
    references = np.linspace(0.0, 1.0, len(samples))

    control_stroke = np.abs(samples[-1].control - samples[0].control)
    with np.errstate(divide="ignore", invalid="ignore"):
        leads = servo.force_limit / np.abs(servo.gain * control_stroke)
        lags = np.where(servo.stiffness > 0.0, servo.damping / servo.stiffness, 0.0)
    return GripperTravel(
        open_control=samples[0].control,
        closed_control=samples[-1].control,
        open_fingers=samples[0].fingers,
        references=references[moving],
        lengths=lengths[moving],
        openings_m=openings[moving],
        force_lead=min(_DEFAULT_FORCE_LEAD, float(leads.min())),
        lag_s=float(lags.max()),
    )
