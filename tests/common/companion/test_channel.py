import contextlib
import socket
from collections.abc import Iterator

from hypothesis import given
from hypothesis import strategies as st

from common.companion.channel import MESSAGE_LIMIT_BYTES, Channel


@contextlib.contextmanager
def pair(room_bytes: int = 1 << 23) -> Iterator[tuple[Channel, Channel]]:
    one, other = (Channel(end, room_bytes) for end in socket.socketpair())
    with contextlib.closing(one), contextlib.closing(other):
        yield one, other


def everything(channel: Channel, sender: Channel) -> list[bytes]:
    """Receive until the sender has nothing left to send; return all messages."""
    arrived: list[bytes] = []
    while True:
        more = channel.receive()
        arrived += more
        if not more and not sender.waiting:
            return arrived + channel.receive()
        sender.flush()


@given(st.lists(st.binary(max_size=3000), max_size=30))
def test_messages_arrive_whole_and_in_order(messages: list[bytes]) -> None:
    with pair() as (one, other):
        assert all(one.send(message[:7], message[7:]) for message in messages)
        assert everything(other, one) == messages


def test_what_finds_no_room_is_refused_whole() -> None:
    with pair(room_bytes=1_000_000) as (one, other):
        sent = [one.send(bytes([number]) * 300_000) for number in range(20)]
        assert not all(sent)
        assert [message[0] for message in everything(other, one)] == [n for n, left in enumerate(sent) if left]


def test_one_message_may_be_larger_than_the_room_and_leaves_in_parts() -> None:
    large = bytes(range(256)) * 20_000
    with pair(room_bytes=10) as (one, other):
        assert one.send(large)
        assert one.waiting > 0
        assert not one.send(b"next")
        assert everything(other, one) == [large]


def test_the_end_of_one_is_noticed_by_the_other() -> None:
    with pair() as (one, other):
        assert one.send(b"last")
        one.close()
        assert other.receive() == [b"last"]
        assert other.receive() == []
        assert other.ended
        assert not other.send(b"into the void")
        assert not one.send(b"from beyond")


def test_what_was_sent_before_an_end_arrives_even_if_an_answer_finds_it_closed_first() -> None:
    with pair() as (one, other):
        assert other.send(b"never read")  # Closing with this in the buffer is a reset, not a plain end.
        sent = [bytes(300_000), b"last"]  # more than one read takes
        assert all(one.send(message) for message in sent)
        assert one.waiting == 0
        one.close()
        other.send(b"an answer")
        assert other.ended
        assert other.receive() == sent
        assert other.receive() == []


def test_a_length_beyond_reason_ends_it() -> None:
    one, end = socket.socketpair()
    with one, contextlib.closing(Channel(end)) as channel:
        one.sendall((MESSAGE_LIMIT_BYTES + 1).to_bytes(4, "little"))
        assert channel.receive() == []
        assert channel.ended
