"""The driver for depth under ROS 2, with fakes of rclpy and the socket; tests/arms has the real rclpy."""

import runpy
import sys
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import msgpack
import numpy as np
import pytest
import zmq

from robot_side.drivers.remote.depth_message import DepthMessage, read_depth
from tests.helpers.lerobot_fakes import FakeSocket
from tests.helpers.python_process import ended
from tests.helpers.repository import ROOT
from tests.robot_side.depth.recorded.test_bags import cloud
from tests.robot_side.depth.recorded.test_recorded_pictures import PINHOLE, organised
from tests.robot_side.depth.recorded.test_ros_messages import TYPES, camera_info, image

SCRIPT = str(ROOT / "docs" / "drivers" / "ros2_depth.py")
SIZE = 20, 24
NOW_S = 1_700_000_000.0
"""What the machine's clock says"""
IMAGE = "image", "/eye/depth"


class FakeRos:
    """Module rclpy and its only node: given messages come while it spins, then its timers go off twice."""

    def __init__(self, comes: tuple[tuple[str, Any], ...]) -> None:
        self.warnings = list[str]()
        self._comes, self._sees, self._timers = comes, dict[str, Any](), list[Callable[[], None]]()

    def init(self) -> None:
        """Begin."""

    def create_node(self, _: str) -> "FakeRos":
        return self

    def create_subscription(self, kind: type, topic: str, sees: Callable[[Any], None], quality: Any) -> None:
        assert quality == {"depth": 1, "reliability": "best effort"}
        self._sees[topic] = kind, sees

    def create_timer(self, _: float, goes_off: Callable[[], None]) -> None:
        self._timers.append(goes_off)

    def get_publishers_info_by_topic(self, topic: str) -> list[Any]:
        return [SimpleNamespace(topic_type=message.__msgtype__) for one, message in self._comes if one == topic]

    def get_logger(self) -> Any:
        return SimpleNamespace(warning=lambda text, **_: self.warnings.append(text))

    def spin(self, _: "FakeRos") -> None:
        for topic, message in self._comes:
            kind, sees = self._sees[topic]
            if isinstance(message, kind):
                sees(message)
        for goes_off in 2 * self._timers:
            goes_off()


