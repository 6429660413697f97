"""Simulated traffic between two sides with different clocks, and the true offset and delays to compare with."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from common.arrays import FloatArray
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Hello, MotionCommand, StiffnessUpdate
from common.protocol.uniform_field import FAR_M, uniform_field

ROBOT_PERIOD_S = 1 / 1000
OPERATOR_PERIOD_S = 1 / 250
_HELLO_S = 0.25
_FREE = uniform_field(0)

Shape = Literal["normal", "exponential"]


@dataclass(frozen=True)
class Way:
    """Delays of one direction, in seconds: normal about `base_s`, or exponential above it. loss: share of messages."""

    shape: Shape
    base_s: float
    spread_s: float
    loss: float = 0.0

    def draw(self, generator: np.random.Generator, count: int) -> FloatArray:
        """Draw (count,) independent delays, none below 0; infinite for a lost message."""
        if self.shape == "normal":
            delays_s = np.maximum(generator.normal(self.base_s, self.spread_s, count), 0.0)
        else:
            delays_s = self.base_s + generator.exponential(self.spread_s, count)
        return np.where(generator.random(count) < self.loss, np.inf, delays_s)


@dataclass(frozen=True)
class Scenario:
    """Delays of both directions of a link, and how the two clocks differ."""

    to_robot: Way
    to_operator: Way
    skew: float
    """Seconds that the operator's clock gains on the robot's in one second"""
    asymmetry_s: float = 0.0
    """Minimum delay to the robot minus minimum delay to the operator, in seconds"""


@dataclass(frozen=True)
class OperatorClock:
    """The operator's clock, as a function of the robot's clock, which counts as the true time."""

    ahead_s: float
    skew: float

    def reads(self, true_s: float) -> float:
        """Return what this clock shows at the true time `true_s`."""
        return true_s * (1.0 + self.skew) + self.ahead_s


@dataclass(frozen=True, slots=True)
class Estimate:
    """Errors of one side's estimates when a message arrives: of the other clock's offset and of the one-way delay."""

    side: Literal["robot", "operator"]
    at_s: float
    offset_error_s: float | None
    bound_s: float | None
    one_way_error_s: float | None


class Traffic:
    """Both ends of a link, which send at their real rates for `duration_s`; iterating runs them."""

    def __init__(self, scenario: Scenario, seed: int, duration_s: float) -> None:
        generator = np.random.default_rng([seed, 4])
        self.clock = OperatorClock(float(generator.uniform(-1e5, 1e5)), scenario.skew)
        self.robot = LinkEnd("robot", 1, "robot's clock", seed, scenario.asymmetry_s)
        self.operator = LinkEnd("operator", 2, "operator's clock", seed, scenario.asymmetry_s)
        self._duration_s = duration_s
        # Their ticks are independent.
        phase_s = float(generator.uniform(0.0, OPERATOR_PERIOD_S))
        self._robot_sends_s = np.arange(0.0, duration_s, ROBOT_PERIOD_S)
        self._operator_sends_s = np.arange(phase_s, duration_s, OPERATOR_PERIOD_S)
        self._to_operator_s = scenario.to_operator.draw(generator, self._robot_sends_s.size)
        self._to_robot_s = scenario.to_robot.draw(generator, self._operator_sends_s.size)

    def __iter__(self) -> Iterator[Estimate]:
        sends = (self._robot_sends_s, self._operator_sends_s)
        arrivals = (sends[0] + self._to_operator_s, sends[1] + self._to_robot_s)
        times_s = np.concatenate([*sends, *arrivals])
        sizes = [part.size for part in (*sends, *arrivals)]
        kinds = np.repeat(np.arange(4), sizes)
        indices = np.concatenate([np.arange(size) for size in sizes])
        order = np.argsort(times_s, kind="stable")
        from_robot: list[Hello | StiffnessUpdate] = []
        from_operator: list[Hello | MotionCommand] = []
        for at_s, kind, index in zip(
            times_s[order].tolist(), kinds[order].tolist(), indices[order].tolist(), strict=True
        ):
            if at_s > self._duration_s:
                return
            if kind == 0:
                from_robot.append(self._say_robot(at_s))
            elif kind == 1:
                from_operator.append(self._say_operator(self.clock.reads(at_s)))
            elif kind == 2:
                yield self._arrive_at_operator(from_robot[index], at_s, float(self._to_operator_s[index]))
            else:
                yield self._arrive_at_robot(from_operator[index], at_s, float(self._to_robot_s[index]))

    def _say_robot(self, now_s: float) -> Hello | StiffnessUpdate:
        if self.robot.peer_epoch is None or now_s < _HELLO_S:
            return self.robot.hello(now_s)
        return StiffnessUpdate(
            self.robot.stamp(now_s), _FREE, _FREE, speed_m_s=0.0, horizon_m=FAR_M, rumble=0.0, state="disarmed"
        )

    def _say_operator(self, now_s: float) -> Hello | MotionCommand:
        if self.operator.peer_epoch is None:
            return self.operator.hello(now_s)
        return MotionCommand(self.operator.stamp(now_s), l2=0.0, r2=0.0)

    def _arrive_at_operator(self, message: Hello | StiffnessUpdate, at_s: float, delay_s: float) -> Estimate:
        now_s = self.clock.reads(at_s)
        one_way_s = self.operator.arrived(message, now_s).one_way_s
        return _judged("operator", self.operator, at_s, now_s, at_s - now_s, one_way_s, delay_s)

    def _arrive_at_robot(self, message: Hello | MotionCommand, at_s: float, delay_s: float) -> Estimate:
        one_way_s = self.robot.arrived(message, at_s).one_way_s
        return _judged("robot", self.robot, at_s, at_s, self.clock.reads(at_s) - at_s, one_way_s, delay_s)


def _judged(
    side: Literal["robot", "operator"],
    end: LinkEnd,
    at_s: float,
    now_s: float,
    true_offset_s: float,
    one_way_s: float | None,
    delay_s: float,
) -> Estimate:
    offset_s, bound_s = end.clock_offset.offset_at(now_s), end.clock_offset.bound_at(now_s)
    return Estimate(
        side,
        at_s,
        None if offset_s is None else offset_s - true_offset_s,
        bound_s,
        None if one_way_s is None else one_way_s - delay_s,
    )
