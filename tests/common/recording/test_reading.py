import json
import os
import resource
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import ConfigurationError
from common.protocol.codec import encode
from common.protocol.messages import Header
from common.protocol.view_messages import SceneShapes, Shape, ShapeKind
from common.recording.content import Content
from common.recording.entries import Entry, Kind, entry, pack_block, split_text, text, unpack_block
from common.recording.mcap_file import RecordingFile
from common.recording.reading import open_recording
from common.recording.wire import BLOCK, FORMAT, HEADER, NOTE, STATUS, VIEW, as_json, stamped
from tests.helpers.messages import scene_state

SECONDS = 5
BLOCKS_A_SECOND = 20


def write_short(path: Path) -> list[int]:
    """Write a recording of five seconds; return, for each second, the position in the file where its chunk ends."""
    file = RecordingFile(path, 1.7e9)
    content, ends = Content(file), []
    generator = np.random.default_rng(0)
    content.write(0, HEADER + as_json({"side": "robot", "settings": {"seed": 0}, "epoch": 1, "versions": {}}))
    for second in range(SECONDS):
        for part in range(BLOCKS_A_SECOND):
            number, now_s = BLOCKS_A_SECOND * second + part, second + part / BLOCKS_A_SECOND
            inside = entry(Kind.RECEIVED, now_s, b"\0", generator.bytes(40))
            content.write(0, BLOCK + pack_block(number, 0, now_s, now_s, inside))
        content.write(0, STATUS + stamped(now_s) + as_json({"state": "armed", "loop_age_ms": float("nan")}))
        content.write(0, NOTE + stamped(now_s) + b"a note")
        file.flush()
        ends.append(file.kept_bytes)
    file.close()
    return ends


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, list[int]]:
    path = tmp_path_factory.mktemp("short") / "short.mcap"
    ends = write_short(path)
    return path.read_bytes(), ends


def blocks(path: Path) -> int:
    found = [unpack_block(one.content).number for one in open_recording(path).messages(["/robot/inputs"])]
    assert found == list(range(len(found)))
    return len(found)


def test_a_whole_file_has_everything(short: tuple[bytes, list[int]], tmp_path: Path) -> None:
    path = tmp_path / "whole.mcap"
    path.write_bytes(short[0])
    recording = open_recording(path)
    assert recording.whole
    assert recording.headers["robot"]["settings"] == {"seed": 0}
    assert blocks(path) == SECONDS * BLOCKS_A_SECOND
    logged = list(recording.messages(["/robot/status"]))
    assert [one.log_ns for one in logged] == [round(1e9 * (1.7e9 + second + 0.95)) for second in range(SECONDS)]
    assert b'"loop_age_ms":null' in logged[0].content


def test_a_file_cut_at_any_byte_opens_up_to_its_last_complete_second(
    short: tuple[bytes, list[int]], tmp_path: Path
) -> None:
    content, ends = short
    path = tmp_path / "cut.mcap"
    cuts = np.random.default_rng(1).integers(0, len(content), 1000).tolist()
    for cut in (*cuts, *ends, *(end - 1 for end in ends)):
        path.write_bytes(content[:cut])
        # Indexes follow a chunk; no second needs them.
        complete = sum(end <= cut for end in ends)
        try:
            found = blocks(path)
        except ConfigurationError:
            assert complete == 0
            continue
        assert found % BLOCKS_A_SECOND == 0
        assert complete <= found // BLOCKS_A_SECOND <= min(complete + 1, SECONDS)


def test_a_damaged_description_is_told_in_one_line(short: tuple[bytes, list[int]], tmp_path: Path) -> None:
    content = short[0]
    path = tmp_path / "damaged.mcap"
    begin = content.index(b"feelahead.robot")
    told: list[str] = []
    for place in range(begin - 8, begin + 80):
        spoilt = bytearray(content)
        spoilt[place] ^= 0x80
        path.write_bytes(spoilt)
        try:
            open_recording(path)
        except ConfigurationError as error:
            told.append(str(error))
    assert any("its header is damaged; valid: " in text for text in told)
    assert not any("\n" in text for text in told)


def test_another_format_and_a_pipe_are_told(tmp_path: Path) -> None:
    path = tmp_path / "newer.mcap"
    file = RecordingFile(path, 0.0)
    file.describe("feelahead.robot", {"format": str(FORMAT + 1)})
    file.close()
    with pytest.raises(ConfigurationError, match=f"format {FORMAT + 1} of recordings; valid: format {FORMAT}"):
        open_recording(path)
    os.mkfifo(tmp_path / "pipe.mcap")
    with pytest.raises(ConfigurationError, match="cannot be read: it is a pipe"):
        open_recording(tmp_path / "pipe.mcap")