class Outcome:
    """What one run of the driver did."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], *comes: tuple[str, Any]) -> None:
        self.ros, self.code, socket = FakeRos(comes), 0, FakeSocket()
        socket.waiting = [{"refused": "why"}, {"sent_s": 5.0}]
        fault = type("Fault", (Exception,), {})
        names = {"NameValidationException": fault, "ExternalShutdownException": fault, "QoSProfile": dict}
        ros = SimpleNamespace(**names, ReliabilityPolicy=SimpleNamespace(BEST_EFFORT="best effort"))
        kinds = {name: TYPES[f"sensor_msgs/msg/{name}"] for name in ("Image", "CameraInfo", "PointCloud2")}
        modules = dict.fromkeys(("rclpy.exceptions", "rclpy.executors", "rclpy.qos"), ros)
        for name, module in {"rclpy": self.ros, "sensor_msgs.msg": SimpleNamespace(**kinds), **modules}.items():
            monkeypatch.setitem(sys.modules, name, module)
        monkeypatch.setattr(zmq, "Context", lambda: SimpleNamespace(socket=lambda _: socket))
        monkeypatch.setattr(time, "time", lambda: NOW_S)
        monkeypatch.setattr(sys, "argv", [SCRIPT, *words])
        self.began_s = time.monotonic()
        try:
            runpy.run_path(SCRIPT, run_name="__main__")
        except SystemExit as end:
            self.code = int(end.code or 0)
        self.ended_s, self.address = time.monotonic(), socket.address
        self.sent: list[DepthMessage] = [read_depth(msgpack.packb(one)) for one in socket.sent]


def seen(age_s: float = 0.0, encoding: str = "16UC1", nearest: float = 500.0) -> Any:
    """Return an image of a plane with a hole, whose stamp is so old."""
    pixels = np.full(SIZE, nearest)
    pixels[3, 4] = 0.0
    return image(pixels, encoding, ">", 3, NOW_S - age_s)


@pytest.mark.parametrize(("encoding", "nearest"), [("16UC1", 500), ("32FC1", 0.5)])
def test_an_image_becomes_a_message(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], encoding: str, nearest: float
) -> None:
    comes = ("/eye/camera_info", camera_info(SIZE)), (IMAGE[1], seen(0.25, encoding, nearest))
    found = Outcome(monkeypatch, (*IMAGE, "camera=fixed", "address=tcp://robot:5604"), *comes, comes[1])
    assert (found.code, found.address, len(found.sent)) == (0, "tcp://robot:5604", 2)
    first, second = found.sent
    wall_m = np.full(SIZE, 0.5)
    wall_m[3, 4] = 0.0
    assert np.abs(first.picture(0.0).depth_m - wall_m).max() < 1e-6
    assert first.intrinsics.cx == 31.0
    assert (first.camera, first.mount) == ("fixed", None)
    assert found.began_s - 0.25 <= first.taken_s <= found.ended_s - 0.25
    assert (first.echo_s, second.echo_s, second.sequence) == (None, 5.0, first.sequence + 1)
    assert capsys.readouterr().out.startswith("refused: why\n")


def test_what_is_too_far_for_16_bits_is_a_hole(monkeypatch: pytest.MonkeyPatch) -> None:
    comes = ("/info", camera_info(SIZE)), (IMAGE[1], seen(0.0, "32FC1", 13.2))
    [message] = Outcome(monkeypatch, (*IMAGE, "info=/info"), *comes).sent
    assert not message.picture(0.0).depth_m.any()


@pytest.mark.parametrize(
    ("age_s", "words", "counts_s"),
    [
        (-0.01, (), 0.0),
        (0.99, (), 0.99),
        (1.01, (), None),
        (-0.03, (), None),
        (NOW_S - 12.5, (), None),
        (-1e8, (), None),
        (NOW_S - 12.5, ("latency_s=0.125",), 0.125),
    ],
)
def test_stamps_of_another_clock_are_left_out_unless_the_latency_is_given(
    monkeypatch: pytest.MonkeyPatch, age_s: float, words: tuple[str, ...], counts_s: float | None
) -> None:
    comes = ("/eye/camera_info", camera_info(SIZE)), (IMAGE[1], seen(age_s))
    found = Outcome(monkeypatch, (*IMAGE, *words), *comes)
    assert found.code == 0
    if counts_s is None:
        assert found.sent == []
        assert "s before this machine's clock; valid: up to 1, or latency_s" in found.ros.warnings[0]
    else:
        [message] = found.sent
        assert found.began_s - counts_s <= message.taken_s + 1e-6
        assert message.taken_s <= found.ended_s - counts_s + 1e-6
        assert found.ros.warnings == []


def test_an_image_without_its_camera_info_is_not_sent_and_said_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert Outcome(monkeypatch, IMAGE, (IMAGE[1], seen())).sent == []
    line = "nothing is sent: /eye/depth has 1 publishers of sensor_msgs/msg/Image, /eye/camera_info has 0 publishers\n"
    assert capsys.readouterr().out == 2 * line


def test_a_topic_of_another_kind_and_a_robot_side_that_is_silent_are_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert Outcome(monkeypatch, ("cloud", IMAGE[1]), (IMAGE[1], seen())).sent == []
    assert "/eye/depth has 1 publishers of sensor_msgs/msg/Image\n" in capsys.readouterr().out
    monkeypatch.setattr(FakeSocket, "poll", lambda *_: False)
    Outcome(
        monkeypatch, (*IMAGE, "address=tcp://robot:5604"), ("/eye/camera_info", camera_info(SIZE)), (IMAGE[1], seen())
    )
    assert capsys.readouterr().out.startswith("no robot side answers at tcp://robot:5604\n")


@pytest.mark.processes
def test_help_needs_no_ros() -> None:
    code, said, _ = ended(SCRIPT, "--help")
    assert (code, said[:19]) == (0, "Source of the depth")


def test_a_cloud_becomes_the_picture_that_a_pinhole_took(monkeypatch: pytest.MonkeyPatch) -> None:
    depth_m, points_m = organised()
    depth_m, points_m = np.tile(depth_m, (2, 1))[:16], np.tile(points_m, (2, 1))[:256]
    points_m[:, 1] = points_m[:, 2] * (np.repeat(np.arange(16), 16) + 0.5 - PINHOLE.cy) / PINHOLE.fy
    [message] = Outcome(monkeypatch, ("cloud", "/points"), ("/points", cloud(TYPES, points_m, NOW_S, 16, "<"))).sent
    assert np.abs(message.picture(0.0).depth_m - depth_m).max() < 0.00011
    assert message.intrinsics.cy == pytest.approx(PINHOLE.cy, abs=1e-3)


@pytest.mark.parametrize(
    ("words", "comes", "says"),
    [
        ((), (), "[]; valid: image|cloud TOPIC [NAME=VALUE ...], names: address, camera, info,"),
        (("image",), (), "['image']; valid: image|cloud TOPIC"),
        (("depth", "/eye/depth"), (), "['depth', '/eye/depth']; valid: image|cloud TOPIC"),
        ((*IMAGE, "name=wrist"), (), "['image', '/eye/depth', 'name=wrist']; valid: image|cloud TOPIC"),
        ((*IMAGE, "latency_s=late"), (), "['image', '/eye/depth', 'latency_s=late']; valid: image|cloud TOPIC"),
        ((*IMAGE, "rectified=true"), (), "['image', '/eye/depth', 'rectified=true']; valid: image|cloud TOPIC"),
        (IMAGE, (image(np.ones(SIZE), "mono8", "<", 0, NOW_S),), "encoding = mono8; valid: 16UC1, 32FC1"),
        (IMAGE, (image(np.ones((1200, 1300)), "16UC1", "<", 0, NOW_S),), "1300 x 1200 pixels; valid: up to 1500000"),
        (("cloud", "/eye/depth"), (cloud(TYPES, np.ones((8, 3)), NOW_S, 1, "<"),), "/eye/depth: fields"),
    ],
)
def test_what_is_wrong_is_one_line_and_exit_code_2(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    comes: tuple[Any, ...],
    says: str,
) -> None:
    for message in comes:
        if words[0] == "cloud":
            message.fields.clear()
    sizes = [("/eye/camera_info", camera_info((one.height, one.width))) for one in comes if words[0] == "image"]
    found = Outcome(monkeypatch, words, *sizes, *((IMAGE[1], one) for one in comes))
    assert (found.code, found.sent) == (2, [])
    said = capsys.readouterr().err
    assert said.startswith(says)
    assert said.count("\n") == 1


def test_without_rclpy_a_line_says_where_it_is(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(SystemExit) as end:
        runpy.run_path(SCRIPT, run_name="__main__")
    assert end.value.code == 2
    said = capsys.readouterr().err
    assert "rclpy" in said
    assert said.endswith("; valid: a sourced ROS 2 with numpy, pyzmq and msgpack, and feelahead's clone\n")
