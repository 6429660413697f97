"""Pictures encoded in H.264 by the robot side, and decoded to JPEG by the operator side."""

import resource

import msgspec
import numpy as np
import pytest
import simplejpeg
from hypothesis import given
from hypothesis import strategies as st

from common.protocol.messages import Header
from common.protocol.view_messages import VideoStep
from robot_side.drivers.mujoco.scene import load_scene
from tests.robot_side.viewing.picture_taking import HEIGHT, WIDTH, Image, picture_taker

pytest.importorskip("av", reason="needs the extra `video`")
import av

from common.video.steps import Steps, _decoder
from robot_side.viewing.h264 import H264

HEADER = Header(epoch=1, sequence=2, sent_s=3.0)


def moving(number: int, width: int = 160, height: int = 96) -> Image:
    """Draw picture `number` of a bright disc that moves across a background of changing colours."""
    rows, columns = np.mgrid[0:height, 0:width]
    picture = np.stack([columns % 256, 2 * rows % 256, 128 + 0 * rows], axis=2)
    picture[np.hypot(rows - height // 2, columns - 20 - 3 * number) < 12] = (250, 250, 90)
    return picture.astype(np.uint8)


def step(encoder: H264, picture: Image, quality: int = 90, *, whole: bool = False) -> VideoStep:
    content, is_whole = encoder.encode(picture, quality, whole=whole)
    height, width, _ = picture.shape
    return VideoStep(HEADER, "first_person", 1.5, width, height, encoder.number, is_whole, content)


WHOLE = step(H264(), moving(0)).h264


def error(steps: Steps, sent: VideoStep, picture: Image) -> float | None:
    """Decode a step; return the root mean square error of the picture, of 255, or None if no picture results."""
    frame = steps.decode(sent)
    if frame is None:
        return None
    assert (frame.view, frame.captured_s) == ("first_person", 1.5)
    shown = simplejpeg.decode_jpeg(frame.jpeg)
    assert shown.shape == picture.shape == (frame.height, frame.width, 3)
    return float(np.sqrt(np.mean((shown.astype(float) - picture) ** 2)))


def test_each_picture_is_shown_as_it_comes_and_takes_few_bytes() -> None:
    encoder, steps, sizes = H264(), Steps(), []
    for number in range(30):
        sent = step(encoder, moving(number))
        assert (sent.number, sent.whole) == (number + 1, number == 0)
        found = error(steps, sent, moving(number))
        assert found is not None
        assert found < 8.0
        sizes.append(len(sent.h264))
    assert steps.lacks == (0, 0)
    assert np.mean(sizes[1:]) < 0.3 * sizes[0]
    assert np.mean(sizes[1:]) < 0.2 * len(simplejpeg.encode_jpeg(moving(0), 90))


def test_after_a_picture_that_is_lost_nothing_is_shown_until_a_whole_one() -> None:
    encoder, steps = H264(), Steps()
    sent = [step(encoder, moving(number), whole=number in (0, 20)) for number in range(30)]
    assert [one.number for one in sent if one.whole] == [1, 21]
    del sent[9]
    shown = [steps.decode(one) is not None for one in sent]
    assert shown == 9 * [True] + 10 * [False] + 10 * [True]
    late = Steps()
    assert late.decode(sent[4]) is None
    assert late.lacks == (0, 5)
    # Viewers that missed nothing are shown the whole one like any other.
    assert late.decode(sent[19]) is not None
    assert late.lacks == (0, 0)


def test_another_size_or_quality_begins_with_a_whole_picture() -> None:
    encoder, steps = H264(), Steps()
    for sent, picture, whole in (
        (step(encoder, moving(0)), moving(0), True),
        (step(encoder, moving(1), 91), moving(1), False),  # As near as x264's factor goes.
        (step(encoder, moving(2), 30), moving(2), True),
        (step(encoder, moving(3, 80, 48), 30), moving(3, 80, 48), True),
        (step(encoder, moving(4, 80, 48), 30), moving(4, 80, 48), False),
    ):
        assert sent.whole == whole
        found = error(steps, sent, picture)
        assert found is not None
        assert found < 16.0


@pytest.mark.parametrize("unit", [b"\x67", b"\x68", b"\x09\xf0"])
def test_a_picture_of_many_empty_units_takes_no_memory(unit: bytes) -> None:
    encoder, steps = H264(), Steps()
    whole = step(encoder, moving(0))
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    many = whole.h264 + 50_000 * (b"\0\0\1" + unit)
    assert steps.decode(msgspec.structs.replace(whole, h264=many)) is None
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb < 50_000  # 200 MB before
    assert steps.decode(whole) is not None


@pytest.mark.parametrize("size", [(161, 95), (640, 480), (4096, 2160)])
def test_pictures_of_any_size_are_decoded(size: tuple[int, int]) -> None:
    width, height = (2 * (part // 2) for part in size)
    assert Steps().decode(step(H264(), moving(0, width, height))) is not None


def test_a_picture_larger_than_its_message_states_is_not_decoded() -> None:
    large = av.Packet(step(H264(), moving(0, 640, 480)).h264)
    assert _decoder(640, 480).decode(large)
    with pytest.raises(av.FFmpegError):
        _decoder(160, 96).decode(large)


@given(st.lists(st.tuples(st.sampled_from([0, 1, 5, 6, 7, 8, 9]), st.binary(max_size=60)), max_size=6), st.booleans())
def test_any_units_are_a_picture_or_lacking(units: list[tuple[int, bytes]], whole: bool) -> None:
    content = b"".join(b"\0\0\1" + bytes([0x60 | kind]) + rest for kind, rest in units)
    steps = Steps()
    steps.decode(VideoStep(HEADER, "overview", 1.5, 160, 96, 1, True, WHOLE))
    frame = steps.decode(VideoStep(HEADER, "overview", 1.5, 160, 96, 2, whole, content))
    assert steps.lacks == ((2, 0) if frame is None else (0, 0))


@pytest.mark.parametrize("content", [b"", b"\x00", bytes(1000), b"\x00\x00\x00\x01\x67" + bytes(range(200))])
def test_bytes_that_are_no_picture_are_lacking_and_no_error(content: bytes) -> None:
    encoder, steps = H264(), Steps()
    assert steps.decode(step(encoder, moving(0))) is not None
    for whole in (False, True):
        assert steps.decode(VideoStep(HEADER, "first_person", 1.5, 160, 96, 2, whole, content)) is None
        assert steps.lacks == (0, 2)
    wrong_size = VideoStep(HEADER, "first_person", 1.5, 320, 96, 3, True, step(encoder, moving(1), whole=True).h264)
    assert steps.decode(wrong_size) is None
    assert steps.decode(step(encoder, moving(2), whole=True)) is not None
    assert steps.lacks == (0, 0)


@pytest.mark.processes
def test_the_companion_makes_jpeg_or_steps_as_each_order_says() -> None:
    with picture_taker(load_scene()) as taker:
        jpeg, steps = taker.take("overview").astype(float), Steps()
        for number in (1, 2):
            picture = taker.picture("overview", h264=True)
            assert (picture.number, picture.whole) == (number, number == 1)
            place = HEADER, picture.view, picture.captured_s, WIDTH, HEIGHT
            frame = steps.decode(VideoStep(*place, picture.number, picture.whole, picture.content))
            assert frame is not None
            assert np.abs(simplejpeg.decode_jpeg(frame.jpeg) - jpeg).mean() < 3.0
        assert taker.picture("overview").number == 0