ENTRIES = st.lists(
    st.builds(
        Entry,
        st.sampled_from(Kind),
        st.floats(allow_nan=False),
        st.binary(max_size=300),
    ),
    max_size=20,
)


@given(ENTRIES, st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_what_is_packed_is_unpacked(entries: list[Entry], number: int, dropped: int) -> None:
    packed = b"".join(entry(Kind(one.kind), one.now_s, one.content[:1], one.content[1:]) for one in entries)
    block = unpack_block(pack_block(number, dropped, 1.0, 2.0, packed))
    assert (block.number, block.dropped, block.first_s, block.last_s) == (number, dropped, 1.0, 2.0)
    assert list(block.unpacked()) == entries


@given(ENTRIES.filter(bool), st.data())
def test_a_block_that_ends_within_an_entry_is_refused(entries: list[Entry], data: st.DataObject) -> None:
    packed = b"".join(entry(Kind(one.kind), one.now_s, one.content) for one in entries)
    last = len(entry(Kind(entries[-1].kind), entries[-1].now_s, entries[-1].content))
    end = data.draw(st.integers(len(packed) - last + 1, len(packed) - 1))
    with pytest.raises(ValueError, match="cut off within an entry"):
        list(unpack_block(pack_block(0, 0, 0.0, 0.0, packed[:end])).unpacked())


@given(st.binary(max_size=255), st.binary(max_size=100))
def test_text_before_bytes(short: bytes, rest: bytes) -> None:
    assert split_text(text(short) + rest) == (short, rest)
    with pytest.raises(ValueError, match="is cut off"):
        split_text((text(short) + rest)[: len(short)] if short else b"")


@pytest.mark.parametrize("room", [500_001, 511_117, 532_003, 563_333, 594_567, 600_001])
def test_a_full_disk_is_kept_as_an_error_and_nothing_else_is_said(
    room: int, tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    generator = np.random.default_rng(room)
    path = tmp_path / "run.mcap"
    file = RecordingFile(path, 0.0)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        for number in range(100):
            file.write("/robot/inputs", 0.01 * number, generator.bytes(20_000))
            if number % 10 == 9:
                file.flush()
        file.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert file.error is not None
    assert 0 < file.kept_bytes == path.stat().st_size <= room
    assert "".join(capfd.readouterr()) == ""
    # Without a configured handler, logging would write to stderr outside a test.
    assert caplog.records == []


HERE = (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
KINDS: tuple[ShapeKind, ...] = ("sphere", "box", "cylinder", "capsule", "ellipsoid", "plane", "mesh")


def test_a_scene_is_drawn_once_and_moved(tmp_path: Path) -> None:
    corners = np.eye(3, dtype="<f4").tobytes()
    triangles = np.arange(3, dtype="<u4").tobytes()
    shapes = tuple(
        Shape(0, True, kind, (0.1, 0.2, 0.3), HERE, vertices_m=corners, triangles=triangles)
        if kind == "mesh"
        else Shape(0, False, kind, (0.1, 0.2, 0.3), HERE)
        for kind in KINDS
    )
    path = tmp_path / "scene.mcap"
    file = RecordingFile(path, 1.7e9)
    content = Content(file)
    content.write(0, HEADER + as_json({"side": "robot"}))
    for number in range(3):
        header = Header(1, 2 * number + 1, 1.0)
        scene = SceneShapes(header, 1, ("hand",), ("post",), shapes)
        state = scene_state(Header(1, 2 * number + 2, 1.0))
        for message in (scene, state):
            content.write(0, VIEW + stamped(1.0 + number) + encode(message))
    file.close()
    recording = open_recording(path)
    assert len(list(recording.messages(["/scene"]))) == 1
    moved = list(recording.messages(["/tf"]))
    assert len(moved) == 3
    assert all(name in moved[0].content for name in (b"link/hand", b"object/post", b"tool"))
    (overlap, *_) = recording.messages(["/overlap"])
    assert json.loads(overlap.content)["objects"] == [{"object": "post", "l2_mm3": 1.0, "r2_mm3": 2.0}]
    (terms, *_) = recording.messages(["/enlargement"])
    assert json.loads(terms.content)["r2"]["quantile"] == 2.3
    assert len(list(recording.messages(["/view"]))) == 6
