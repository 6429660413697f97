"""The real companion process with sent pictures, on a machine where nothing can be rendered."""

import os
import select
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import simplejpeg

from common.companion.process import Companion
from robot_side.viewing.exchange import Order, Picture, Ready, Refusal, Sent, Setup, Undecodable, encode
from robot_side.viewing.exchange import decode_from_companion as decode
from robot_side.viewing.starting import MODULE
from tests.helpers.machines.waiting import LIMIT_S

pytestmark = pytest.mark.processes

PICTURE = np.full((48, 64, 3), (200, 0, 0), np.uint8)
JPEG: bytes = simplejpeg.encode_jpeg(PICTURE, 90)


@pytest.fixture
def companion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Companion]:
    """Companion that finds a MuJoCo without any rendering."""
    (tmp_path / "mujoco.py").write_text("raise ImportError('no OpenGL here')")
    paths = [str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))
    with Companion(MODULE) as process:
        yield process


def ask(companion: Companion, message: Setup | Order) -> Any:
    """Send a message; return the answer."""
    channel, arrived = companion.channel, list[bytes]()
    channel.send(encode(message))
    while not arrived and not channel.ended:
        select.select([channel], [channel] if channel.waiting else [], [], LIMIT_S)
        arrived = channel.receive()
    assert len(arrived) == 1
    return decode(arrived[0])


def order(sent: Sent | None, *, halved: bool = False) -> Order:
    return Order("overview", 1.5, b"", b"", 90, halved=halved, sent=sent)


def test_sent_pictures_are_encoded_bad_ones_are_refused_and_nothing_is_rendered(companion: Companion) -> None:
    ready = ask(companion, Setup(b"", 64, 48, {}, sent=True))
    assert isinstance(ready, Ready)
    assert "no OpenGL here; to mend it: " in ready.unrendered
    for sent in (Sent(64, 48, "jpeg", JPEG), Sent(64, 48, "rgb8", PICTURE.tobytes())):
        for halved in (False, True):
            picture = ask(companion, order(sent, halved=halved))
            assert isinstance(picture, Picture)
            assert (picture.view, picture.captured_s) == ("overview", 1.5)
            assert (picture.width, picture.height) == ((32, 24) if halved else (64, 48))
            shown = simplejpeg.decode_jpeg(picture.content)
            assert shown.reshape(-1, 3).mean(axis=0) == pytest.approx((200.0, 0.0, 0.0), abs=6.0)
    for bad, says in (
        (Sent(64, 48, "jpeg", JPEG[:-100]), "no whole JPEG"),
        (Sent(48, 64, "jpeg", JPEG), "the JPEG has 64 x 48 pixels; valid: 48 x 64"),
        (None, "no OpenGL here"),
    ):
        answer = ask(companion, order(bad))
        assert isinstance(answer, Undecodable)
        assert says in answer.reason
    assert isinstance(ask(companion, order(Sent(64, 48, "jpeg", JPEG))), Picture)


def test_without_a_camera_process_nothing_can_be_shown(companion: Companion) -> None:
    answer = ask(companion, Setup(b"", 64, 48, {}))
    assert isinstance(answer, Refusal)
    assert "no OpenGL here" in answer.reason
