import math
from typing import Any

import msgpack
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import OtherVersionError, RemoteProtocolError
from common.protocol.codec import MAXIMUM_BYTES, PROTOCOL_VERSION, decode, encode
from common.protocol.messages import (
    AnyMessage,
    Header,
    Hello,
    LeaseNotice,
    MotionCommand,
    StiffnessUpdate,
    Telemetry,
    TriggerField,
    Tune,
    Watch,
)
from common.protocol.session import SessionState
from tests.common.protocol.packed import packed_by_msgpack
from tests.helpers.felt import felt, field, ways

unit = st.floats(0.0, 1.0)
signed_unit = st.floats(-1.0, 1.0)
finite = st.floats(-1e6, 1e6)
headers = st.builds(
    Header,
    epoch=st.integers(0, 2**63 - 1),
    sequence=st.integers(0, 2**63 - 1),
    sent_s=finite,
    echo_sent_s=st.none(),
    echo_held_s=st.none(),
) | st.builds(
    Header,
    epoch=st.integers(0, 2**53),
    sequence=st.integers(0, 2**53),
    sent_s=finite,
    echo_sent_s=finite,
    echo_held_s=unit,
)
eight_ways = st.lists(st.floats(-100.0, 100.0), min_size=8, max_size=8).map(lambda metres: ways(*sorted(metres)))
fields = st.builds(
    TriggerField,
    fast_m=eight_ways,
    slow_m=eight_ways,
    full_speed_m_s=st.floats(1e-6, 100.0),
    acceleration_m_s2=st.floats(1e-6, 1e6),
    displacement_m=st.floats(-100.0, 100.0),
    stiffness=unit,
)
messages: st.SearchStrategy[AnyMessage] = st.one_of(
    st.builds(Hello, headers, side=st.sampled_from(["operator", "robot"]), clock_domain=st.text(max_size=50)),
    st.builds(
        MotionCommand,
        headers,
        l2=unit,
        r2=unit,
        lateral=st.tuples(signed_unit, signed_unit),
        turning=st.tuples(signed_unit, signed_unit),
        gripper=signed_unit,
        run=st.booleans(),
        compensation=st.sampled_from(["operator", "robot"]),
    ),
    st.builds(Watch, headers, overview=st.booleans(), first_person=st.booleans(), scene=st.booleans()),
    st.builds(
        Tune,
        headers,
        number=st.integers(1, 2**63 - 1),
        probability=st.none() | st.floats(0.01, 0.999),
        link=st.none() | st.text(max_size=200),
    ),
    st.builds(
        LeaseNotice,
        headers,
        session=st.sampled_from(SessionState),
        why=st.text(max_size=200),
        token=st.integers(0, 2**63 - 1),
        waiting=st.integers(0, 1000),
        place=st.integers(0, 1000),
        may_tune=st.booleans(),
        probability=st.none() | unit,
        tuned=st.integers(0, 2**63 - 1),
    ),
    st.builds(
        StiffnessUpdate,
        headers,
        l2=fields,
        r2=fields,
        speed_m_s=signed_unit,
        horizon_m=unit,
        rumble=unit,
        state=st.sampled_from(["armed", "stopped"]),
        told_m_s=st.none() | signed_unit,
    ),
    st.builds(
        Telemetry,
        headers,
        state=st.sampled_from(["armed", "disarmed"]),
        tool_position_m=st.tuples(finite, finite, finite),
        tool_speed_m_s=unit,
        target=st.none() | st.text(max_size=100),
        target_in_tool_m=st.none() | st.tuples(finite, finite, finite),
        up_in_tool=st.tuples(signed_unit, signed_unit, signed_unit),
        gripper_opening_m=unit,
        holding=st.booleans(),
        enlargement_m=unit,
        l2=unit,
        r2=unit,
    ),
)
HEADER = Header(epoch=1, sequence=2, sent_s=3.0)


@given(messages)
@settings(derandomize=True, deadline=None)
def test_messages_come_back_as_they_were(message: AnyMessage) -> None:
    payload = encode(message)
    assert decode(payload) == message
    assert len(payload) <= MAXIMUM_BYTES


@given(messages)
@settings(derandomize=True, deadline=None)
def test_the_bytes_are_those_that_messagepack_gives_for_the_same_values(message: AnyMessage) -> None:
    assert encode(message) == packed_by_msgpack(message)


@given(messages, st.data())
@settings(derandomize=True, deadline=None, max_examples=300)
def test_damaged_bytes_mean_what_they_mean_to_messagepack(message: AnyMessage, data: st.DataObject) -> None:
    payload = bytearray(encode(message))
    # Not the version: bytes of another one are not looked into.
    position = data.draw(st.integers(2, len(payload) - 1))
    payload[position] = data.draw(st.integers(0, 255))
    expected: AnyMessage | None
    try:
        expected = msgspec.convert(msgpack.unpackb(bytes(payload))[1], AnyMessage)
    except (ValueError, TypeError, msgspec.ValidationError):
        expected = None
    try:
        decoded = decode(bytes(payload))
    except RemoteProtocolError:
        decoded = None
    assert decoded == expected


@given(st.binary(max_size=200))
@settings(derandomize=True, deadline=None, max_examples=500)
def test_garbage_raises_only_the_documented_error(payload: bytes) -> None:
    with pytest.raises(RemoteProtocolError):
        decode(payload)


