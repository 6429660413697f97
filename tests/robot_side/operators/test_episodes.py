"""Marks of episodes at the robot side: the owner's alone count, each once; and the scene put back to its start."""

from dataclasses import replace

import numpy as np
import pytest

from common.arrays import FloatArray
from common.episode import EpisodeMark
from common.protocol.codec import encode
from common.protocol.messages import Mark
from robot_side.parts import SceneParts, build_parts
from robot_side.settings import RobotSettings
from robot_side.tick.events import Listener
from tests.robot_side.session_bench import QUICK, Bench, Operator


class Heard(Listener):
    def __init__(self) -> None:
        self.marks: list[EpisodeMark] = []

    def on_episode(self, mark: EpisodeMark, now_s: float) -> None:
        del now_s
        self.marks.append(mark)


def mark(bench: Bench, operator: Operator, number: int, kind: EpisodeMark) -> tuple[int, str]:
    bench.robot.receive(operator.peer, encode(Mark(operator.link.stamp(bench.now_s), number, kind)), bench.now_s)
    bench.tick()
    assert operator.notice is not None
    return operator.notice.marked, operator.notice.mark_refused


def test_the_owners_marks_count_once_each_and_are_answered_at_once() -> None:
    heard = Heard()
    bench = Bench(listeners=[heard])
    owner, observer = bench.join(2), bench.join(3, b"observer")
    assert mark(bench, owner, 1, "start") == (1, "")
    assert mark(bench, owner, 1, "start") == (1, "")
    assert mark(bench, observer, 4, "failure") == (4, "only the owner may")
    assert mark(bench, observer, 5, "reset") == (5, "only the owner may")
    assert mark(bench, owner, 2, "success") == (2, "")
    assert heard.marks == ["start", "success"]
    assert bench.robot.summary()["episodes"] == {"start": 1, "success": 1}


@pytest.fixture
def parts() -> SceneParts:
    return build_parts(QUICK, 1, "clock")


def positions_m(bench: Bench) -> FloatArray:
    frame = bench.robot.sight.frame
    assert frame is not None
    assert frame.positions_m is not None
    return frame.positions_m


def test_a_reset_puts_arm_and_objects_back_while_disarmed(parts: SceneParts) -> None:
    bench = Bench(parts=parts)
    owner = bench.join(2)
    bench.tick(10)
    data, start_m = parts.scene.data, bench.tool_m
    qpos, seen_m = data.qpos.copy(), positions_m(bench)
    bench.cruise(owner, 1.0)
    bench.drive(0.3, owner, gripper=1.0)
    _throw(parts)
    answer = mark(bench, owner, 1, "reset")
    assert answer == (1, "the arm is armed; valid while it is disarmed or stopped")
    bench.silence(0.3)
    assert np.linalg.norm(bench.tool_m - start_m) > 0.05
    before = np.abs(data.qpos - qpos).max()

    assert mark(bench, owner, 2, "reset") == (2, "")

    assert before > 0.05
    np.testing.assert_allclose(data.qpos, qpos, atol=1e-3)  # objects settle by some 0.1 mm
    np.testing.assert_allclose(bench.tool_m, start_m, atol=1e-3)
    np.testing.assert_allclose(positions_m(bench), seen_m, atol=1e-3)
    # A jump is no motion: nothing is felt as if it came nearer.
    bench.tick(300)
    frame = bench.robot.sight.frame
    assert frame is not None
    assert frame.velocities_m_s is not None
    assert np.abs(frame.velocities_m_s).max() < 0.01
    np.testing.assert_allclose(data.qpos, qpos, atol=1e-3)
    # It can be armed and driven as at first.
    bench.cruise(owner, 0.5)
    assert np.linalg.norm(bench.tool_m - start_m) > 0.02


def _throw(parts: SceneParts) -> None:
    robot = parts.scene.robot
    others = np.setdiff1d(np.arange(parts.scene.model.nv), [*robot.arm_velocities, *robot.finger_velocities])
    assert others.size
    parts.scene.data.qvel[others] += 0.5


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        (replace(QUICK, arm="tcp://127.0.0.1:1"), "--arm: a driver's things stay; valid: all simulated"),
        (replace(QUICK, objects="tcp://127.0.0.1:1"), "--objects: a driver's things stay; valid: all simulated"),
    ],
)
def test_what_a_driver_moves_is_not_put_back(settings: RobotSettings, why: str) -> None:
    episodes = build_parts(settings, 1, "clock").session.episodes
    assert episodes.mark("reset", owns=True, armed=False) == why
    assert episodes.mark("start", owns=True, armed=False) == ""
    assert episodes.take_accepted() == ["start"]
