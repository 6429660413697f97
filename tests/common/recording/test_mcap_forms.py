import io
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.writer import Writer

from common.errors import ConfigurationError
from common.recording.content import Content
from common.recording.entries import Kind, entry, pack_block
from common.recording.mcap_file import RecordingFile
from common.recording.reading import Message, open_recording
from common.recording.wire import BLOCK, FORMAT, HEADER, STATUS, as_json, stamped
from tests.helpers.recordings.forms import BARE, FORMS, rewritten
from tests.helpers.refusal import refusal


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of two sides, in which many messages have equal times, and those of a side come late."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    file = RecordingFile(path, 1.7e9)
    content = Content(file)
    for source, side in enumerate(("robot", "operator")):
        content.write(source, HEADER + as_json({"side": side, "settings": {"seed": 0}, "epoch": 1}))
    for number in range(60):
        for source, late_s in enumerate((0.0, 0.4)):
            now_s = 0.05 * (number // 3) - late_s + 1.0
            inside = entry(Kind.RECEIVED, now_s, b"\0", bytes(range(number)))
            content.write(source, BLOCK + pack_block(number, 0, now_s, now_s, inside))
            content.write(source, STATUS + stamped(now_s) + as_json({"state": "armed", "late_us": number}))
        if number % 20 == 19:
            file.flush()
    file.close()
    return path


def read(path: Path) -> tuple[list[Message], dict[str, Any]]:
    recording = open_recording(path)
    found = {name: value for name, value in vars(recording).items() if name not in ("path", "_parts", "_names")}
    return list(recording.messages()), found


@pytest.mark.parametrize("form", FORMS)
def test_every_form_reads_the_same(recorded: Path, tmp_path: Path, form: str) -> None:
    other = tmp_path / "other.mcap"
    other.write_bytes(rewritten(recorded, **FORMS[form]))
    assert other.read_bytes() != recorded.read_bytes()
    messages, found = read(other)
    assert (messages, found) == read(recorded)
    assert [one.log_ns for one in messages] == sorted(one.log_ns for one in messages)
    assert len(messages) == 240
    for side in ("robot", "operator"):
        inputs = list(open_recording(other).messages([f"/{side}/inputs"]))
        assert inputs == [one for one in messages if one.topic == f"/{side}/inputs"]


@pytest.mark.parametrize("form", ["zstd", "without chunks"])
def test_another_tools_clock_is_not_the_runs(recorded: Path, tmp_path: Path, form: str) -> None:
    other = tmp_path / "other.mcap"
    other.write_bytes(rewritten(recorded, notes_ns=0, **FORMS[form]))
    run, found = open_recording(recorded), open_recording(other)
    assert (found.began_ns, found.end_ns) == (run.began_ns, run.end_ns)
    assert "/notes" in found.topics


@pytest.mark.parametrize("form", ["zstd", "without chunks", "shuffled, without chunks", "newest first"])
def test_a_form_that_is_cut_off_reads_as_what_is_left(recorded: Path, tmp_path: Path, form: str) -> None:
    content, other = rewritten(recorded, **{**FORMS[form], **BARE, "chunk_size": 3000}), tmp_path / "other.mcap"
    whole = set(read(recorded)[0])
    lengths = []
    for cut in range(len(content) - 60, 0, -len(content) // 60):
        other.write_bytes(content[:cut])
        try:
            messages, found = read(other)
        except ValueError as error:
            assert "; valid: " in str(error)  # noqa: PT017  # of any cut
            lengths.append(0)
            continue
        assert not found["whole"]
        assert whole.issuperset(messages)
        lengths.append(len(messages))
    assert lengths == sorted(lengths, reverse=True)
    assert len({*lengths}) > 3
    assert lengths[-1] == 0


def of_another_tool(
    topic: str, *, metadata: bool = False, messages: int = 1, times: int = 1, every_h: int = 0
) -> bytes:
    output = io.BytesIO()
    writer: Any = Writer(output)
    writer.start()
    for epoch in range(times if metadata else 0):
        writer.add_metadata("feelahead.robot", {"format": str(FORMAT), "epoch": str(epoch)})
    channel_id = writer.register_channel(topic, "json", 0)
    for number in range(messages):
        writer.add_message(channel_id, 3600 * 10**9 * every_h * number, b"{}", number)
    writer.finish()
    return output.getvalue()


def unchunked(recorded: Path) -> bytes:
    return rewritten(recorded, **FORMS["without chunks"])


def flipped_after(path: Path, name: bytes) -> bytes:
    content = path.read_bytes()
    place = content.index(name) + len(name) + 60
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def unchunked_and_flipped(recorded: Path) -> bytes:
    return unchunked(recorded).replace(b'"late_us":7}', b'"late_us":8}', 1)


def other_compression(recorded: Path) -> bytes:
    return rewritten(recorded, **FORMS["lz4"]).replace(b"\x03\x00\x00\x00lz4", b"\x03\x00\x00\x00br!")


def channel(content: bytes) -> slice:
    """Return where the first channel's record of a file without chunks stands."""
    begin = content.index(b"/robot/inputs") - 4 - 2 - 2 - 8 - 1  # its length, schema's id, id, record's length, kind
    return slice(begin, begin + 9 + int.from_bytes(content[begin + 1 : begin + 9], "little"))


def two_topics(recorded: Path) -> bytes:
    content = unchunked(recorded)
    place = channel(content)
    return content[: place.stop] + content[place].replace(b"/robot", b"/other") + content[place.stop :]


def no_channel(recorded: Path) -> bytes:
    content = unchunked(recorded)
    begin = channel(content).start
    return content[:begin] + b"\x80" + content[begin + 1 :]


def with_bombs(recorded: Path, bytes_each: int, count: int) -> bytes:
    """Put chunks of zeros before the first one; each is one record of a kind that readers pass over."""
    packed = zstandard.compress(struct.pack("<BQ", 0x7F, bytes_each - 9) + bytes(bytes_each - 9))
    body = struct.pack("<QQQI", 0, 0, bytes_each, 0) + struct.pack("<I4sQ", 4, b"zstd", len(packed)) + packed
    content = recorded.read_bytes()
    place = 8
    while content[place] != Opcode.CHUNK:
        place += 9 + int.from_bytes(content[place + 1 : place + 9], "little")
    return content[:place] + count * (struct.pack("<BQ", Opcode.CHUNK, len(body)) + body) + content[place:]


REFUSED: dict[str, tuple[Callable[[Path], bytes], str]] = {
    "empty": (lambda _: b"", "is empty"),
    "no MCAP": (lambda recorded: b"PK" + recorded.read_bytes(), "is no MCAP file"),
    "nothing but zeros": (lambda recorded: recorded.read_bytes()[:8] + bytes(50), "its header is damaged"),
    "cut off at once": (lambda recorded: recorded.read_bytes()[:700], "ends before its first complete second"),
    "damaged at once": (lambda recorded: flipped_after(recorded, b"zstd"), "is damaged in its first second"),
    "without messages": (lambda _: of_another_tool("/stiffness", metadata=True, messages=0), "holds no messages"),
    "of others": (lambda _: of_another_tool("/imu"), "holds nothing that feelahead recorded"),
    "without metadata": (lambda _: of_another_tool("/stiffness"), "mcap filter --include-metadata"),
    "two runs in one": (
        lambda _: of_another_tool("/stiffness", metadata=True, times=2),
        "holds two runs of the robot side",
    ),
    "of two clocks": (
        lambda _: of_another_tool("/stiffness", metadata=True, messages=2, every_h=25),
        "spans 25 h by its stamps",
    ),
    "compressed otherwise": (other_compression, "is compressed by 'br!'; valid: zstd, lz4 or none"),
    "damaged, without chunks": (unchunked_and_flipped, "its checksum"),
    "a channel that is not described": (no_channel, "which nothing before them describes"),
    "a chunk that unpacks to gigabytes": (
        lambda recorded: with_bombs(recorded, bytes_each=(1 << 27) + 1, count=1),
        "has a chunk of 134217729 bytes after unpacking; valid: at most 134217728",
    ),
    "many chunks that unpack to gigabytes": (
        lambda recorded: with_bombs(recorded, bytes_each=1 << 25, count=30),
        "unpacks to more than 200 times its size",
    ),
    "a channel of two topics": (two_topics, "has two topics in channel"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_cannot_be_read_is_refused_with_the_reason(recorded: Path, tmp_path: Path, kind: str) -> None:
    make, told = REFUSED[kind]
    path = tmp_path / "other.mcap"
    path.write_bytes(make(recorded))
    said = refusal(open_recording, path)
    assert said.startswith(f"{path}: ")
    assert told in said
    assert "; valid: " in said


@given(
    records=st.lists(st.tuples(st.integers(0, 15), st.binary(max_size=80)), max_size=6),
    place=st.integers(0, 600),
    flipped=st.binary(),
)
def test_any_bytes_are_read_or_refused_in_one_line(
    records: list[tuple[int, bytes]], place: int, flipped: bytes, recorded: Path, tmp_path_factory: Any
) -> None:
    whole = recorded.read_bytes()
    place = min(8 + place, len(whole))
    odd = b"".join(struct.pack("<BQ", kind, len(body)) + body for kind, body in records)
    path = tmp_path_factory.getbasetemp() / "any.mcap"
    for content in (whole[:8] + odd + whole[8:], whole[:place] + flipped + whole[place + len(flipped) :]):
        path.write_bytes(content)
        try:
            list(open_recording(path).messages())
        except ConfigurationError as error:
            assert "\n" not in str(error)  # noqa: PT017  # of any content
