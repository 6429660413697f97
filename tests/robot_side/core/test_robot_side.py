"""Messages, status and figures of the whole robot side, with the simulated arm, in virtual time."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import UNSET

from common.protocol.messages import Header
from common.roles import Role
from common.silence import KEEP_ALIVE_S
from common.status.codes import LinkState
from robot_side.core.robot_side import RobotSide
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.gripper.held_object import grip
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from robot_side.tick.events import Listener, Tick
from robot_side.tick.situation import Situation
from tests.robot_side.session_bench import Bench, Operator


def test_an_unarmed_robot_lets_no_load_sink_however_unevenly_it_ticks() -> None:
    scene = load_scene()
    robot = RobotSide(build_parts(RobotSettings(), epoch=1, clock_domain="test", scene=scene))
    scene.data.xfrc_applied[scene.model.site_bodyid[scene.robot.site], 2] = -3.0  # The weight of a held object.
    generator = np.random.default_rng(0)
    now_s, height_m = 0.0, []
    for _ in range(2):
        for _ in range(600):
            now_s += float(generator.uniform(0.5e-3, 3.5e-3))
            robot.tick(now_s)
        height_m.append(float(scene.data.site_xpos[scene.robot.site, 2]))
    assert height_m[0] - height_m[1] < 1e-4


def test_of_the_turns_with_an_owner_at_rest_one_in_twenty_milliseconds_needs_stiffness(bench: Bench) -> None:
    assert "stiffness_messages" not in bench.robot.summary()["skipped"]
    operator = bench.join(2)
    before = bench.robot.summary()["skipped"]["stiffness_messages"]
    heard = len(operator.updates)
    bench.tick(200)
    now = bench.robot.summary()["skipped"]["stiffness_messages"]
    assert now["of"] - before["of"] == 200
    assert now["done"] - before["done"] == len(operator.updates) - heard
    assert now["skipped"] == 1.0 - now["done"] / now["of"]
    assert len(operator.updates) - heard == 200 // 20


def test_the_target_is_switched_once_for_each_press(bench: Bench) -> None:
    operator = bench.join(2)
    bench.drive(0.1, operator)
    assert bench.views[-1].target == "target"
    bench.drive(0.2, operator, next_target=True)
    second = bench.views[-1].target
    assert second not in {"target", None}
    bench.drive(0.2, operator, next_target=True)
    assert bench.views[-1].target == second
    bench.drive(0.1, operator)
    bench.drive(0.2, operator, next_target=True)
    assert bench.views[-1].target not in {second, None}


def test_the_status_says_who_pulls_how_far_everything_is_and_why_it_stopped(bench: Bench) -> None:
    status = bench.robot.status(bench.now_s)
    assert (status.link, status.l2_pulled, status.nearest_mm, status.target) == (LinkState.WAITING, None, None, UNSET)
    operator = bench.join(2)
    bench.arm_it(operator)
    bench.drive(0.2, operator, r2=0.4)
    status = bench.robot.status(bench.now_s)
    assert (status.link, status.r2_pulled, status.stopped_because) == ("up", 0.4, None)
    assert status.target == "target"
    before_mm = status.target_mm
    assert isinstance(before_mm, float)
    bench.drive(0.5, operator, r2=0.4)
    status = bench.robot.status(bench.now_s)
    nearer_mm, nearest_mm = status.target_mm, status.nearest_mm
    assert isinstance(nearer_mm, float)
    assert isinstance(nearest_mm, float)
    assert nearer_mm == pytest.approx(before_mm - 50.0, abs=15.0)
    assert nearest_mm <= nearer_mm
    bench.tick(400)
    status = bench.robot.status(bench.now_s)
    assert "no command for" in str(status.stopped_because)
    assert status.r2_pulled is None
    bench.silence(1.0)
    assert bench.robot.status(bench.now_s).link is LinkState.LOST
    assert bench.robot.summary()["loop_age_ms"]["mean"] > 0.0


class Listening(Listener):
    def __init__(self) -> None:
        self.heard: list[Situation] = []

    def on_tick(self, tick: Tick) -> None:
        assert tick.found is not None
        self.heard.append(tick.found.situation)


@pytest.fixture
def listening() -> Listening:
    return Listening()


@pytest.fixture
def bench(listening: Listening) -> Bench:
    return Bench(listeners=[listening])


def test_a_tick_knows_the_frame_that_was_taken_in_before_it_began(bench: Bench, listening: Listening) -> None:
    for after_s in (0.0, 0.1, 0.2):
        bench.robot.tick(bench.now_s + after_s)
    bench.robot.observe(bench.now_s + 0.2)
    bench.robot.tick(bench.now_s + 0.201)
    first, late, latest, following = (situation.objects for situation in listening.heard[-4:])
    assert first is late is latest
    assert following.time_s == bench.now_s + 0.2 > first.time_s


def test_what_the_law_finds_is_what_is_sent(bench: Bench, listening: Listening) -> None:
    operator = bench.join(2)
    bench.drive(0.3, operator)
    update, situation = operator.updates[-1], listening.heard[-1]
    assert update.r2.full_speed_m_s == pytest.approx(0.25, rel=0.01)
    assert 0.5 < update.r2.acceleration_m_s2 < 20.0
    assert update.horizon_m == pytest.approx(
        update.r2.full_speed_m_s * (situation.loop_age_s + 0.3)
        + update.r2.full_speed_m_s**2 / (2.0 * update.r2.acceleration_m_s2)
        + 0.05,
        rel=0.05,
    )
    # The table's target is some 20 cm ahead of the built-in arm's start, and nothing is behind it.
    assert update.r2.fast_m[7] < 1.0
    assert update.l2.fast_m[0] == update.horizon_m
    assert update.rumble == 0.0


def commanded_m_s(operator: Operator) -> float:
    found = operator.updates[-1].commanded_m_s
    assert found is not None
    return found


def test_an_operator_hears_what_its_command_gets_and_0_where_it_gets_nothing(bench: Bench) -> None:
    operator = bench.join(2)
    start = bench.tool_m
    bench.drive(0.5, operator, r2=0.4)
    assert commanded_m_s(operator) == 0.0  # Not armed.
    assert np.linalg.norm(bench.tool_m - start) < 2e-3
    bench.cruise(operator, 0.1)
    assert commanded_m_s(operator) == pytest.approx(0.1, rel=0.01)
    bench.drive(0.02, operator, l2=0.4)
    assert commanded_m_s(operator) == pytest.approx(-0.1, rel=0.01)
    bench.drive(0.02, operator, r2=0.4, run=False)
    assert commanded_m_s(operator) == 0.0
    bench.drive(0.02, operator, r2=0.4)
    assert commanded_m_s(operator) > 0.0
    bench.drive(0.02, operator, r2=0.4, emergency_stop=True)
    assert commanded_m_s(operator) == 0.0


def test_an_operator_hears_that_a_joint_is_at_its_end(bench: Bench) -> None:
    operator = bench.join(2)
    bench.cruise(operator, 0.1)
    free = commanded_m_s(operator)
    limits = bench.robot.motion._limits
    assert limits.lower_rad is not None
    here, ends = bench.arm.state(bench.now_s).joint_positions_rad, limits.lower_rad.copy()
    ends[2] = here[2]  # The elbow, which stretches as the tool advances.
    bench.robot.motion._limits = replace(limits, lower_rad=ends)
    bench.drive(KEEP_ALIVE_S, operator, r2=0.4)
    assert commanded_m_s(operator) < 0.9 * free
    assert operator.updates[-1].hindered
    assert bench.robot.status(bench.now_s).hindrance == "joint 3 at its limit"
    bench.drive(KEEP_ALIVE_S, operator, l2=0.4)
    assert commanded_m_s(operator) == pytest.approx(-free, rel=0.01)
    assert not operator.updates[-1].hindered


def test_full_speed_is_reckoned_with_until_the_operator_has_echoed(bench: Bench, listening: Listening) -> None:
    operator = bench.operator(2)
    bench.tick()
    assert listening.heard[-1].loop_age_s == pytest.approx(1.0)
    assert not listening.heard[-1].loop_age_known
    bench.join(2)
    bench.drive(0.1, bench.operators[b"operator"])
    updates = bench.operators[b"operator"].updates
    assert updates[0].r2.displacement_m == pytest.approx(updates[0].r2.full_speed_m_s, rel=0.05)
    assert listening.heard[-1].loop_age_known
    # The assumed loop age falls slowly from the initial one, which is the worst case.
    assert 0.1 < listening.heard[-1].loop_age_s < 0.9
    assert abs(updates[-1].r2.displacement_m) < 0.01
    assert operator.updates == []


def test_the_law_knows_the_gap_between_the_fingers_and_what_they_hold(bench: Bench, listening: Listening) -> None:
    bench.tick(3)
    assert listening.heard[-1].gap_m == pytest.approx(0.085, abs=1e-3)
    assert listening.heard[-1].held is None
    spheres = len(listening.heard[-1].pose.sphere_radii_m)
    # A box between the fingers, gripped.
    objects = listening.heard[-1].objects
    target = objects.roles.index(Role.TARGET)
    bench.robot.grip.held = grip(objects, target, listening.heard[-1].pose)
    bench.robot.grip._held_s = np.inf
    bench.tick()
    assert listening.heard[-1].held == target
    assert len(listening.heard[-1].pose.sphere_radii_m) > spheres


def test_an_echo_from_the_future_ages_nothing(bench: Bench) -> None:
    operator = bench.join(2)
    bench.drive(0.05, operator)
    invented = operator.link.stamp(bench.now_s)
    header = Header(invented.epoch, invented.sequence, invented.sent_s, echo_sent_s=bench.now_s + 60.0, echo_held_s=0.0)
    bench.send(operator, header=header)
    bench.tick(10)
    assert bench.robot.session.loop_age_s(bench.now_s) is None


def test_an_operator_hears_how_the_tool_is_turned_to_each_frame_of_the_sticks(bench: Bench) -> None:
    bench.tick(25)
    view, frames = bench.views[-1], bench.robot.parts.frames
    assert frames is not None
    assert bench.robot.newest is not None
    tool = bench.robot.newest[1].pose.tool_rotation
    assert view.base_turn_rad == pytest.approx(frames.base.turn_rad(tool), abs=1e-2)
    assert view.camera_turn_rad == pytest.approx(
        frames.camera.turn_rad(tool, mirrored=frames.camera.faces(tool)), abs=1e-2
    )
    # From above, with ahead upwards, a stick means the same in both frames.
    assert view.base_turn_rad == pytest.approx(view.camera_turn_rad, abs=1e-2)
