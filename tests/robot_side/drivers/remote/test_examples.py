"""The examples of docs/drivers: run as processes over real sockets; for LeRobot, with a fake of its interface."""

import contextlib
import importlib.util
import math
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from common.sockets.driver_port import DriverPort
from robot_side.arm.limits import ArmLimits
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.driver_session import ArmShape
from robot_side.drivers.remote.frame_message import FRAME_DECODER, FRAME_VERSION, require_possible
from robot_side.drivers.remote.messages import decoded
from robot_side.drivers.remote.objects import RemoteObjects
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.python_process import start
from tests.helpers.repository import ROOT
from tests.helpers.socket_talk import EPHEMERAL, ROUNDS

EXAMPLES = ROOT / "docs" / "drivers"
TURN_S = 0.005


@contextlib.contextmanager
def running(name: str, address: str) -> Iterator["subprocess.Popen[str]"]:
    """Run an example as a process, and kill it at the end."""
    with start(str(EXAMPLES / name), address) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.fixture
def port() -> Iterator[DriverPort]:
    with DriverPort(EPHEMERAL, "--arm", 1 << 20) as opened:
        yield opened


@pytest.fixture
def arm(port: DriverPort, scene: Scene) -> RemoteArm:
    limits = ArmLimits().of_joints(6)
    shape = ArmShape(tuple(f"joint{k}" for k in range(6)), ("left", "right"), np.full(2, 0.04), 0.08, limits)
    return RemoteArm(port, shape, scene.show, lambda _: None)


@pytest.mark.processes
def test_the_example_arm_follows_stops_when_it_is_killed_and_another_takes_its_place(
    port: DriverPort, arm: RemoteArm, scene: Scene
) -> None:
    velocity = np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    with running("example_arm.py", port.endpoint) as driver:
        assert any(arm.begin(port.wait(TURN_S)) for _ in range(ROUNDS))
        start_rad = arm.state(port.wait(0.0)).joint_positions_rad
        for _ in range(ROUNDS):
            state = arm.state(now_s := port.wait(TURN_S))
            arm.command(velocity, now_s + 0.1)
            arm.command_gripper(1.0, now_s + 0.1)
            if state.joint_positions_rad[0] > start_rad[0] + 0.05 and state.gripper_opening_m < 0.07:
                break
        else:
            pytest.fail("it does not follow")
        assert state.joint_velocities_rad_s == pytest.approx(velocity)
        assert scene.data.qpos[scene.robot.arm_positions] == pytest.approx(state.joint_positions_rad)
        driver.send_signal(signal.SIGSTOP)
        stopped_s = until_silent(arm, port)
        driver.send_signal(signal.SIGCONT)
        assert any(stands_since(stopped_s, arm, port) for _ in range(ROUNDS))
    killed_s = until_silent(arm, port)
    with running("example_arm.py", port.endpoint):
        assert any(stands_since(killed_s, arm, port) for _ in range(ROUNDS))
    # A new driver is refused until the last one has been silent for a second.
    assert set(arm.session.rejected) <= {"second"}


def until_silent(arm: RemoteArm, port: DriverPort) -> float:
    """Wait until no state has come for a while; return the time."""
    for _ in range(ROUNDS):
        now_s = port.wait(TURN_S)
        if now_s - arm.state(now_s).time_s > 0.1:
            return now_s
    return pytest.fail("states still come")


def stands_since(since_s: float, arm: RemoteArm, port: DriverPort) -> bool:
    """Command the arm to stop, for one turn; return whether a state after `since_s` says that it stands."""
    state = arm.state(now_s := port.wait(TURN_S))
    arm.command(np.zeros(6), state.time_s)
    arm.command_gripper(0.0, now_s)
    return state.time_s > since_s and not state.joint_velocities_rad_s.any()


@pytest.mark.processes
def test_the_example_of_perception_is_perceived(port: DriverPort) -> None:
    notes: list[str] = []
    objects = RemoteObjects(port, {}, 0.003, notes.append)
    with running("example_objects.py", port.endpoint):
        assert any(objects.exchange(port.wait(TURN_S)) for _ in range(ROUNDS))
        frame = objects.perceive(port.wait(0.0))
    assert frame.names == ("table", "target", "ball")
    assert notes == []


