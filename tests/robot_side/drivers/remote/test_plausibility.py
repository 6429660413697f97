"""States that cannot be true are found within a moment, and honest drivers are never doubted."""

import math
import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.arm.limits import JointLimits
from robot_side.drivers.remote.plausibility import Plausibility
from tests.robot_side.drivers.remote.driver_desk import DriverDesk

FASTEST, JOINTS = 2.0, 3
LIMITS = JointLimits(
    np.full(JOINTS, FASTEST),
    np.full(JOINTS, 8.0),
    np.array([-1.5, -math.pi, 0.0]),
    np.array([1.5, math.pi, 1.0]),
    np.array([False, False, True]),
)
NAMES = ("shoulder", "elbow", "rail")
Said = tuple[float, FloatArray, FloatArray]
Place = Callable[[int], FloatArray | float]
SCALE = np.array([1.0, 1.0, 0.2])
"""A metre counts as 0.2 m does at a turn of one rad"""


def judge() -> Plausibility:
    return Plausibility(NAMES, LIMITS, 0.001)


def motion(generator: np.random.Generator, seconds: float, step_s: float = 0.001) -> tuple[FloatArray, FloatArray]:
    """Return positions and velocities (t, n) of joints that are driven to random velocities, with overshoot."""
    velocities, target = np.zeros((round(seconds / step_s), JOINTS)), np.zeros(JOINTS)
    now = np.zeros(JOINTS)
    for k in range(len(velocities)):
        if generator.random() < step_s / 0.3:
            target = generator.choice([-1.2, -0.3, 0.0, 0.02, 0.5, 1.2], JOINTS) * FASTEST * SCALE
        now = now + np.clip(target - now, -12.0 * SCALE * step_s, 12.0 * SCALE * step_s)
        velocities[k] = now
    return np.cumsum(velocities * step_s, axis=0), velocities


@given(
    seed=st.integers(0, 2**32 - 1),
    rate_hz=st.floats(30.0, 250.0),
    lost=st.sampled_from([0.0, 0.1, 0.6]),
    uneven_s=st.sampled_from([0.0, 0.002, 0.008]),
    noise=st.sampled_from([0.0, 0.001]),
    resolution=st.sampled_from([0.0, 0.0015]),
    lag_s=st.sampled_from([0.0, 0.02, 0.05]),
    wrong=st.floats(0.8, 1.2),
    jumps=st.booleans(),
)
def test_an_honest_driver_is_never_doubted(
    seed: int,
    rate_hz: float,
    lost: float,
    uneven_s: float,
    noise: float,
    resolution: float,
    lag_s: float,
    wrong: float,
    *,
    jumps: bool,
) -> None:
    """Its states are lost, late, unevenly stamped, noisy and in steps; its velocities lag; its clock may jump."""
    generator, plausibility = np.random.default_rng(seed), judge()
    positions, velocities = motion(generator, 3.0)
    told, before_s, before_k, ahead_s = np.zeros(JOINTS), -math.inf, 0, 100.0
    for time_s in np.arange(0.0, 2.95, 1.0 / rate_hz):
        k = round(1000.0 * time_s)
        told = told + (1.0 - math.exp(-(k - before_k) * 0.001 / lag_s) if lag_s else 1.0) * (velocities[k] - told)
        before_k = k
        if generator.random() < lost and time_s - before_s < 0.09:
            continue
        read = positions[k] + generator.normal(0.0, noise, JOINTS) * SCALE
        if resolution:
            read = resolution * np.rint(read / resolution)
        read[1] = math.remainder(read[1], 2.0 * math.pi)
        if jumps and generator.random() < 0.02 and math.isfinite(before_s):
            ahead_s += generator.uniform(-50.0, 50.0)
            plausibility.new_clock(time_s + ahead_s, time_s - before_s)
        before_s, stamp_s = time_s, time_s + generator.uniform(0.0, uneven_s) + ahead_s
        said = wrong * told + generator.normal(0.0, 10.0 * noise, JOINTS) * SCALE
        assert plausibility.fault(stamp_s, read, said) is None


def says(place: Place, velocity: float) -> Iterator[Said]:
    """Return states at 100 Hz that tell positions `place(k)` (n,) and one velocity."""
    return (
        (0.01 * k, np.broadcast_to(0.1 + place(k), JOINTS).copy(), np.full(JOINTS, velocity)) for k in range(1, 100)
    )


def random_places(_: int) -> FloatArray:
    return np.random.default_rng(0).uniform(-1e6, 1e6, JOINTS)


