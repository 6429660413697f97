"""The examples of docs/drivers that need nothing else: run as processes over real sockets."""

import contextlib
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from common.sockets.driver_port import DriverPort
from robot_side.arm.limits import ArmLimits
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.driver_session import ArmShape
from robot_side.drivers.remote.frame_message import read_frame, read_object
from robot_side.drivers.remote.objects import RemoteObjects
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.python_process import ended, start
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
    objects = RemoteObjects(port, {}, notes.append)
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
    frame = read_frame(payload)
    things = [read_object(frame, number) for number in range(len(frame.objects))]
    assert [(thing.name, thing.half_space, thing.sphere) for thing in things] == [
        ("table", True, None),
        ("target", False, 0.03),
    ]


@pytest.mark.processes
@pytest.mark.parametrize(
    ("name", "words", "said"),
    [
        ("example_arm.py", ("nowhere",), "nowhere"),
        ("example_objects.py", ("nowhere",), "nowhere"),
        ("example_pictures.py", ("tcp://127.0.0.1:9", "overview", "99"), "camera 99 gives no picture"),
        ("recorded_depth.py", (), "valid: .npz, .pcd, .ply"),
        ("recorded_depth.py", ("tests/data/wall.xml",), "valid: .npz, .pcd, .ply"),
        ("realsense_depth.py", (), "No module named 'pyrealsense2'"),
        ("lerobot_arm.py", (), "No module named 'lerobot'"),
        ("franka_arm.py", (), "No module named 'franky'"),
        ("ros2_arm.py", (), "No module named 'rclpy'"),
    ],
)
def test_what_is_wrong_ends_an_example_with_one_line_and_exit_code_2(
    name: str, words: tuple[str, ...], said: str
) -> None:
    code, _, complaint = ended(str(EXAMPLES / name), *words, OPENCV_LOG_LEVEL="OFF")
    assert code == 2
    assert said in complaint
    assert complaint.count("\n") == 1
