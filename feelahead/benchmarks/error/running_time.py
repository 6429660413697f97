"""What each way to propagate the error costs a tick: processor time, in short pieces that take turns."""

import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from common.arrays import FloatArray
from feelahead.benchmarks.error.chain import Chain
from feelahead.benchmarks.error.gripper import PosedGripper
from feelahead.benchmarks.error.propagation import linear, unscented
from robot_side.enlargement.kinematic_error import directional_variance, position_covariance

DRAWS = (100, 1_000, 10_000)
"""Monte Carlo, by how many draws."""
_PIECE_S = 0.001
_ENCODER_RAD = 2e-4


def best_microseconds(
    calls: Mapping[str, Callable[[], object]], rounds: int, advance: Callable[[], None]
) -> dict[str, float]:
    """Processor time of one call of each, the best of `rounds` pieces of a millisecond or one call.

    The pieces take turns: what else the machine does hits all alike. `advance` is called after each round.
    """
    for call in calls.values():
        call()
    repeats = {name: max(1, round(_PIECE_S / max(seconds_of(call), 1e-9))) for name, call in calls.items()}
    best_s = dict.fromkeys(calls, float("inf"))
    for _ in range(rounds):
        for name, call in calls.items():
            best_s[name] = min(best_s[name], seconds_of(call, repeats[name]) / repeats[name])
        advance()
    return {name: 1e6 * seconds for name, seconds in best_s.items()}


def seconds_of(call: Callable[[], object], repeats: int = 1) -> float:
    """Processor time of this thread for so many calls."""
    start_s = time.thread_time()
    for _ in range(repeats):
        call()
    return time.thread_time() - start_s


def propagation_calls(gripper: PosedGripper) -> dict[str, Callable[[], object]]:
    """Each method at home, for one point and one direction.

    "linear" has the Jacobian at hand, as a tick has; with its kinematics it can be compared with the others. "once"
    costs nothing but its kinematics at the start. "unscented" takes its 2n + 1 poses one by one from the simulator;
    Monte Carlo goes through all draws at a time, by `Chain`.
    """
    pose = gripper.at(gripper.home_rad)
    axis, joints = pose.tool_rotation[:, 2], len(gripper.home_rad)
    jacobian = pose.tool_jacobian[:3]
    jacobians, axes, noise = jacobian[None], axis[None], np.full(joints, _ENCODER_RAD)
    chain = Chain(pose.tool_jacobian, pose.tool_position_m, pose.tool_position_m)
    generator = np.random.default_rng(0)

    def by_poses(changes_rad: FloatArray) -> FloatArray:
        return np.array([gripper.at(gripper.home_rad + change).tool_position_m for change in changes_rad])

    def with_kinematics() -> object:
        here = gripper.at(gripper.home_rad)
        return linear(here.tool_jacobian[:3], _ENCODER_RAD, here.tool_rotation[:, 2])

    def by_draws(draws: int) -> object:
        errors_rad = _ENCODER_RAD * generator.standard_normal((draws, joints))
        return (chain.displacements(errors_rad) @ axis).std()

    calls: dict[str, Callable[[], object]] = {
        "linear": lambda: directional_variance(position_covariance(jacobians, noise), axes),
        "linear, with kinematics": with_kinematics,
        "unscented": lambda: unscented(by_poses, joints, _ENCODER_RAD, axis),
    }
    calls |= {monte_carlo_name(draws): partial(by_draws, draws) for draws in DRAWS}
    return calls


def monte_carlo_name(draws: int) -> str:
    """As the tables have it."""
    return f"Monte Carlo, {draws}"


def monte_carlo_errors() -> Iterator[tuple[str, float]]:
    """The standard error of a standard deviation from so many draws of a normal distribution, as a share of it."""
    for draws in DRAWS:
        yield monte_carlo_name(draws), float(1.0 / np.sqrt(2.0 * (draws - 1)))
