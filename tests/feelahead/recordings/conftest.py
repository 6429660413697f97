"""One recorded run of both sides in virtual time, for everything that is done with recordings."""

import io
from pathlib import Path

import pytest
from PIL import Image

from common.protocol.codec import encode
from common.protocol.messages import Header
from common.protocol.view_messages import VideoFrame
from common.recording.content import Content
from common.recording.mcap_file import RecordingFile
from common.recording.reading import Recording, open_recording
from common.recording.wire import FACTS, HEADER, VIEW, as_json, stamped
from tests.helpers.recorded_runs import record_loopback

DURATION_S = 6.0


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    record_loopback(path, DURATION_S, link="delay 20ms 5ms", seed=3)
    return open_recording(path)


def jpeg(value: int) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (32, 24), (value, 0, 0)).save(file, "JPEG")
    return file.getvalue()


@pytest.fixture
def with_pictures(run: Recording, tmp_path: Path) -> tuple[Recording, list[bytes]]:
    """The same run with a camera: its messages once more, and pictures at 10 Hz."""
    path = tmp_path / "pictures.mcap"
    file = RecordingFile(path, 0.0)
    content = Content(file)
    content.take(0, HEADER + as_json({"side": "robot", **run.headers["robot"]}))
    payloads: list[bytes] = []
    next_s = 0.0
    began_ns = run.began_ns()
    for message in run.messages(("/stiffness", "/command", "/robot/inputs")):
        now_s = 1e-9 * (message.log_ns - began_ns)
        if now_s >= next_s:
            header = Header(epoch=1, sequence=len(payloads) + 1, sent_s=now_s)
            frame = VideoFrame(header, "overview", now_s, 32, 24, jpeg(10 * len(payloads) % 256))
            payloads.append(encode(frame))
            content.take(0, VIEW + stamped(now_s) + payloads[-1])
            next_s += 0.1
        file.write(message.topic, now_s, message.content)
    content.take(0, FACTS + stamped(now_s) + b'{"now_s":1.0}')
    file.close()
    return open_recording(path), payloads
