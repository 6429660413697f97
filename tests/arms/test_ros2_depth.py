"""The driver for depth under ROS 2, with a camera of ours under rclpy: what it sends becomes a wall in the map."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from common.sockets.driver_port import DriverPort
from robot_side.depth.depth_map import DepthMap
from robot_side.depth.picture import CameraPose
from robot_side.depth.settings import MapSettings
from robot_side.drivers.remote.depth import RemoteDepth, TakenDepth
from robot_side.drivers.remote.depth_message import DEPTH_LIMIT_BYTES
from tests.arms.provide import provided
from tests.arms.trial import DRIVERS, Program
from tests.helpers.machines.waiting import wait_until
from tests.helpers.socket_talk import EPHEMERAL
from tests.robot_side.depth.mapping import NOBODY, fronts
from tests.robot_side.depth.ray_cast import STEREO

pytestmark = [pytest.mark.arms, pytest.mark.processes]

WALL_M, EDGE_M, AGE_S = 0.6, 0.0, 0.05
"""As in tests/arms/peers/depth_camera.py: the wall, where it ends, and how old the pictures are"""
LOOKS_AHEAD = CameraPose(np.array([0.0, 0.0, 0.4]), np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]))
"""Along the world's x"""
SETTINGS = MapSettings(lower_m=(0.0, -0.5, -0.1), upper_m=(0.95, 0.5, 0.9))
Begin = Callable[..., Program]


@pytest.fixture
def port() -> Iterator[DriverPort]:
    with DriverPort(EPHEMERAL, "--depth", DEPTH_LIMIT_BYTES) as opened:
        yield opened


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Begin]:
    """What starts a program with the Python of ROS 2."""
    number = os.getpid() % 100
    ros = {"ROS_DOMAIN_ID": str(number), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    environment, begun = {**os.environ, **ros, "PYTHONPATH": "", "PYTHONUNBUFFERED": "1"}, list[Program]()

    def start(*words: str) -> Program:
        begun.append(Program([str(provided("ros2")), *words], tmp_path / f"{len(begun)}.txt", environment))
        return begun[-1]

    yield start
    for one in begun:
        one.kill()


def camera_and_driver(begin: Begin, port: DriverPort, what: str, *stamp: str) -> Program:
    begin("-m", "tests.arms.peers.depth_camera", what, *stamp)
    topic = ("cloud", "/camera/points") if what == "cloud" else ("image", "/camera/depth")
    return begin(str(DRIVERS / "ros2_depth.py"), *topic, f"address={port.endpoint}", "camera=fixed")


@pytest.mark.parametrize("what", ["16UC1", "32FC1", "cloud"])
def test_what_the_camera_publishes_becomes_a_wall_in_the_map(begin: Begin, port: DriverPort, what: str) -> None:
    driver = camera_and_driver(begin, port, what)
    depth_map, pictures = DepthMap(SETTINGS), 0
    depth = RemoteDepth(port, print)  # a busy machine may note a silence

    def taken() -> tuple[TakenDepth, float] | None:
        now_s = port.wait(0.005)
        newest = depth.take("fixed") if "fixed" in depth.update(now_s) else None
        return None if newest is None else (newest, now_s)

    while pictures < 10:
        newest, now_s = wait_until("a picture", taken, instead=driver.heard)
        depth_map.integrate(newest.picture, LOOKS_AHEAD, NOBODY, STEREO)
        pictures += 1
    boxes = depth_map.boxes()
    corners_m = fronts(boxes)[boxes.half_sizes_m[:, :2].min(axis=1) > 0.02]
    ages_s = now_s - newest.latest_s, now_s - newest.picture.taken_s
    deviation_m = float(np.abs(corners_m[..., 0] - WALL_M).max())
    edge_m = float(corners_m[..., 1].min())
    print(f"{what}: {len(corners_m)} boxes, {1e3 * deviation_m:.2f} mm off, ends at {1e3 * edge_m:.1f} mm, {ages_s} s")
    assert deviation_m < 0.001
    assert abs(edge_m - EDGE_M) < SETTINGS.cell_m
    assert ages_s[1] >= AGE_S
    assert ages_s[0] < ages_s[1]
    assert set(depth.senders.summary()) == {"accepted"}


def test_a_wrong_encoding_ends_the_driver_with_one_line(begin: Begin, port: DriverPort) -> None:
    driver = camera_and_driver(begin, port, "mono16")
    assert wait_until("its end", driver.process.poll, instead=driver.heard) == 2
    assert driver.heard() == "encoding = mono16; valid: 16UC1, 32FC1\n"


def test_stamps_of_a_simulation_are_left_out_and_said_so(begin: Begin, port: DriverPort) -> None:
    driver = camera_and_driver(begin, port, "16UC1", "12.5")
    wait_until("a line", lambda: "s before this machine's clock; valid: up to 1, or latency_s" in driver.heard())
    assert port.receive() == []
