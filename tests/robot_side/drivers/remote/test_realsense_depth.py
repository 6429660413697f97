"""The example for RealSense cameras, with a stand-in for pyrealsense2, over real sockets."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from common.sockets.driver_port import DriverPort
from robot_side.drivers.remote.depth import RemoteDepth, TakenDepth
from robot_side.drivers.remote.depth_message import DEPTH_LIMIT_BYTES
from tests.helpers.python_process import start
from tests.helpers.repository import ROOT
from tests.helpers.socket_talk import EPHEMERAL, ROUNDS

pytestmark = pytest.mark.processes

PYREALSENSE2 = """
import sys, time
from types import SimpleNamespace as Space
import numpy
stream, format = Space(depth="depth"), Space(z16="z16")
timestamp_domain = Space(hardware_clock=0, system_time=1, global_time=2)
class config:
    def enable_device(self, serial):
        assert serial == "0815"
    def enable_stream(self, which, width, height, kind, rate):
        assert (which, width, height, kind, rate) == ("depth", 640, 480, "z16", 30)
class frame:
    def get_frame_timestamp_domain(self):
        return timestamp_domain.DOMAIN
    def get_timestamp(self):
        return 1000.0 * (time.time() - 0.09)
    def get_data(self):
        picture = numpy.full((480, 640), 5000, numpy.uint16)
        picture[7, 11] = 12345
        return picture
class nothing:
    def __bool__(self):
        return False
class pipeline:
    count = 0
    def start(self, config):
        pinhole = Space(width=640, height=480, fx=380.0, fy=381.0, ppx=319.5, ppy=240.25)
        video = Space(get_intrinsics=lambda: pinhole)
        sensor = Space(get_depth_scale=lambda: 0.0001)
        return Space(
            get_stream=lambda which: Space(as_video_stream_profile=lambda: video),
            get_device=lambda: Space(first_depth_sensor=lambda: sensor),
        )
    def wait_for_frames(self):
        time.sleep(1 / 30)
        self.count += 1
        return Space(get_depth_frame=nothing if self.count == 1 else frame)
"""
"""Stand-in for pyrealsense2: a wall at 0.5 m, one pixel of which is farther, exposed 90 ms ago"""


@pytest.fixture
def port() -> Iterator[DriverPort]:
    with DriverPort(EPHEMERAL, "--depth", DEPTH_LIMIT_BYTES) as opened:
        yield opened


@pytest.mark.parametrize(("domain", "least_age_s"), [("global_time", 0.09), ("hardware_clock", 0.13)])
def test_its_depth_arrives_with_its_intrinsics_and_its_age(
    port: DriverPort, tmp_path: Path, domain: str, least_age_s: float
) -> None:
    (tmp_path / "pyrealsense2.py").write_text(PYREALSENSE2.replace("DOMAIN", domain))
    notes: list[str] = []
    depth = RemoteDepth(port, notes.append)
    path, taken = f"{tmp_path}:{ROOT}", list[tuple[TakenDepth, float]]()
    with start(
        str(ROOT / "docs/drivers/realsense_depth.py"), port.endpoint, "fixed", "0815", PYTHONPATH=path
    ) as sender:
        try:
            for _ in range(ROUNDS):
                now_s = port.wait(0.005)
                if "fixed" in depth.update(now_s) and (newest := depth.take("fixed")) is not None:
                    taken.append((newest, now_s))
                # From the first echo on both bounds are known.
                if taken and taken[-1][0].latest_s - taken[-1][0].picture.taken_s < 0.4:
                    break
                assert sender.poll() is None, sender.communicate()[1]
            else:
                pytest.fail("no picture has echoed an answer")
        finally:
            sender.kill()
    newest, now_s = taken[-1]
    wall = np.full((480, 640), 0.5, dtype=np.float32)
    wall[7, 11] = 1.2345
    assert np.abs(newest.picture.depth_m - wall).max() < 1e-6
    pinhole = newest.picture.pinhole
    assert (pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy) == (380.0, 381.0, 320.0, 240.75)
    assert newest.mount is None
    assert now_s - newest.picture.taken_s >= least_age_s
    assert notes == []
    assert set(depth.senders.summary()) == {"accepted"}
