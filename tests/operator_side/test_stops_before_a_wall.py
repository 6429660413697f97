"""Delay compensation in a whole loop: where a constant force stops before a wall does not depend on the link.

A stand-in for the robot side is an arm on a line, which reports its exact distance from a wall. The operator side is
the real one.
"""

import math

import numpy as np
import pytest

from common.arrays import FloatArray
from common.link_model import DelayLine, LinkProfile
from common.protocol.codec import decode, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Compensation, Hello, LeaseNotice, Message, MotionCommand, StiffnessUpdate
from common.protocol.session import SessionState
from common.protocol.uniform_field import uniform_field
from operator_side.controller.state import Button
from operator_side.core import OperatorSide
from operator_side.core_settings import CoreSettings
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from tests.helpers.messages import field, onsets

STEP_S = 0.002
FULL_M_S, ACCELERATION_M_S2 = 0.25, 3.0
AHEAD_M, RAMP_M, HORIZON_M = 0.3, 0.012, 0.6


def line(delay_s: float, jitter_s: float, seed: int) -> DelayLine[bytes]:
    """Return the delay line for one direction of the link."""
    return DelayLine(LinkProfile.parse(f"delay {1e3 * delay_s:g}ms {1e3 * jitter_s:g}ms", seed=seed))


class Approach:
    """Operator side whose R2 a finger presses with a constant force, and an arm on a line before a wall."""

    def __init__(
        self, delay_s: float, jitter_s: float = 0.0, compensation: Compensation = "operator", speed_scale: float = 1.0
    ) -> None:
        self.side = OperatorSide(2, "clock", CoreSettings(compensation=compensation, speed_scale=speed_scale))
        self.robot = LinkEnd("robot", 1, "clock")
        self.device = SimulatedDualSense()
        self.device.set_buttons(frozenset({Button.L1}))
        self.there, self.back = line(delay_s, jitter_s, 1), line(delay_s, jitter_s, 2)
        self.loop_s = 2.0 * delay_s
        self.left_m, self.speed_m_s, self.wanted_m_s = AHEAD_M, 0.0, 0.0
        self.tick = 0

    def pull(self, force_n: float, duration_s: float) -> FloatArray:
        """Press R2 with `force_n` for `duration_s`; return the arm's speed after each step (n,)."""
        self.device.set_finger_force(0.0, force_n)
        speeds = []
        for _ in range(round(duration_s / STEP_S)):
            self.tick += 1
            self._operate(self.tick * STEP_S)
            self._move(self.tick * STEP_S)
            speeds.append(self.speed_m_s)
        return np.array(speeds)

    def _operate(self, now_s: float) -> None:
        for payload in self.back.pop(now_s):
            self.side.receive(payload, now_s)
        if (output := self.side.feel_now(now_s)) is not None:
            self.device.write(output, now_s)
        if (report := self.device.read(now_s)) is not None:
            self.side.read_state(report, now_s)
        if self.tick % 2 == 0:
            for message in self.side.motion(now_s):
                self.there.push(now_s, message.payload)

    def _move(self, now_s: float) -> None:
        for payload in self.there.pop(now_s):
            message = decode(payload)
            if isinstance(message, Hello | MotionCommand) and self.robot.arrived(message, now_s).fresh:
                self.wanted_m_s = FULL_M_S * (message.r2 - message.l2) if isinstance(message, MotionCommand) else 0.0
        most = ACCELERATION_M_S2 * STEP_S
        self.speed_m_s += min(max(self.wanted_m_s - self.speed_m_s, -most), most)
        self.left_m -= self.speed_m_s * STEP_S
        self._say(self.robot.hello(now_s), now_s, every=50)
        notice = LeaseNotice(self.robot.stamp(now_s), session=SessionState.ARMED, why="", token=1, waiting=0)
        self._say(notice, now_s, every=50)
        self._say(self._ahead(now_s), now_s, every=1)

    def _say(self, message: Message, now_s: float, every: int) -> None:
        if self.tick % every == 0:
            self.back.push(now_s, encode(message))

    def _ahead(self, now_s: float) -> StiffnessUpdate:
        """Return the stiffness message for the wall: overlap grows with the square of the distance."""
        begin_m = [self.left_m - RAMP_M * (1.0 - math.sqrt((strength - 0.5) / 8)) for strength in range(1, 9)]
        wall = field(
            onsets(*(min(metres, HORIZON_M) for metres in begin_m)),
            full_speed_m_s=FULL_M_S,
            acceleration_m_s2=ACCELERATION_M_S2,
            displacement_m=self.speed_m_s * self.loop_s,
        )
        return StiffnessUpdate(
            self.robot.stamp(now_s),
            uniform_field(0),
            wall,
            speed_m_s=self.speed_m_s,
            horizon_m=HORIZON_M,
            rumble=0.0,
            state="armed",
        )


def begun(delay_ms: float, jitter_ms: float = 0.0) -> Approach:
    """Return an approach after one second, in which the link has come up and commands have arrived."""
    approach = Approach(1e-3 * delay_ms, 1e-3 * jitter_ms)
    approach.pull(0.0, 1.0)
    return approach


@pytest.mark.parametrize(("delay_ms", "jitter_ms"), [(0, 0), (50, 10), (200, 0), (400, 10)])
def test_a_finger_of_two_newtons_stops_at_the_same_place_whatever_the_link(delay_ms: int, jitter_ms: int) -> None:
    approach = begun(delay_ms, jitter_ms)
    speeds = approach.pull(2.0, 8.0)
    # Strength 6 in the first zone stops a finger of 2 N. It begins 12 (1 - sqrt(5.5 / 8)) = 2.0 mm before the wall.
    # The 4.5 mm/s that the zone commands need 1.4 mm.
    assert 1e3 * approach.left_m == pytest.approx(3.3, abs=0.2)
    assert speeds.max() > 0.1
    assert np.abs(speeds[-500:]).max() < 1e-3
    assert approach.side.haptics.writes < 120


@pytest.mark.parametrize(("delay_ms", "scale"), [(200, 1.0), (0, 0.5), (200, 0.25)])
def test_at_any_speed_scale_it_stops_at_the_wall_and_is_never_faster_than_the_scale(
    delay_ms: int, scale: float
) -> None:
    approach = Approach(1e-3 * delay_ms, speed_scale=scale)
    approach.pull(0.0, 1.0)
    speeds = approach.pull(2.0, 14.0)
    # As at full scale, less the way that the first zone's lower speed saves: at most 1.4 mm.
    assert 1.8 < 1e3 * approach.left_m < 3.5
    assert speeds.max() == pytest.approx(0.48 * scale * FULL_M_S, rel=0.01)  # 2 N pull the trigger by 48 %.


def test_a_higher_scale_waits_for_the_release_and_is_felt_in_time() -> None:
    approach = Approach(0.2, speed_scale=0.25)
    approach.pull(0.0, 1.0)
    for buttons in ({Button.L1}, {Button.L1, Button.L3}, {Button.L1}):
        approach.device.set_buttons(frozenset(buttons))
        assert approach.pull(2.0, 0.5).max() < 0.031
    approach.pull(0.0, 0.5)
    assert approach.pull(2.0, 8.0).max() > 0.1
    assert 1e3 * approach.left_m == pytest.approx(3.3, abs=0.2)
