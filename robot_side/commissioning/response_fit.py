"""Response of a joint's drive, fitted to all measured positions.

Model: a command takes effect after the latency. The velocity then rises with one acceleration and falls with another,
and both begin and end with the same jerk.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.optimize import least_squares

from common.arrays import FloatArray
from robot_side.commissioning.joint_runs import JointRuns, Run

_BEGINS: Final = ((2.0, 100.0), (2.0, 1e4), (10.0, 100.0), (10.0, 1e4))
"""Accelerations and jerks from which the fit begins; the best is followed to its end"""
_COARSE, _FINE = 12, 60
"""Steps of the fit"""
_MOVES_RAD: Final = 0.002
_LARGEST_S: Final = 1.0
_LARGEST_ACCELERATION: Final = 500.0
_JERKS: Final = (1.0, 1e5)
_TOLD: Final = 0.25
"""Largest standard deviation of a figure, as a share of it, with which it is shown"""
_RAMP_PERIODS: Final = 2.0
"""Least duration of a ramp, in times between two states, from which its acceleration is shown"""
_ROUNDED_S: Final = 0.03
"""Shortest time to the full acceleration from which the jerk is shown; servos round off by 10 to 20 ms, too"""
_CRUISES_S: Final = 0.04
_HELD: Final = 0.97
"""Share of the commanded speed below which the arm held back"""


@dataclass(frozen=True)
class Figure:
    """Measured figure."""

    value: float
    at_least: bool = False
    """Whether the true one may be greater: the speed was too low or the room too small for it"""


@dataclass(frozen=True)
class JointResponse:
    """Motion of one joint as it really is; metres instead of radians where it slides. None: it cannot be told."""

    velocity_rad_s: Figure
    """Greatest speed reached"""
    acceleration_rad_s2: Figure
    """While speeding up"""
    deceleration_rad_s2: Figure
    """While slowing down to a commanded stand"""
    jerk_rad_s3: float | None
    latency_s: float
    """From command to motion; half of the rounding is in it where no jerk is shown"""
    noise_rad: float
    """Standard deviation of the readings at rest"""
    off_rad: float
    """Root mean square of what the fit misses"""


def fitted(measured: JointRuns) -> JointResponse:
    """Return the response that fits the runs best."""
    runs, count = measured.runs, len(measured.runs)
    speeds = np.array([abs(run.velocity_rad_s) for run in runs])
    ways, held_s = [_way(run) for run in runs], [run.ended_s - run.began_s for run in runs]

    def missed(parameters: FloatArray) -> FloatArray:
        latency, (up, down, jerk) = float(parameters[0]), np.exp(parameters[1:4]).tolist()
        each = zip(ways, held_s, (parameters[4:] * speeds).tolist(), strict=True)
        return np.concatenate(
            [_model(times, held, speed, latency, up, down, jerk) - way for (times, way), held, speed in each]
        )

    slowest = np.log(0.05 * speeds.max())
    lower = np.array([0.0, slowest, slowest, np.log(_JERKS[0]), *np.full(count, 0.2)])
    upper = np.array([_LARGEST_S, *np.full(2, np.log(_LARGEST_ACCELERATION)), np.log(_JERKS[1]), *np.full(count, 1.1)])

    def fit(begin: FloatArray, steps: int) -> Any:
        scales = [0.02, 0.3, 0.3, 0.3, *np.full(count, 0.1)]
        return least_squares(
            missed, np.clip(begin, lower, upper), bounds=(lower, upper), x_scale=scales, max_nfev=steps
        )

    shares = [run.peak_rad_s / speed for run, speed in zip(runs, speeds.tolist(), strict=True)]
    moves_s = min(float(times[(way > _MOVES_RAD).argmax()]) for times, way in ways[-2:])
    begins = [np.array([0.6 * moves_s, *np.log([a, a, jerk]), *shares]) for a, jerk in _BEGINS]
    coarse = min((fit(begin, _COARSE) for begin in begins), key=lambda one: float(one.cost))
    best = fit(coarse.x, _FINE)
    off = float(np.sqrt(2.0 * best.cost / best.fun.size))
    deviations = off * _deviations(best.jac)
    latency, (up, down, jerk) = float(best.x[0]), np.exp(best.x[1:4]).tolist()
    fits = list(zip(held_s, speeds.tolist(), (best.x[4:] * speeds).tolist(), strict=True))
    surely = (3.0 * deviations[4:] * speeds).tolist()
    fastest = max(min(reached, speed, up * held) for held, speed, reached in fits)
    rounding = min(up, down) / jerk
    ramps_s = [reached / up + rounding + _CRUISES_S for _, _, reached in fits]
    held_back = any(  # a slower run that fell short was disturbed, as a faster one followed
        speed == speeds.max() and reached + most < _HELD * speed and held > ramp_s
        for (held, speed, reached), ramp_s, most in zip(fits, ramps_s, surely, strict=True)
    )
    # An acceleration that the jerk does not let the arm come to cannot be told.
    shortest_s = max(_RAMP_PERIODS * measured.period_s, 1e-3)

    def figure(value: float, deviation: float) -> Figure:
        # The logarithm's deviation is the share of the value.
        most = min(fastest / shortest_s, float(np.sqrt(jerk * fastest)))
        told = deviation < _TOLD and value < most
        return Figure(min(value, most), at_least=not told)

    rounded = rounding > max(_ROUNDED_S, _RAMP_PERIODS * measured.period_s) and float(deviations[3]) < _TOLD
    return JointResponse(
        Figure(fastest, at_least=not held_back),
        figure(up, float(deviations[1])),
        figure(down, float(deviations[2])),
        jerk if rounded else None,
        latency + (0.0 if rounded else 0.5 * rounding),
        measured.noise_rad,
        off,
    )


def _way(run: Run) -> tuple[FloatArray, FloatArray]:
    """Return times since the command (k,), and ways (k,) in its direction from where the joint rested."""
    times, positions = np.array(run.times_s) - run.began_s, np.array(run.positions_rad)
    return times, np.sign(run.velocity_rad_s) * (positions - positions[times <= 0.0].mean())


def _model(
    times: FloatArray, held_s: float, speed: float, latency: float, up: float, down: float, jerk: float
) -> FloatArray:
    """Return the ways (k,) at `times` (k,) after a command of `speed` that holds for `held_s`."""
    speed = min(speed, up * held_s)
    way = np.zeros_like(times)
    for at_s, most, sign in ((0.0, up, 1.0), (held_s, down, -1.0)):
        # A change too small for the full acceleration has the one that the jerk reaches halfway.
        slope = min(most, float(np.sqrt(jerk * speed)))
        rounding = slope / jerk
        for begins_s, bends in ((at_s, sign * slope), (at_s + speed / slope, -sign * slope)):
            # Mean of slope t² / 2 over the rounding
            since = np.maximum(times - latency - begins_s, 0.0)
            until = np.maximum(times - latency - begins_s - rounding, 0.0)
            way += bends * (since**3 - until**3) / (6.0 * rounding)
    return way


def _deviations(jacobian: FloatArray) -> FloatArray:
    """Return the parameters' standard deviations for misses of 1; infinite for those that change nothing."""
    sizes = np.linalg.norm(jacobian, axis=0)
    told = sizes > 1e-12
    inverse = np.linalg.pinv((jacobian[:, told] / sizes[told]).T @ (jacobian[:, told] / sizes[told]), hermitian=True)
    deviations = np.full(sizes.size, np.inf)
    deviations[told] = np.sqrt(np.maximum(np.diag(inverse), 0.0)) / sizes[told]
    return deviations
