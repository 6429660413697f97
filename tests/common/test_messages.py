"""Messages are unchanged by encoding and decoding, are valid MessagePack, and are refused whole for one bad field."""

import math
import struct
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol import messages as control
from common.protocol.around import AXES, LISTS, PROBES, Around
from common.protocol.codec import (
    MAXIMUM_BYTES,
    PROTOCOL_VERSION,
    VIEW_MAXIMUM_BYTES,
    Prepared,
    decode,
    decode_view,
    encode,
)
from common.protocol.compact import STEP_M, AnyOnWire, packed, unpacked
from common.protocol.messages import (
    AnyMessage,
    Header,
    Hello,
    Message,
    MotionCommand,
    StiffnessUpdate,
    Telemetry,
    TriggerField,
)
from common.protocol.session import SessionState
from common.protocol.uniform_field import FAR_M, STRENGTHS, uniform_field
from common.protocol.view_messages import AnyViewMessage, SceneShapes, Shape, VideoFrame, VideoStep
from tests.helpers.hostile.spoiled import nested
from tests.helpers.messages import field, onsets, scene_state, uniform_update

HEADER = Header(epoch=1, sequence=2, sent_s=3.0)
FULL = Header(2**53 - 1, 10_000_000, 1e6 / 3.0, 1e5 / 3.0, 0.02 / 3.0, 1e5 / 7.0, 0.01 / 3.0)
POSE = (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
ROW = struct.pack("<7f", *POSE)
SHAPE = Shape(0, False, "mesh", (1.0, 1.0, 1.0), POSE, vertices_m=b"\x00" * 12, triangles=bytes(12))
SCENE = msgspec.structs.replace(scene_state(HEADER), roles=bytes([0, 1]), spheres=bytes(16))
VIEWS: tuple[AnyViewMessage, ...] = (
    VideoFrame(HEADER, view="overview", captured_s=3.0, width=640, height=480, jpeg=bytes(range(256)) * 100),
    SceneShapes(HEADER, 1, ("palm",), ("ball",), (SHAPE,), 2, ROW),
    SCENE,
    VideoStep(HEADER, "first_person", 3.0, 640, 480, number=7, whole=False, h264=bytes(range(256))),
)
VALID: tuple[AnyMessage, ...] = (
    Hello(HEADER, side="operator", clock_domain="boot"),
    MotionCommand(HEADER, l2=0.5, r2=0.25, lateral=(0.1, -0.1), run=True),
    uniform_update(HEADER, l2=0, r2=5, rumble=0.5),
)


# One strategy for every message class, made from its type hints; fields checked by hand are narrowed here.

unit, stick = st.floats(0.0, 1.0), st.floats(-1.0, 1.0)
finite = st.floats(-1e6, 1e6)
stamps = st.integers(0, 2**63 - 1)
headers = st.builds(Header, stamps, stamps, finite) | st.builds(Header, stamps, stamps, finite, finite, unit)
eight_ways = st.lists(st.floats(-100.0, 100.0), min_size=8, max_size=8).map(lambda metres: onsets(*sorted(metres)))
BY_HAND: dict[str, st.SearchStrategy[Any]] = {
    **dict.fromkeys(("header",), headers),
    **dict.fromkeys(("fast_m", "slow_m"), eight_ways),
    **dict.fromkeys(("lateral", "turning"), st.tuples(stick, stick)),
    **dict.fromkeys(("up_in_tool",), st.tuples(stick, stick, stick)),
    **dict.fromkeys(("tool_position_m",), st.tuples(finite, finite, finite)),
    **dict.fromkeys(("target_in_tool_m",), st.none() | st.tuples(finite, finite, finite)),
    **dict.fromkeys(("full_speed_m_s", "acceleration_m_s2"), st.floats(1e-6, 100.0)),
    **dict.fromkeys(("commanded_m_s",), st.none() | stick),
    **dict.fromkeys(
        ("around",),
        st.none()
        | st.builds(
            Around,
            st.floats(1e-6, 4.0),
            st.binary(min_size=84, max_size=84),
            st.integers(1, 32).flatmap(lambda joints: st.binary(min_size=10 * joints, max_size=10 * joints)),
        ),
    ),
    **dict.fromkeys(("token",), stamps),
    **dict.fromkeys(("lacks",), st.none() | st.tuples(stamps, stamps)),
}


def values(hint: Any) -> st.SearchStrategy[Any]:
    if get_origin(hint) is Annotated:
        kind, meta = get_args(hint)
        if kind is str:
            return st.text(max_size=meta.max_length)
        return st.integers(meta.ge, meta.le) if kind is int else st.floats(meta.ge, meta.le)
    if get_args(hint) and type(None) in get_args(hint):
        return st.none() | values(next(kind for kind in get_args(hint) if kind is not type(None)))
    if hint is float:
        return unit
    if hint is str:
        return st.text(max_size=100)
    if isinstance(hint, type) and issubclass(hint, msgspec.Struct):
        return made(hint)
    return st.from_type(hint)


def made(kind: type[Any]) -> st.SearchStrategy[Any]:
    hints = get_type_hints(kind, include_extras=True)
    return st.builds(kind, **{name: BY_HAND[name] if name in BY_HAND else values(hints[name]) for name in hints})


messages: st.SearchStrategy[AnyMessage] = st.one_of([made(kind) for kind in get_args(AnyMessage)])


def packed_by_msgpack(message: Message) -> bytes:
    content = msgspec.to_builtins(packed(message), builtin_types=(bytes,))
    payload: bytes = msgpack.packb([PROTOCOL_VERSION, content])
    return payload


def said(message: Message) -> dict[str, Any]:
    """Return the message's values by name, those of nested structures included."""
    found: dict[str, Any] = {}
    for name, value in msgspec.structs.asdict(message).items():
        is_field = isinstance(value, TriggerField | Around)
        found |= {f"{name}.{key}": one for key, one in said(value).items()} if is_field else {name: value}
    return found


@given(messages | st.sampled_from(VIEWS))
@settings(max_examples=300)
def test_a_message_comes_back_as_it_was_and_is_messagepack(message: Any) -> None:
    payload = encode(message)
    ours, others = (decode_view, decode) if isinstance(message, get_args(AnyViewMessage)) else (decode, decode_view)
    back = ours(payload)
    if isinstance(message, StiffnessUpdate | Telemetry):
        is_told_as_it_was(message, back)
        assert decode(encode(back)) == back  # Nothing is lost twice.
        assert back.header == message.header
    else:
        assert back == message
    assert payload == packed_by_msgpack(message)
    with pytest.raises(RemoteProtocolError):
        others(payload)
    assert ours is decode_view or len(payload) <= MAXIMUM_BYTES


def is_told_as_it_was(message: StiffnessUpdate | Telemetry, back: Any) -> None:
    assert type(back) is type(message)
    told, horizon_m = said(back), getattr(back, "horizon_m", 0.0)
    for name, value in said(message).items():
        if name.endswith(("fast_m", "slow_m")):
            for sent_m, told_m in zip(value, told[name], strict=True):
                assert told_m <= sent_m
                known = -2.0 + STEP_M <= sent_m <= min(2.0 - 2.0 * STEP_M, horizon_m)
                assert told_m >= sent_m - STEP_M or told_m == horizon_m <= sent_m or not known
        elif name == "horizon_m":
            assert value - STEP_M <= told[name] <= value
        elif name == "response_s":
            assert value - 1e-6 <= told[name] <= value + 0.004
        elif name == "rumble":
            assert value <= told[name] <= value + 0.125
        elif isinstance(value, float):
            assert told[name] == np.float32(value)
        elif isinstance(value, tuple):
            assert told[name] == tuple(map(np.float32, value))
        else:
            assert told[name] == value


@given(messages, st.data())
@settings(max_examples=500)
def test_damaged_bytes_mean_what_they_mean_to_messagepack(message: AnyMessage, data: st.DataObject) -> None:
    hostile = bytearray(encode(message))
    for _ in range(data.draw(st.integers(1, 4))):
        position = data.draw(st.integers(2, len(hostile)))  # Bytes of another version are not decoded.
        removed = data.draw(st.integers(0, 3))
        hostile[position : position + removed] = data.draw(st.binary(max_size=3))
    try:
        expected = unpacked(msgspec.convert(msgpack.unpackb(bytes(hostile))[1], AnyOnWire))
    except (ValueError, TypeError, KeyError, msgspec.ValidationError, struct.error):
        expected = None
    decoded = survives(bytes(hostile))
    # msgpack also fails on keys that cannot be hashed; ours may still be valid.
    assert expected is None or decoded == expected


@given(made(StiffnessUpdate) | made(Telemetry), st.data())
@settings(max_examples=500)
def test_any_field_of_bytes_is_refused_whole_or_valid_through_and_through(
    message: StiffnessUpdate | Telemetry, data: st.DataObject
) -> None:
    content = msgpack.unpackb(encode(message))
    field_bytes = bytearray(content[1][-1])
    for _ in range(data.draw(st.integers(1, 3))):
        field_bytes[data.draw(st.integers(0, len(field_bytes) - 1))] = data.draw(st.integers(0, 255))
    content[1][-1] = bytes(field_bytes[: data.draw(st.just(len(field_bytes)) | st.integers(0, len(field_bytes)))])
    survives(msgpack.packb(content))


EVERYDAY: tuple[AnyMessage, ...] = (
    Hello(FULL, side="operator", clock_domain="operator-workstation-0b7f4f2e-9d3c-4d5e-8a51-6f0c2b1de9a7"),
    MotionCommand(FULL, 0.51, 0.13, (0.1, -0.1), (0.2, -0.3), 1.0, run=True, token=70000, compensation="operator"),
    control.Watch(FULL, overview=True, first_person=True, scene=True),
    control.Tune(FULL, 12, 0.995, "delay 50ms 10ms distribution normal loss 1%"),
    control.Mark(FULL, 12, "success"),
    control.LeaseNotice(
        FULL,
        SessionState.STOPPED_READY,
        "the operator side began a new epoch",
        70000,
        8,
        3,
        True,
        0.99,
        12,
        12,
        "only the owner may",
    ),
    control.LinkReport(
        FULL, 123456.7, 1234.5, 0.123, "30 Hz, quality 75, size 0.5", "pictures 12 (rate), scene 3 (queue)"
    ),
    uniform_update(FULL, l2=8, r2=5, rumble=0.5),
    Telemetry(
        FULL,
        "armed",
        (0.4, 0.1, 0.3),
        "the blue cup on the shelf",
        (0.0, 0.1, 0.2),
        (0.0, 0.0, 1.0),
        0.2,
        0.08,
        False,
        0.01,
        0.1,
        0.2,
    ),
)


@pytest.mark.parametrize("message", EVERYDAY, ids=lambda message: type(message).__name__)
def test_every_message_for_hands_and_fingers_is_at_most_200_bytes(message: AnyMessage) -> None:
    assert len(encode(message)) <= 200


def test_a_map_of_six_joints_adds_149_bytes() -> None:
    plain, told = uniform_update(FULL, l2=8, r2=5), Around(0.8, bytes(LISTS * PROBES), bytes(2 * 6 * AXES))
    mapped = msgspec.structs.replace(plain, around=told)
    assert len(encode(mapped)) - len(encode(plain)) == 149


def test_every_kind_of_them_was_measured() -> None:
    assert {type(message) for message in EVERYDAY} == set(get_args(AnyMessage))


def survives(hostile: bytes) -> AnyMessage | None:
    """Decode bytes; return None if they are refused, else the message, which must encode and decode unchanged."""
    try:
        message = decode(hostile)
    except RemoteProtocolError:
        return None
    assert decode(encode(message)) == message
    return message


@given(st.binary(max_size=200) | nested.map(lambda content: msgpack.packb([PROTOCOL_VERSION, content])))
@settings(max_examples=1000)
def test_garbage_and_well_packed_nonsense_raise_the_documented_error(payload: bytes) -> None:
    with pytest.raises(RemoteProtocolError):
        decode(payload)


@pytest.mark.parametrize("version", [PROTOCOL_VERSION + 1, -1, True, "2", None, 2.0, [2]])
def test_another_version_is_told_apart_from_garbage(version: Any) -> None:
    content = msgpack.unpackb(encode(VALID[1]))
    for rest in (msgpack.packb(content[1]), b"\xa1\xff"):  # whatever else the bytes hold
        with pytest.raises(RemoteProtocolError) as caught:
            decode(b"\x92" + msgpack.packb(version) + rest)
        if isinstance(version, int) and version > PROTOCOL_VERSION:
            assert isinstance(caught.value, OtherVersionError)
            assert f"protocol version {version}" in str(caught.value)
        else:
            assert not isinstance(caught.value, OtherVersionError)


def test_what_is_too_long_is_not_looked_into() -> None:
    for limit, read in ((MAXIMUM_BYTES, decode), (VIEW_MAXIMUM_BYTES, decode_view)):
        with pytest.raises(RemoteProtocolError, match=f"{limit + 1} bytes; valid: up to {limit}"):
            read(bytes(limit + 1))
    with pytest.raises(RemoteProtocolError):
        decode(encode(VALID[0]) + bytes(MAXIMUM_BYTES))


REFUSED: tuple[tuple[Any, dict[str, Any], str], ...] = (
    (HEADER, {"epoch": -1}, "epoch = -1"),
    (HEADER, {"sequence": 2**63}, "sequence = 9223372036854775808"),
    (HEADER, {"sent_s": math.nan}, "sent_s = nan"),
    *(
        (HEADER, {f"{name}_sent_s": sent_s, f"{name}_held_s": held_s}, f"{name}_(sent|held)_s")
        for name in ("echo", "last")
        for sent_s, held_s in ((1.0, None), (None, 0.1), (math.nan, 0.1), (1.0, -0.1), (1.0, 2e9))
    ),
    *((VALID[1], {name: value}, name) for name in ("l2", "r2") for value in (math.nan, math.inf, 1.0001, -1e-9)),
    *((VALID[1], {name: (0.0, value)}, name) for name in ("lateral", "turning") for value in (math.nan, 1.1)),
    (VALID[1], {"gripper": -1.1}, "gripper"),
    (VALID[1], {"token": -1}, "token"),
    (VALID[2], {"rumble": 2.0}, "rumble = 2.0"),
    (VALID[2], {"speed_m_s": math.nan}, "speed_m_s = nan"),
    (VALID[2], {"horizon_m": -0.1}, "horizon_m = -0.1"),
    (VALID[2], {"commanded_m_s": math.inf}, "commanded_m_s = inf"),
    (field(onsets(0.1)), {"fast_m": onsets(0.2, 0.1)}, "fast_m = .* each at least as long as the one before"),
    (field(onsets(0.1)), {"slow_m": onsets(0.0, math.nan)}, "slow_m = nan"),
    (field(onsets(0.1)), {"slow_m": onsets(0.0, math.inf)}, "slow_m = inf"),
    (field(onsets(0.1)), {"full_speed_m_s": 0.0}, "full_speed_m_s = 0"),
    (field(onsets(0.1)), {"acceleration_m_s2": math.inf}, "acceleration_m_s2 = inf"),
    (field(onsets(0.1)), {"displacement_m": math.nan}, "displacement_m = nan"),
    (field(onsets(0.1)), {"course_stiffness": 1.1}, "course_stiffness = 1.1"),
    (SCENE, {"link_poses": b"123"}, "link_poses or spheres ends within a row; valid: whole rows"),
    (SCENE, {"spheres": b"123"}, "link_poses or spheres ends within a row; valid: whole rows"),
    (SCENE, {"object_poses": b""}, "object_poses has .* bytes; valid: "),
    (VIEWS[1], {"object_poses": ROW + ROW}, "object_poses has .* bytes; valid: "),
)


@pytest.mark.parametrize(("valid", "changes", "said"), REFUSED)
def test_what_is_checked_by_hand_is_refused_when_made(valid: Any, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        msgspec.structs.replace(valid, **changes)


def declared() -> list[tuple[Any, str, Any]]:
    """Return values that fields with a declared range must refuse, as (message, field, value).

    Texts and integers are just outside the range; floats are NaN or infinite.
    """
    found: list[tuple[Any, str, Any]] = []
    samples = [VIEWS[0], VALID[0], control.Tune(HEADER, 1), control.LeaseNotice(HEADER, "armed", "", 1, 0)]  # type: ignore[arg-type]
    for sample in samples:
        for name, hint in get_type_hints(type(sample), include_extras=True).items():
            inner = next((one for one in get_args(hint) if get_origin(one) is Annotated), hint)
            if get_origin(inner) is not Annotated:
                continue
            kind, meta = get_args(inner)
            if kind is str:
                found.append((sample, name, "x" * (meta.max_length + 1)))
            elif kind is int:
                found += [(sample, name, meta.ge - 1), (sample, name, meta.le + 1), (sample, name, 0.5)]
            else:
                found += [(sample, name, value) for value in (math.nan, math.inf, -math.inf)]
    return found


@pytest.mark.parametrize(("valid", "name", "value"), declared())
def test_what_lies_outside_a_declared_range_is_refused_when_made_and_when_read(
    valid: Message, name: str, value: Any
) -> None:
    with pytest.raises(ValueError, match=f"^{name} = .*; valid: "):
        msgspec.structs.replace(valid, **{name: value})
    content = msgspec.to_builtins(valid, builtin_types=(bytes,))
    content[valid.__struct_fields__.index(name) + 1] = value
    read = decode_view if isinstance(valid, VideoFrame | VideoStep) else decode
    if not (isinstance(value, int) and value > 2**63 - 1):  # more than MessagePack has bytes for
        with pytest.raises(RemoteProtocolError):
            read(msgpack.packb([PROTOCOL_VERSION, content]))


@pytest.mark.parametrize("message", VIEWS)
def test_a_message_that_is_prepared_is_the_same_under_any_header(message: AnyViewMessage) -> None:
    prepared = Prepared(message)
    for header in (HEADER, Header(7, 2**40, 1e6, 0.25, 0.5, 0.125, 0.75)):
        assert prepared.under(header) == encode(msgspec.structs.replace(message, header=header))


@pytest.mark.parametrize("strength", range(-1, STRENGTHS + 2))
def test_a_uniform_field_has_its_strength_at_every_distance(strength: int) -> None:
    if not 0 <= strength <= STRENGTHS:
        with pytest.raises(ValueError, match=f"strength = {strength}; valid: 0 to 8"):
            uniform_field(strength)
        return
    made_field = uniform_field(strength)
    for metres in (made_field.fast_m, made_field.slow_m):
        assert sum(way <= -FAR_M for way in metres) == strength
        assert sum(way >= FAR_M for way in metres) == STRENGTHS - strength
    assert made_field.course_stiffness == strength / STRENGTHS