@pytest.mark.parametrize(
    ("place", "velocity", "found", "within_s"),
    [
        (lambda k: random_places(k) if k > 5 else 0.0, 0.0, r"joint \d \(\w+\): moved by .* in 10 ms", 0.1),
        (lambda k: 0.5 * (k > 20), 0.0, r"joint 1 .*: moved by 0.5 rad in 10 ms; valid: up to 0.146 rad", 0.3),
        (lambda k: 0.02 * (k > 20), 0.0, None, 9.9),
        (lambda k: np.array([0.0, 0.0, 0.1 * (k > 9)]), 0.0, r"joint 3 \(rail\): moved by 0.1 m in 10 ms", 0.2),
        # Steps of which each alone may be noise.
        (lambda k: np.array([0.09 * k, 0.0, 0.0]), 0.0, r"joint 1 .*: moved by 0.27 rad in 30 ms; .* 0.226 rad", 0.1),
        (lambda _: 0.0, 1e6, r"joint 1 \(shoulder\): velocity = 1e\+06 rad/s; valid: up to 4 rad/s", 0.02),
        (lambda _: 0.0, 1.9, r"joint \d .* moved by 0 \w+, but its velocities tell", 0.5),
        (lambda k: 0.019 * k, 0.0, r"joint \d .* moved by 0.\d+ \w+, but its velocities tell 0 ", 0.5),
        (lambda k: 0.01 * k, -1.0, r"joint \d .* tell -0.\d+ \w+; valid: at most", 0.4),
    ],
)
def test_a_lie_is_found_and_named_by_joint_value_and_limit(
    place: Place, velocity: float, found: str | None, within_s: float
) -> None:
    plausibility = judge()
    fault, at_s = next(
        ((fault, one[0]) for one in says(place, velocity) if (fault := plausibility.fault(*one))), (None, 0.0)
    )
    assert at_s <= within_s
    assert fault is None if found is None else re.match(found, fault or "")


def test_another_clock_excuses_no_jump() -> None:
    plausibility = judge()
    at_rest = np.zeros(JOINTS)
    for k in range(20):
        assert plausibility.fault(0.01 * k, at_rest, at_rest) is None
    plausibility.new_clock(1000.0, 0.01)
    assert "moved by 0.5 rad in 10 ms" in (plausibility.fault(1000.0, at_rest + 0.5, at_rest) or "")


@pytest.mark.parametrize(
    ("lie", "says"),
    [
        ({"joint_positions": [0.5, 0.0]}, "joint 1 (shoulder): moved by 0.5 rad in 4 ms; valid: up to 0.116 rad"),
        ({"joint_velocities": [0.0, -1e6]}, "joint 2 (elbow): velocity = -1e+06 rad/s; valid: up to 4 rad/s"),
    ],
)
def test_a_state_that_cannot_be_true_is_refused_and_doubted_for_half_a_second(lie: dict[str, Any], says: str) -> None:
    desk = DriverDesk()
    desk.run(0.505)
    desk.say(**lie)
    desk.say(**lie)
    desk.run(0.1)
    state = desk.arm.state(desk.now_s)
    assert state.doubt == f"the driver's states cannot be true: {says}"
    assert abs(state.joint_positions_rad).max() < 0.2
    assert abs(state.joint_velocities_rad_s).max() == 0.0
    assert says in desk.refused[0]
    assert len([note for note in desk.notes if says in note]) == 1
    assert desk.arm.session.rejected["impossible"] >= 1
    desk.run(0.6)
    assert desk.arm.state(desk.now_s).doubt is None


@pytest.mark.parametrize("jump_s", [-900.0, 900.0])
@pytest.mark.parametrize(("lie", "doubted"), [(0.0, False), (0.5, True)])
def test_a_drivers_clock_that_jumps_neither_excuses_a_jump_nor_is_one(
    monkeypatch: pytest.MonkeyPatch, jump_s: float, lie: float, *, doubted: bool
) -> None:
    desk = DriverDesk()
    desk.run(0.5)
    desk.run(0.5, velocity=1.5)
    clock = desk.drivers_s + jump_s - desk.now_s
    monkeypatch.setattr(DriverDesk, "drivers_s", property(lambda self: self.now_s + clock))
    desk.newest = None
    while not desk.arm.session.rejected["clock"]:
        desk.run(0.001, velocity=1.5)
    desk.joints = desk.joints + lie
    desk.run(0.1, velocity=1.5)
    assert (desk.arm.session.rejected["impossible"] > 0) is doubted
