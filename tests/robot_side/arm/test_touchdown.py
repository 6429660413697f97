"""A held object that is set down: its contact is noticed at once, never in the air, and counts until the tool rises."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from robot_side.arm.touchdown import Touchdown, carried_n

TICK_S = 1e-3
STIFFNESS_N_M = 8e3
"""Stiffness of the built-in arm at its tool in N/m: about 8 N for each millimetre"""


class Arm:
    """Simulated tool that follows its commands exactly and holds an object above a table at height 0."""

    def __init__(self, weight_n: float = 2.0, *, measures: bool = True, noise_n: float = 0.0) -> None:
        self.touchdown = Touchdown()
        self.height_m = self.meant_m = 0.05
        self.now_s = 1.0
        self._weight_n, self._measures, self._noise_n = weight_n, measures, noise_n
        self._random = np.random.default_rng(0)

    @property
    def pressed_n(self) -> float:
        return STIFFNESS_N_M * max(0.0, -self.meant_m)

    def go(self, speed_m_s: float, duration_s: float, jolt_n: float = 0.0) -> float | None:
        """Rise (> 0) or sink, but sink no more after a contact; return when a new contact is noticed, if any."""
        for tick in range(round(duration_s / TICK_S)):
            stands = self.touchdown.stands
            rises_m_s = max(0.0, speed_m_s) if stands else speed_m_s
            self.now_s += TICK_S
            self.meant_m += rises_m_s * TICK_S
            self.height_m = max(0.0, self.meant_m)
            borne_n = self._weight_n + self.pressed_n if self.meant_m <= 0.0 else 0.0
            jolt = -jolt_n if tick < 12 else 0.0  # Time that an arm takes to its speed.
            carried = self._weight_n - borne_n + jolt + self._noise_n * self._random.normal()
            self.touchdown.update(carried if self._measures else None, self.height_m, rises_m_s, self.now_s)
            if self.touchdown.stands and not stands:
                return self.now_s
        return None


@pytest.mark.parametrize("speed_m_s", [0.002, 0.025, 0.1])
@pytest.mark.parametrize("weight_n", [0.1, 2.0, 20.0])
def test_a_load_that_comes_to_stand_is_noticed_before_it_is_pressed_hard(speed_m_s: float, weight_n: float) -> None:
    arm = Arm(weight_n)
    assert arm.go(-speed_m_s, 0.06 / speed_m_s) is not None
    assert arm.pressed_n < 8.0 + 0.01 * STIFFNESS_N_M * speed_m_s
    pressed_n = arm.pressed_n
    arm.go(-speed_m_s, 1.0)
    assert arm.pressed_n == pressed_n  # No windup.


def test_it_gives_way_for_a_moment() -> None:
    arm = Arm()
    arm.go(-0.025, 5.0)
    assert arm.touchdown.gives_way
    arm.go(-0.025, 0.02)
    assert (arm.touchdown.stands, arm.touchdown.gives_way) == (True, False)


def test_a_contact_lasts_until_the_tool_has_risen_by_3_mm_and_may_come_again() -> None:
    arm = Arm()
    assert arm.go(-0.025, 5.0)
    arm.go(0.01, 0.25)
    assert arm.touchdown.stands
    while arm.touchdown.stands:
        arm.go(0.01, TICK_S)
    assert arm.height_m == pytest.approx(3e-3, abs=1e-4)
    assert arm.go(-0.025, 0.1) is None
    assert arm.go(-0.025, 0.1) is not None


@settings(derandomize=True, deadline=None, max_examples=30)
@given(
    st.floats(0.0, 50.0),
    st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(0.02, 1.0)), min_size=1, max_size=6),
)
def test_no_motion_in_the_air_and_no_noise_stands(weight_n: float, moves: list[tuple[float, float]]) -> None:
    arm = Arm(weight_n, noise_n=1.0)
    arm.height_m = arm.meant_m = 2.0
    for speed_m_s, duration_s in moves:
        # Drives that begin to sink leave up to 0.4 of the weight to gravity.
        assert arm.go(speed_m_s, duration_s, 0.4 * weight_n if speed_m_s < 0.0 else 0.0) is None


def test_a_thing_that_is_gripped_where_it_stands_is_lifted_freely_and_noticed_when_it_is_pressed() -> None:
    arm = Arm(20.0)
    arm.height_m = arm.meant_m = 0.0
    assert arm.go(0.0, 0.5) is None
    assert arm.go(0.05, 1.0) is None
    assert arm.go(-0.05, 2.0) is not None
    pressing = Arm(20.0)
    pressing.height_m = pressing.meant_m = 0.0
    assert pressing.go(0.0, 0.5) is None
    assert pressing.go(-0.025, 0.1) is not None


def test_a_hard_contact_is_forgotten_once_the_tool_has_risen() -> None:
    touchdown = Touchdown()
    stands = list[bool]()
    for carried, height_m, rises_m_s in ((2.0, 0.05, 0.0), (-500.0, 0.05, -0.1), (2.0, 0.06, 0.1), (2.0, 0.059, -0.1)):
        touchdown.update(carried, height_m, rises_m_s, 1.0 + 0.01 * len(stands))
        stands.append(touchdown.stands)
    assert stands == [False, True, False, False]


def test_a_state_that_was_seen_already_says_nothing_new() -> None:
    touchdown = Touchdown()
    for carried in (2.0, -100.0):
        touchdown.update(carried, 0.1, -0.1, 1.0)
    assert not touchdown.stands


@given(st.integers(0, 2**32 - 1), st.sampled_from([6, 7]))
def test_what_is_carried_is_the_force_that_the_joints_torques_come_from(seed: int, joints: int) -> None:
    random = np.random.default_rng(seed)
    jacobian, force = random.normal(size=(6, joints)), random.normal(size=3)
    jacobian[:, :6] += 4.0 * np.eye(6)
    torques: FloatArray = jacobian[:3].T @ force
    assert carried_n(jacobian, torques) == pytest.approx(force[2], abs=1e-9)
    assert carried_n(jacobian, None) is None
