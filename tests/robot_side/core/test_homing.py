"""The way home: straight in joint space, only while asked for, and only where it is free as perceived."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from common.arrays import FloatArray
from common.roles import Role
from robot_side.parts import build_parts
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.perceived_scenes import Scene
from tests.robot_side.session_bench import QUICK, Bench


@pytest.fixture
def bench() -> Bench:
    """Robot side whose arm has moved back by some 50 mm and up by 30 mm."""
    bench = Bench(QUICK)
    operator = bench.join(2)
    bench.arm_it(operator)
    bench.drive(0.5, operator, l2=0.4, lateral=(0.0, 0.6))
    bench.drive(0.3, operator)
    return bench


def off_rad(bench: Bench) -> float:
    home_rad = bench.robot.parts.home_rad
    assert home_rad is not None
    return float(np.abs(bench.arm.state(bench.now_s).joint_positions_rad - home_rad).max())


def test_the_arm_goes_home_while_asked_to_and_stops_at_once_when_not(bench: Bench) -> None:
    [operator] = bench.operators.values()
    begun_rad = off_rad(bench)
    assert begun_rad > 0.1
    bench.drive(0.3, operator, home=1.0)
    assert 0.05 < off_rad(bench) < begun_rad - 0.02
    assert bench.speed_rad_s < 0.5
    bench.drive(0.2, operator)
    left_rad = off_rad(bench)
    bench.drive(0.2, operator)
    assert off_rad(bench) == pytest.approx(left_rad, abs=2e-3)
    for asked in ({"home": 1.0, "run": False}, {"home": 1.0, "turning": (0.01, 0.0)}):
        bench.drive(0.2, operator, **asked)
        assert off_rad(bench) == pytest.approx(left_rad, abs=5e-3)
    bench.drive(3.0, operator, home=1.0)
    assert off_rad(bench) < 5e-3
    assert bench.robot.motion.hindrance.text is None
    assert operator.updates[-1].commanded_m_s == pytest.approx(0.0, abs=1e-3)


def test_a_lower_share_is_slower(bench: Bench) -> None:
    [operator] = bench.operators.values()
    bench.drive(0.4, operator, home=0.25)
    slow = bench.speed_rad_s
    bench.drive(0.1, operator)
    bench.drive(0.4, operator, home=1.0)
    assert 0.0 < slow < 0.7 * bench.speed_rad_s


class Seen:
    def __init__(self, objects: PerceivedObjects) -> None:
        self.objects = objects

    def perceive(self, now_s: float) -> PerceivedObjects:
        del now_s
        return self.objects

    def set_role(self, name: str, role: Role) -> None:
        del name, role


def ball_at(center_m: FloatArray, role: Role = Role.OBSTACLE) -> PerceivedObjects:
    return Scene().add(role).sphere(center_m, 0.045).objects()  # wider than the open gripper


FAR_M = np.array([0.0, 0.0, 9.0])


def moved_away(camera: Seen, duration_s: float = 0.6, **asked: Any) -> tuple[Bench, FloatArray]:
    """Return a bench whose arm has moved back, or as `asked`, and where the tool was at the start."""
    bench = Bench(parts=replace(build_parts(QUICK, 1, "clock"), camera=camera, truth=None))
    operator = bench.join(2)
    bench.arm_it(operator)
    start_m = bench.tool_m
    bench.drive(duration_s, operator, **(asked or {"l2": 0.8}))
    bench.drive(0.3, operator)
    return bench, start_m


@pytest.mark.parametrize("role", Role)
def test_an_object_on_the_way_refuses_it_whatever_its_role_until_it_is_asked_for_again(role: Role) -> None:
    camera = Seen(ball_at(FAR_M))
    bench, start_m = moved_away(camera)
    [operator], begun_rad = bench.operators.values(), off_rad(bench)
    camera.objects = ball_at(start_m, role)
    bench.drive(0.5, operator, home=1.0)
    if role is Role.IGNORED:
        assert off_rad(bench) < begun_rad - 0.05
        return
    assert off_rad(bench) == pytest.approx(begun_rad, abs=5e-3)
    said = bench.robot.status(bench.now_s).hindrance
    assert said is not None
    assert said.startswith("no way home: object0 is ")
    assert operator.updates[-1].hindered
    camera.objects = ball_at(FAR_M)
    bench.drive(0.5, operator, home=1.0)
    assert off_rad(bench) == pytest.approx(begun_rad, abs=5e-3)
    bench.drive(0.1, operator)
    assert not operator.updates[-1].hindered
    bench.drive(0.5, operator, home=1.0)
    assert off_rad(bench) < begun_rad - 0.05


def test_an_object_half_way_refuses_it_though_both_ends_are_free() -> None:
    camera = Seen(ball_at(FAR_M))
    bench, start_m = moved_away(camera, 3.0, lateral=(0.0, 1.0))
    [operator], begun_rad = bench.operators.values(), off_rad(bench)
    half_way_m = 0.5 * (start_m + bench.tool_m)
    camera.objects = ball_at(half_way_m)
    bench.drive(0.5, operator, home=1.0)
    assert off_rad(bench) == pytest.approx(begun_rad, abs=5e-3)
    assert bench.robot.status(bench.now_s).hindrance is not None
    bench.drive(0.1, operator)
    camera.objects = ball_at(half_way_m + np.array([0.2, 0.0, 0.0]))  # nearer than half of the way is long
    bench.drive(0.5, operator, home=1.0)
    assert off_rad(bench) < begun_rad - 0.05


def test_an_object_where_a_link_would_come_refuses_it_and_one_beside_the_base_does_not() -> None:
    camera = Seen(ball_at(FAR_M))
    bench = Bench(parts=replace(build_parts(QUICK, 1, "clock"), camera=camera, truth=None))
    centers_m, _ = bench.robot.parts.kinematics.link_spheres(bench.arm.state(bench.now_s))
    elbow_m = centers_m[np.argmax(centers_m[:, 2] * (centers_m[:, 0] > 0.0))]
    operator = bench.join(2)
    bench.arm_it(operator)
    bench.drive(0.8, operator, l2=0.8)
    bench.drive(0.3, operator)
    begun_rad = off_rad(bench)
    camera.objects = ball_at(elbow_m)
    bench.drive(0.5, operator, home=1.0)
    assert off_rad(bench) == pytest.approx(begun_rad, abs=5e-3)
    said = bench.robot.status(bench.now_s).hindrance
    assert said is not None
    assert "from a link" in said
    bench.drive(0.1, operator)
    # Beside the shoulder, which only turns: nearer than what must be free, and no nearer on the way.
    camera.objects = ball_at(np.array([-0.11, 0.0, 0.14]))
    bench.drive(0.5, operator, home=1.0)
    assert off_rad(bench) < begun_rad - 0.05
    assert bench.robot.motion.hindrance.text is None


def test_an_object_that_comes_into_the_way_stops_the_arm() -> None:
    camera = Seen(ball_at(FAR_M))
    bench, start_m = moved_away(camera)
    [operator] = bench.operators.values()
    bench.drive(0.3, operator, home=1.0)
    assert bench.speed_rad_s > 0.05
    camera.objects = ball_at(start_m)
    bench.drive(0.3, operator, home=1.0)
    assert bench.speed_rad_s < 0.01
    assert off_rad(bench) > 0.02