@given(messages, st.data())
@settings(derandomize=True, deadline=None, max_examples=500)
def test_damaged_messages_decode_to_valid_ones_or_are_refused_whole(message: AnyMessage, data: st.DataObject) -> None:
    payload = bytearray(encode(message))
    position = data.draw(st.integers(0, len(payload) - 1))
    payload[position] ^= data.draw(st.integers(1, 255))
    try:
        decoded = decode(bytes(payload[: data.draw(st.integers(0, len(payload)))]))
    except RemoteProtocolError:
        return
    assert decode(encode(decoded)) == decoded


nested = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63)
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=8),
    lambda inner: st.lists(inner, max_size=6) | st.dictionaries(st.text(max_size=4), inner, max_size=4),
    max_leaves=20,
)


@given(nested)
@settings(derandomize=True, deadline=None, max_examples=500)
def test_well_packed_nonsense_is_refused(content: Any) -> None:
    with pytest.raises(RemoteProtocolError):
        decode(msgpack.packb([PROTOCOL_VERSION, content]))


def motion(**changes: Any) -> list[Any]:
    fields = {"token": 0, "r2": 0.5, "lateral": [0.0, 0.0], "sent_s": 3.0} | changes
    header = [1, 2, fields["sent_s"], None, None]
    return [
        PROTOCOL_VERSION,
        ["motion", header, 0.0, fields["r2"], fields["lateral"], [0.0, 0.0], 0.0, True, *[False] * 4, fields["token"]],
    ]


def test_the_unspoiled_message_is_valid() -> None:
    assert decode(msgpack.packb(motion())) == MotionCommand(HEADER, l2=0.0, r2=0.5, run=True)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"r2": math.nan}, "r2"),
        ({"r2": math.inf}, "r2"),
        ({"r2": 1.0001}, "r2"),
        ({"r2": -1e-9}, "r2"),
        ({"r2": True}, "float"),
        ({"r2": "1"}, "float"),
        ({"lateral": [0.0]}, "length 2"),
        ({"lateral": [0.0, math.nan]}, "lateral"),
        ({"sent_s": math.inf}, "sent_s"),
        ({"token": -1}, "token"),
        ({"token": 0.5}, "int"),
    ],
)
def test_one_bad_field_spoils_the_whole_message(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(RemoteProtocolError, match=named):
        decode(msgpack.packb(motion(**changes)))


def test_another_version_is_told_apart_from_garbage() -> None:
    content = motion()
    content[0] = PROTOCOL_VERSION + 1
    with pytest.raises(OtherVersionError, match=f"protocol version {PROTOCOL_VERSION + 1}"):
        decode(msgpack.packb(content))


def test_another_version_is_told_whatever_else_the_bytes_hold() -> None:
    with pytest.raises(OtherVersionError):
        decode(bytes([0x92, PROTOCOL_VERSION + 1, 0xA1, 0xFF]))  # a text that is none


@pytest.mark.parametrize("version", [-1, True, "2", None, 2.0, [2]])
def test_what_is_no_version_is_garbage(version: object) -> None:
    content = motion()
    content[0] = version
    with pytest.raises(RemoteProtocolError) as caught:
        decode(msgpack.packb(content))
    assert not isinstance(caught.value, OtherVersionError)


def test_an_oversize_payload_is_not_looked_into() -> None:
    with pytest.raises(RemoteProtocolError, match=str(MAXIMUM_BYTES)):
        decode(encode(Hello(HEADER, side="robot", clock_domain="")) + bytes(MAXIMUM_BYTES))


def test_messages_refuse_bad_values_when_made() -> None:
    with pytest.raises(ValueError, match="rumble"):
        felt(HEADER, rumble=2.0)
    for name in ("speed_m_s", "horizon_m"):
        with pytest.raises(ValueError, match=f"{name} = nan"):
            msgspec.structs.replace(felt(HEADER), **{name: math.nan})
    with pytest.raises(ValueError, match=r"horizon_m = -0\.1"):
        msgspec.structs.replace(felt(HEADER), horizon_m=-0.1)
    with pytest.raises(ValueError, match="both or neither"):
        Header(epoch=1, sequence=1, sent_s=0.0, echo_sent_s=1.0)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"fast_m": ways(0.2, 0.1)}, "fast_m = .* none shorter than the one before"),
        ({"slow_m": ways(0.0, math.nan)}, "slow_m = nan"),
        ({"slow_m": ways(0.0, math.inf)}, "slow_m = inf"),
        ({"full_speed_m_s": 0.0}, "full_speed_m_s = 0"),
        ({"acceleration_m_s2": 0.0}, "acceleration_m_s2 = 0"),
        ({"acceleration_m_s2": math.inf}, "acceleration_m_s2 = inf"),
        ({"displacement_m": math.nan}, "displacement_m = nan"),
        ({"stiffness": 1.1}, "stiffness = 1.1"),
    ],
)
def test_a_field_refuses_what_nobody_could_render(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        msgspec.structs.replace(field(ways(0.1)), **changes)


def test_telemetry_comes_back() -> None:
    message = Telemetry(
        HEADER,
        state="armed",
        tool_position_m=(0.1, 0.2, 0.3),
        tool_speed_m_s=0.1,
        target="target",
        target_in_tool_m=None,
        up_in_tool=(0.0, -1.0, 0.0),
        gripper_opening_m=0.08,
        holding=False,
        enlargement_m=0.01,
        l2=0.0,
        r2=1.0,
    )
    assert decode(encode(message)) == message
