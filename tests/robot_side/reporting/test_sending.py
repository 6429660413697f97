"""Sending within the budget: haptics at once, telemetry if there is room, pictures in pieces that are joined again."""

from common.emulation.spec import LinkSpec
from common.rate.outgoing_queue import OutgoingQueue
from common.rate.pieces import PIECE, Joining
from robot_side.reporting.sending import Sending
from robot_side.tick.outgoing import Outgoing

PICTURE = bytes(range(256)) * 60


class Sockets:
    def __init__(self) -> None:
        self.sent: list[tuple[bytes, bytes]] = []
        self.published: list[tuple[bytes, bytes]] = []

    def send(self, peer: bytes, payload: bytes, *, everywhere: bool) -> bool:
        assert not everywhere
        self.sent.append((peer, payload))
        return True

    def publish(self, topic: bytes, payload: bytes) -> None:
        self.published.append((topic, payload))


def test_haptics_leave_in_every_turn_while_a_picture_leaves_piece_by_piece() -> None:
    sockets, queue = Sockets(), OutgoingQueue()
    sending = Sending(LinkSpec(), sockets, first_number=7)
    sending.send(queue, 0.0)
    sending.push([Outgoing("video", b"", PICTURE)], 0.0)
    assert sending.backlog_s("video", 0.0) > 0.1
    for turn in range(1, 900):
        sending.push([Outgoing("haptics", b"peer", b"h%d" % turn)], 1e-3 * turn)
        sending.send(queue, 1e-3 * turn)

    assert sockets.sent == [(b"peer", b"h%d" % turn) for turn in range(1, 900)]
    assert {topic for topic, _ in sockets.published} == {b"video" + PIECE}
    joining = Joining(1 << 20)
    assert [joining.add(piece) for _, piece in sockets.published] == [None] * (len(sockets.published) - 1) + [PICTURE]
    assert max(len(piece) for _, piece in sockets.published) <= 1.25 * 0.006 * 1e6 / 8.0 + 12
    assert sending.backlog_s("video", 0.9) == 0.0
    assert sending.next_due() is None


def test_a_small_message_leaves_whole_and_telemetry_gives_way_where_there_is_no_room() -> None:
    sockets, queue = Sockets(), OutgoingQueue()
    sending = Sending(LinkSpec.parse("haptics: delay 20ms"), sockets, first_number=0)
    sending.push([Outgoing("scene", b"", b"small"), Outgoing("telemetry", b"", b"t0")], 0.0)
    for turn in range(1, 12):
        sending.send(queue, 1e-3 * turn)
    assert sockets.published == [(b"telemetry", b"t0"), (b"scene", b"small")]

    sending.push([Outgoing("haptics", b"peer", bytes(4000)), Outgoing("telemetry", b"", b"t1")], 0.012)
    sending.send(queue, 0.013)
    assert sockets.published[2:] == sockets.sent == []
    assert sending.budget.held_back()["telemetry"] == {"rate": 1, "queue": 0}
    assert sending.next_due() == 0.032
    sending.send(queue, 0.032)
    assert sockets.sent == [(b"peer", bytes(4000))]
    assert sending.summary()["to_operator"]["achieved"]["sent"] == 1


def test_outages_of_all_streams_coincide_whenever_each_begins() -> None:
    """A picture stream that begins later is cut with haptics: it is one link."""
    sockets = Sockets()
    sending = Sending(LinkSpec.parse("outage 2s at 10s"), sockets, first_number=0)
    sending.push([Outgoing("haptics", b"robot", b"first")], 100.0)
    sending.send(None, 100.0)
    for now_s in (109.0, 111.0, 113.0):
        sending.push([Outgoing("telemetry", b"", b"later %d" % now_s)], now_s)
        sending.send(None, now_s)
    published = [payload for _, payload in sockets.published]
    assert published == [b"later 109", b"later 113"]