@pytest.mark.processes
@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no g++")
def test_the_example_in_cpp_packs_what_the_robot_side_reads(tmp_path: Path) -> None:
    # libzmq's header may be missing: a stand-in writes the first message to a file.
    (tmp_path / "zmq.h").write_text(
        "#pragma once\n#include <cstdio>\n#include <cstdlib>\n"
        "enum { ZMQ_DEALER, ZMQ_SNDHWM, ZMQ_DONTWAIT };\n"
        "inline void *zmq_ctx_new() { return nullptr; }\ninline void *zmq_socket(void *, int) { return nullptr; }\n"
        "inline int zmq_setsockopt(void *, int, const void *, size_t) { return 0; }\n"
        "inline int zmq_connect(void *, const char *) { return 0; }\n"
        "inline int zmq_recv(void *, void *, size_t, int) { return -1; }\n"
        "inline int zmq_send(void *, const void *bytes, size_t count, int) {\n"
        "    std::fwrite(bytes, 1, count, stdout), std::fflush(stdout), std::exit(0);\n}\n"
    )
    program = tmp_path / "example_objects"
    build = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", f"-I{tmp_path}", str(EXAMPLES / "example_objects.cpp")]
    subprocess.run([*build, "-o", str(program)], check=True, timeout=LIMIT_S)
    payload = subprocess.run([str(program)], check=True, capture_output=True, timeout=LIMIT_S).stdout
    frame = decoded(payload, FRAME_DECODER, FRAME_VERSION)
    require_possible(frame)
    assert [(thing.name, thing.half_space, thing.sphere) for thing in frame.objects] == [
        ("table", True, None),
        ("target", False, 0.03),
    ]


def lerobot_arm() -> ModuleType:
    """Import the example driver for LeRobot's arms from its file; return the module."""
    found = importlib.util.spec_from_file_location("lerobot_arm", EXAMPLES / "lerobot_arm.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


class FakeFollower:
    """Robot with the interface of LeRobot 0.4, which reaches each goal at once; only its gripper may be blocked."""

    def __init__(self) -> None:
        self.at = {"shoulder_pan.pos": 10.0, "elbow_flex.pos": -20.0, "gripper.pos": 100.0}
        self.blocked_at = 0.0

    def get_observation(self) -> dict[str, Any]:
        return dict(self.at)

    def send_action(self, action: dict[str, Any]) -> dict[str, Any]:
        assert action.keys() == self.at.keys()
        self.at = action | {"gripper.pos": max(action["gripper.pos"], self.blocked_at)}
        return action


def lerobot_turns(arm: Any, since_s: float, turns: int, command: dict[str, Any] | None = None) -> dict[str, Any]:
    """Run turns of the example driver at 50 Hz, each with `command`; return the last state."""
    state: dict[str, Any] = {}
    for turn in range(turns):
        now_s = since_s + 0.02 * turn
        state = arm.measure(now_s)
        if command is not None:
            arm.obey(command)
        arm.move(now_s)
    return state


def test_an_arm_of_lerobot_integrates_holds_and_stops_by_itself() -> None:
    follower = FakeFollower()
    arm = lerobot_arm().VelocityArm(follower, ["shoulder_pan", "elbow_flex"], "gripper", 0.08, [1.0, -1.0])
    state = lerobot_turns(arm, 10.0, 2)
    assert state["joint_positions"] == pytest.approx([math.radians(10.0), math.radians(20.0)])
    moving = {"joint_velocities": [0.1, 0.2], "closing": 0.0, "valid_until_s": 10.54}
    state = lerobot_turns(arm, 10.04, 50, moving)
    assert state["joint_positions"] == pytest.approx([math.radians(10.0) + 0.05, math.radians(20.0) + 0.1], abs=0.005)
    assert follower.at["elbow_flex.pos"] == pytest.approx(-20.0 - math.degrees(0.1), abs=0.3)
    assert state["joint_velocities"] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_an_arm_of_lerobot_holds_what_its_gripper_cannot_close_on_and_is_not_pushed_far() -> None:
    follower = FakeFollower()
    follower.blocked_at = 40.0
    arm = lerobot_arm().VelocityArm(follower, ["shoulder_pan", "elbow_flex"], "gripper", 0.08, None)
    state = lerobot_turns(arm, 0.0, 2)
    assert (state["opening_m"], state["holding"]) == (pytest.approx(0.08), False)
    state = lerobot_turns(arm, 0.04, 60, {"joint_velocities": [0.0, 0.0], "closing": 1.0, "valid_until_s": 1.0})
    assert (state["opening_m"], state["holding"]) == (pytest.approx(0.032), True)
    held = follower.at["shoulder_pan.pos"]
    follower.send_action = lambda action: action  # type: ignore[method-assign]  # something holds the arm up
    lerobot_turns(arm, 2.0, 200, {"joint_velocities": [0.5, 0.0], "closing": 0.0, "valid_until_s": 100.0})
    assert math.radians(math.degrees(arm._goals[0]) - held) == pytest.approx(0.1)
    # A bus that hung for a second moves the goals by no more than a tenth of a second's motion.
    follower = FakeFollower()
    arm = lerobot_arm().VelocityArm(follower, ["shoulder_pan", "elbow_flex"], "gripper", 0.08, None)
    lerobot_turns(arm, 0.0, 2)
    lerobot_turns(arm, 5.0, 1, {"joint_velocities": [0.5, 0.0], "closing": 0.0, "valid_until_s": 6.0})
    assert follower.at["shoulder_pan.pos"] == pytest.approx(10.0 + math.degrees(0.05))
