"""Robot side in real processes, with the example of docs/drivers that sends a camera's pictures."""

import json
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
import simplejpeg
import zmq

from common.clock import MonotonicClock
from common.protocol.codec import VIEW_MAXIMUM_BYTES, decode_view, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import Watch
from common.protocol.view_messages import VIDEO_TOPIC, VideoFrame
from common.rate.pieces import PIECE, Joining
from common.sockets.operator import OperatorSockets
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.python_process import start
from tests.helpers.repository import ROOT
from tests.helpers.socket_talk import ROUNDS

pytestmark = pytest.mark.processes

CV2 = """
import time
import numpy, simplejpeg
CAP_PROP_BUFFERSIZE = 38
class VideoCapture:
    def __init__(self, number):
        self.picture = numpy.zeros((240, 320, 3), numpy.uint8)
        self.picture[:, :, 2] = 200  # blue, green, red
    def set(self, key, value):
        return True
    def read(self):
        time.sleep(1 / 30)
        return True, self.picture
def imencode(ending, picture):
    return True, numpy.frombuffer(simplejpeg.encode_jpeg(picture, 95, colorspace="BGR"), numpy.uint8)
"""
"""Stand-in for OpenCV: a camera that sees red"""
JPEG = simplejpeg.encode_jpeg(np.zeros((48, 64, 3), np.uint8), 90)


@contextmanager
def robot_side(summary: Path) -> Iterator[tuple["subprocess.Popen[str]", str, str, str]]:
    """Run a robot side; yield it, and the addresses for operators, their views, and cameras."""
    address = "tcp://127.0.0.1:0"
    options = f"--bind={address}", f"--pictures={address}", f"--summary={summary}", "--scene=wall"
    with start("-m", "robot_side", *options) as process:
        try:
            assert process.stdout is not None
            cameras = ""
            for line in process.stdout:
                if "pictures are taken at" in line:
                    cameras = line.split()[-1]
                if "listening at" in line:
                    words = line.split()
                    yield process, words[words.index("listening") + 2].rstrip(","), words[-1], cameras
                    break
        finally:
            process.kill()


class Viewer:
    """Operator who watches both views, and shows only JPEG."""

    def __init__(self, sockets: OperatorSockets) -> None:
        self.newest: dict[str, VideoFrame] = {}
        self._sockets, self._end, self._clock = sockets, LinkEnd("operator", 5, "clock"), MonotonicClock()
        self._joining, self._next_s = Joining(VIEW_MAXIMUM_BYTES), 0.0

    def look(self) -> float:
        """Look for a moment; return the time."""
        now_s = self._clock.now()
        if now_s >= self._next_s:
            self._next_s = now_s + 0.2
            self._sockets.send(encode(self._end.hello(now_s)))
            self._sockets.send(encode(Watch(self._end.stamp(now_s), overview=True, first_person=True)))
        self._sockets.wait(0.01)
        self._sockets.receive()
        for topic, payload in self._sockets.receive_view():
            whole = self._joining.add(payload) if topic.endswith(PIECE) else payload
            frame = None if whole is None else decode_view(whole)
            if isinstance(frame, VideoFrame):
                self.newest[frame.view] = frame
        return now_s


def is_red(frame: VideoFrame) -> bool:
    red, green, blue = simplejpeg.decode_jpeg(frame.jpeg).reshape(-1, 3).mean(axis=0)
    return bool(red > 150.0 and green < 50.0 and blue < 50.0)


def hostile(message: dict[str, Any], **fields: Any) -> bytes:
    """Return a picture of the overview with these fields."""
    message["sequence"] += 1
    packed: bytes = msgpack.packb(message | fields)
    return packed


def test_a_sent_view_is_in_the_stream_the_other_is_rendered_and_bad_pictures_are_refused(tmp_path: Path) -> None:
    (tmp_path / "cv2.py").write_text(CV2)
    summary = tmp_path / "summary.json"
    with (
        robot_side(summary) as (process, control, view, cameras),
        OperatorSockets(control, view, topics=(VIDEO_TOPIC,)) as sockets,
        zmq.Context() as context,
        context.socket(zmq.DEALER) as stranger,
    ):
        viewer = Viewer(sockets)
        path = f"{tmp_path}:{ROOT}"
        with start(str(ROOT / "docs/drivers/example_pictures.py"), cameras, PYTHONPATH=path) as example:
            try:
                age_s = np.inf
                for _ in range(ROUNDS):
                    now_s = viewer.look()
                    frame = viewer.newest.get("first_person")
                    if frame is not None and frame.width == 320:
                        age_s = min(age_s, now_s - frame.captured_s)
                        # Its clock is ours, so the true age is known, and bounded once an answer is echoed.
                        if age_s < 0.4 and "overview" in viewer.newest:
                            break
                else:
                    pytest.fail(f"no picture that is young enough: {age_s}")
                assert is_red(viewer.newest["first_person"])
                assert age_s >= 0.05
                assert (viewer.newest["overview"].width, viewer.newest["overview"].height) == (640, 480)
                assert not is_red(viewer.newest["overview"])
            finally:
                example.kill()
        stranger.linger = 0
        stranger.connect(cameras)
        message = {"version": 1, "sequence": 0, "sent_s": 1.0, "taken_s": 1.0, "view": "overview"}
        message |= {"width": 64, "height": 48, "format": "jpeg", "bytes": JPEG}
        for says, fields in (
            ("no whole JPEG", {"bytes": JPEG[: len(JPEG) // 2]}),
            ("<= 1920", {"width": 100_000, "height": 100_000}),
            ("valid: 9216, three for each", {"format": "rgb8", "bytes": bytes(9215)}),
            ("pixels; valid: 32 x 32", {"width": 32, "height": 32}),
        ):
            for _ in range(ROUNDS):
                stranger.send(hostile(message, **fields))
                viewer.look()
                if stranger.poll(0) and says in msgpack.unpackb(stranger.recv()).get("refused", ""):
                    break
            else:
                pytest.fail(f"never refused: {says}")
        for _ in range(ROUNDS):
            stranger.send(hostile(message))
            viewer.look()
            if viewer.newest["overview"].width == 64:
                break
        else:
            pytest.fail("a good picture after bad ones is not shown")
        process.send_signal(signal.SIGTERM)
        assert process.wait(LIMIT_S) == 0
    figures = json.loads(summary.read_text())
    assert figures["errors"] == []
    taken = figures["drivers"]["pictures"]
    assert taken["accepted"] > 0
    assert taken["malformed"] >= 2
    assert taken["undecodable"] >= 2
