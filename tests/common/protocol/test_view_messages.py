import struct

import msgspec
import pytest

from common.errors import RemoteProtocolError
from common.protocol.codec import VIEW_MAXIMUM_BYTES, Prepared, decode, decode_view, encode
from common.protocol.messages import Header, Hello
from common.protocol.view_messages import AnyViewMessage, EnlargementTerms, SceneShapes, SceneState, Shape, VideoFrame
from tests.common.protocol.packed import packed_by_msgpack

HEADER = Header(epoch=1, sequence=2, sent_s=3.0)
POSE = (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
FLOATS = struct.pack("<7f", *POSE)
TERMS = EnlargementTerms(0.01, 0.001, 0.002, 0.003, 0.004, 2.3, 0.1, 0.02)


def state(**changes: object) -> SceneState:
    fields: dict[str, object] = {
        "version": 1,
        "taken_s": 2.5,
        "link_poses": FLOATS,
        "object_index": struct.pack("<I", 3),
        "object_poses": FLOATS,
        "roles": bytes([0, 1]),
        "tool_pose": POSE,
        "spheres": struct.pack("<4f", 0.0, 0.0, 0.0, 0.01),
        "overlaps": ((3, 1e-9, 2e-9),),
        "l2": TERMS,
        "r2": TERMS,
        "tick_p50_us": 100.0,
        "tick_p99_us": 200.0,
        "overruns": 0,
    }
    return SceneState(HEADER, **(fields | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "message",
    [
        VideoFrame(HEADER, view="overview", captured_s=3.0, width=640, height=480, jpeg=b"\xff\xd8\x00"),
        SceneShapes(
            HEADER,
            version=1,
            links=("palm",),
            objects=("ball",),
            shapes=(Shape(0, False, "mesh", (1.0, 1.0, 1.0), POSE, vertices_m=b"\x00" * 12, triangles=b"\x01" * 12),),
        ),
        state(),
    ],
)
def test_they_come_back_as_they_were_and_are_no_control_messages(message: AnyViewMessage) -> None:
    payload = encode(message)
    assert decode_view(payload) == message
    assert payload == packed_by_msgpack(message)
    with pytest.raises(RemoteProtocolError):
        decode(payload)
    with pytest.raises(RemoteProtocolError):
        decode_view(encode(Hello(HEADER, side="robot", clock_domain="")))


def test_a_picture_travels_as_its_bytes() -> None:
    picture = bytes(range(256)) * 100
    payload = encode(VideoFrame(HEADER, view="first_person", captured_s=3.0, width=640, height=480, jpeg=picture))
    assert picture in payload


@pytest.mark.parametrize(
    "changes",
    [{"link_poses": b"123"}, {"spheres": b"123"}, {"object_poses": b""}],
)
def test_arrays_hold_whole_rows(changes: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="valid:"):
        state(**changes)


@pytest.mark.parametrize("size", [0, 5000])
def test_pictures_have_a_size(size: int) -> None:
    with pytest.raises(ValueError, match="valid: 1 to"):
        VideoFrame(HEADER, view="overview", captured_s=3.0, width=size, height=480, jpeg=b"")


def test_more_than_a_view_may_be_is_not_looked_into() -> None:
    with pytest.raises(RemoteProtocolError, match="valid: up to"):
        decode_view(bytes(VIEW_MAXIMUM_BYTES + 1))


def test_a_message_that_is_prepared_is_the_same_under_any_header() -> None:
    for message in (
        state(),
        SceneShapes(HEADER, 1, ("palm",), ("ball",), (Shape(0, False, "sphere", (0.1, 0.0, 0.0), POSE),), 2, FLOATS),
    ):
        prepared = Prepared(message)
        for header in (HEADER, Header(7, 2**40, 1e6, 0.25, 0.5, 0.125, 0.75)):
            assert prepared.under(header) == encode(msgspec.structs.replace(message, header=header))


def test_poses_of_objects_are_a_row_for_each_or_none() -> None:
    with pytest.raises(ValueError, match="object_poses"):
        SceneShapes(HEADER, 1, (), ("ball", "box"), (), object_poses=FLOATS)
