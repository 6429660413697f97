"""Hostile bytes to the codec: a valid message, or the one documented error, in bounded time and memory."""

import random
from typing import Any

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from common.protocol.codec import MAXIMUM_BYTES, PROTOCOL_VERSION, decode, encode
from common.protocol.messages import AnyMessage, Header, Hello, MotionCommand
from feelahead.lab.hostile.inputs import payload
from tests.helpers.felt import felt

HEADER = Header(epoch=1, sequence=2, sent_s=3.0, echo_sent_s=2.5, echo_held_s=0.25)
VALID: tuple[AnyMessage, ...] = (
    Hello(HEADER, side="operator", clock_domain="boot"),
    MotionCommand(HEADER, l2=0.5, r2=0.25, lateral=(0.1, -0.1), run=True),
    felt(HEADER, l2=0, r2=5, rumble=0.5),
)


def survives(hostile: bytes) -> AnyMessage | None:
    """None for what is refused; a message that is valid through and through for what is not."""
    try:
        message = decode(hostile)
    except RemoteProtocolError:
        return None
    assert decode(encode(message)) == message
    return message


def test_the_hostile_mixture_raises_nothing_but_the_documented_error() -> None:
    generator = random.Random(0)  # noqa: S311
    outcomes = [survives(payload(generator)) for _ in range(20_000)]
    refused = outcomes.count(None)
    # Both happen, or this would test nothing.
    assert 10_000 < refused < 20_000


@given(st.sampled_from(VALID), st.data())
@settings(derandomize=True, deadline=None, max_examples=1000)
def test_bytes_cut_out_put_in_or_changed(message: AnyMessage, data: st.DataObject) -> None:
    hostile = bytearray(encode(message))
    for _ in range(data.draw(st.integers(1, 5))):
        position = data.draw(st.integers(0, len(hostile)))
        removed = data.draw(st.integers(0, 4))
        hostile[position : position + removed] = data.draw(st.binary(max_size=4))
    survives(bytes(hostile))


@pytest.mark.parametrize(
    "opening", [b"\x91", b"\x92\x01", b"\x81\xa1a", b"\x81\x91", b"\xdc\x00\x01", b"\xdf\x00\x00\x00\x01\xa1a"]
)
def test_nesting_as_deep_as_the_limit_allows(opening: bytes) -> None:
    depth = MAXIMUM_BYTES // len(opening)
    for hostile in (
        opening * depth,
        opening * (depth // 2) + b"\x01",
        bytes([0x92, PROTOCOL_VERSION]) + opening * 500 + b"\xc0",
    ):
        assert survives(hostile[:MAXIMUM_BYTES]) is None


@pytest.mark.parametrize(
    "claim",
    [
        b"\xdd\xff\xff\xff\xff",
        b"\xdf\xff\xff\xff\xff",
        b"\xdb\xff\xff\xff\xff",
        b"\xc6\xff\xff\xff\xff",
        b"\xc9\xff\xff\xff\xff\x01",
    ],
)
def test_claims_of_four_thousand_million_elements_allocate_nothing(claim: bytes) -> None:
    assert survives(claim) is None
    assert survives(claim + bytes(1000)) is None
    assert survives(bytes([0x92, PROTOCOL_VERSION]) + claim) is None


ODD: list[Any] = [
    *(float("nan"), float("inf"), float("-inf"), 1e308, -1e308, 5e-324),
    *(2**63, 2**64 - 1, -(2**63), -1, True, None, "", "x" * 1000, b"\xff" * 1000, [], {}, [[]], {"a": 1}),
    msgpack.Timestamp(1, 0),
    msgpack.ExtType(5, b"x"),
]


@pytest.mark.parametrize("odd", ODD, ids=lambda odd: f"{odd!r:.20}")
def test_an_odd_value_in_any_place_is_refused_or_in_range(odd: object) -> None:
    for message in VALID:
        whole = msgpack.unpackb(encode(message))
        for path in places(whole):
            spoiled = msgpack.unpackb(encode(message))
            holder = spoiled
            for step in path[:-1]:
                holder = holder[step]
            holder[path[-1]] = odd
            survives(msgpack.packb(spoiled))


def places(content: list[Any], before: tuple[int, ...] = ()) -> list[tuple[int, ...]]:
    found = []
    for position, item in enumerate(content):
        found.append((*before, position))
        if isinstance(item, list):
            found += places(item, (*before, position))
    return found


@given(st.lists(st.integers(-(2**63), 2**64 - 1), max_size=20), st.integers(-(2**63), 2**64 - 1))
@settings(derandomize=True, deadline=None, max_examples=300)
def test_huge_integers_anywhere(numbers: list[int], version: int) -> None:
    survives(msgpack.packb([version, numbers]))
    survives(msgpack.packb([PROTOCOL_VERSION, ["motion", numbers, *numbers]]))
    survives(msgpack.packb([PROTOCOL_VERSION, ["hello", numbers[:5], "operator", ""]]))


@pytest.mark.parametrize("size", [MAXIMUM_BYTES + 1, 10 * MAXIMUM_BYTES])
def test_what_is_too_long_is_not_looked_into(size: int) -> None:
    with pytest.raises(RemoteProtocolError, match=str(size)):
        decode(bytes(size))
