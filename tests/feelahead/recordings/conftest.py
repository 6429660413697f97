"""One recorded run of both sides in virtual time, for all tests that need a recording."""

import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from common.episode import EpisodeMark
from common.protocol.codec import encode
from common.protocol.messages import Header
from common.protocol.view_messages import VideoFrame
from common.recording.content import Content
from common.recording.mcap_file import RecordingFile
from common.recording.reading import Recording, open_recording
from common.recording.wire import FACTS, HEADER, VIEW, as_json, stamped
from feelahead.both_sides.episode import Episode
from feelahead.both_sides.episode_hands import GRASPING
from feelahead.both_sides.episode_recording import BLOCK_S
from feelahead.both_sides.loopback import Loopback

WALL_OFFSET_S = 1.7e9


def record_loopback(
    path: Path,
    duration_s: float,
    doing: Mapping[float, Callable[[Loopback, float], None]] | None = None,
    **settings: Any,
) -> None:
    """Record the scripted person's run; `settings` are both sides'. doing: done from that time on, in seconds."""
    left = dict(doing or {})
    with Episode(person=GRASPING, sampled=False, **settings) as episode:
        episode.record(path, wall_clock_s=WALL_OFFSET_S)
        for number in range(round(duration_s / BLOCK_S)):
            now_s = (number + 1) * BLOCK_S
            for due_s in [due_s for due_s in left if due_s < now_s]:
                left.pop(due_s)(episode.loop, now_s - BLOCK_S)
            episode.step(now_s - episode.time_s)


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
    """Return the same run with a camera: its messages again, and pictures at 10 Hz, captured 20 ms before."""
    return record_pictures(run, tmp_path / "pictures.mcap")


def record_pictures(
    run: Recording, path: Path, marks: Sequence[tuple[float, EpisodeMark]] = ()
) -> tuple[Recording, list[bytes]]:
    """Record the run's messages again into `path`, with pictures, and with marks of episodes at these times."""
    file = RecordingFile(path, 0.0)
    content = Content(file)
    content.write(0, HEADER + as_json({"side": "robot", **run.headers["robot"]}))
    payloads: list[bytes] = []
    next_s = 0.0
    began_ns = run.began_ns
    for message in run.messages(("/stiffness", "/command", "/robot/inputs")):
        now_s = 1e-9 * (message.log_ns - began_ns)
        if now_s >= next_s:
            header = Header(epoch=1, sequence=len(payloads) + 1, sent_s=now_s)
            frame = VideoFrame(header, "overview", now_s - 0.02, 32, 24, jpeg(10 * len(payloads) % 256))
            payloads.append(encode(frame))
            content.write(0, VIEW + stamped(now_s) + payloads[-1])
            next_s += 0.1
        file.write(message.topic, now_s, message.content)
    for time_s, mark in marks:
        file.write("/episode", time_s, as_json({"time_s": time_s, "side": "robot", "mark": mark}))
    content.write(0, FACTS + stamped(now_s) + b'{"now_s":1.0}')
    file.close()
    return open_recording(path), payloads
