"""Pictures that a camera process sends, in virtual time."""

from typing import Any

import msgpack
import pytest

from robot_side.drivers.remote.picture_message import PICTURE_LIMIT_BYTES
from robot_side.drivers.remote.pictures import RemotePictures
from robot_side.drivers.remote.sender_clock import UNBOUNDED_S
from robot_side.drivers.remote.senders import SILENT_S

JPEG = b"\xff\xd8\xff\xe0 and more"
AHEAD_S = -700.0
"""Sender's clock minus ours"""


class Camera:
    """Stand-in for the process that has the cameras, and its connection to the robot side."""

    def __init__(self) -> None:
        self.now_s, self.sequence, self.asked = 10.0, 0, 0
        self.notes: list[str] = []
        self.answers: list[dict[str, Any]] = []
        self._sent: list[tuple[bytes, bytes, float]] = []
        self.pictures = RemotePictures(self, self.notes.append)

    def receive(self) -> list[tuple[bytes, bytes, float]]:
        sent, self._sent = self._sent, []
        return sent

    def send(self, peer: bytes, payload: bytes) -> bool:
        self.answers.append(msgpack.unpackb(payload))
        return bool(peer)

    def ask(self) -> bool:
        self.asked += 1
        return True

    def sends(self, peer: bytes = b"eye", way_s: float = 0.0, exposed_s: float = 0.02, **fields: Any) -> None:
        """Send a picture that leaves `way_s` before now. `fields` replace those of the message; None leaves one out."""
        self.sequence += 1
        sent_s = self.now_s - way_s + AHEAD_S
        message: dict[str, Any] = {
            "version": 1,
            "sequence": self.sequence,
            "sent_s": sent_s,
            "taken_s": sent_s - exposed_s,
        }
        message |= {"view": "first_person", "width": 640, "height": 480, "format": "jpeg", "bytes": JPEG} | fields
        whole = {name: value for name, value in message.items() if value is not None}
        self._sent.append((peer, msgpack.packb(whole), self.now_s))
        self.update()

    def update(self, *, watched: bool = True) -> None:
        self.pictures.update(self.now_s, watched=watched)


def test_the_newest_picture_of_each_view_is_there_until_it_is_taken() -> None:
    camera = Camera()
    assert not camera.pictures.sends("first_person")
    assert camera.pictures.take("first_person") is None
    camera.sends()
    camera.sends(bytes=JPEG + b"2")
    assert camera.pictures.sends("first_person")
    assert not camera.pictures.sends("overview")
    assert camera.pictures.fresh("first_person")
    picture = camera.pictures.take("first_person")
    assert picture is not None
    assert (picture.content, picture.width, picture.height, picture.format) == (JPEG + b"2", 640, 480, "jpeg")
    assert not camera.pictures.fresh("first_person")
    assert camera.pictures.take("first_person") is None
    camera.sends(peer=b"other", view="overview", width=16, height=16, format="rgb8", bytes=bytes(768))
    assert camera.pictures.fresh("overview")
    assert camera.pictures.senders.summary() == {"accepted": 3}


def test_without_an_echo_a_picture_counts_as_half_a_second_older_and_that_is_told_once() -> None:
    camera = Camera()
    for _ in range(3):
        camera.sends(way_s=0.01)
    picture = camera.pictures.take("first_person")
    assert picture is not None
    assert picture.captured_s == pytest.approx(10.0 - 0.02 - UNBOUNDED_S)
    assert camera.answers == []
    assert len([note for note in camera.notes if "not bounded" in note]) == 1


def test_an_echo_bounds_the_age_and_a_queue_before_the_robot_side_counts() -> None:
    camera = Camera()
    camera._sent.append((b"eye", _asking(camera), camera.now_s))
    camera.update()
    [answer] = camera.answers
    assert answer == {"version": 1, "sent_s": camera.now_s}
    camera.now_s += 0.1
    # Read 3 ms after it left, echoed 95 ms later, and 2 ms on the way.
    camera.sends(way_s=0.002, echo_s=answer["sent_s"], held_s=0.095)
    picture = camera.pictures.take("first_person")
    assert picture is not None
    true_s = camera.now_s - 0.002 - 0.02
    assert true_s - 0.0035 < picture.captured_s <= true_s
    camera.now_s += 0.3
    camera.sends(way_s=0.25, echo_s=answer["sent_s"], held_s=0.095 + 0.05)
    picture = camera.pictures.take("first_person")
    assert picture is not None
    true_s = camera.now_s - 0.25 - 0.02
    assert true_s - 0.004 < picture.captured_s <= true_s


def _asking(camera: Camera) -> bytes:
    """Return a picture whose sender wants answers, and has read none."""
    camera.sequence += 1
    sent_s = camera.now_s + AHEAD_S
    message = {"version": 1, "sequence": 1, "sent_s": sent_s, "taken_s": sent_s, "echo_s": None, "view": "first_person"}
    packed: bytes = msgpack.packb(message | {"width": 640, "height": 480, "format": "jpeg", "bytes": JPEG})
    return packed


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"version": 2}, "version 2; valid: 1"),
        ({"sequence": 1}, "sequence = 1; valid: above that of the picture before, 1"),
        ({"peer": b"second"}, "another camera sends first_person, too; valid: one at a time"),
        ({"view": "wrist"}, "view"),
        ({"width": 100_000, "height": 100_000}, "<= 1920"),
        ({"width": 8}, ">= 16"),
        ({"format": "png"}, "format"),
        ({"format": "rgb8", "bytes": bytes(921_599)}, "bytes has 921599 bytes; valid: 921600"),
        ({"bytes": b"GIF89a"}, "bytes begins with '474946'; valid: 'ffd8ff'"),
        ({"bytes": b""}, "bytes begins with ''"),
        ({"bytes": None}, "`bytes`"),
        ({"sent_s": float("nan")}, "sent_s"),
        ({"exposed_s": -1.0}, "taken_s = "),
        ({"intrinsics": {"fx": 0.0, "fy": 1.0, "cx": 1.0, "cy": 1.0}}, "fx"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_what_cannot_be_is_refused_counted_and_told_once(fields: dict[str, Any], says: str) -> None:
    camera = Camera()
    camera.sends()
    camera.pictures.take("first_person")
    for _ in range(3):
        camera.sends(**fields)
    assert not camera.pictures.fresh("first_person")
    assert sum(camera.pictures.senders.rejected.values()) == 3
    assert len([note for note in camera.notes if says in note]) == 1
    assert len(camera.answers) == 1
    assert says in camera.answers[0]["refused"]
    camera.sends()
    assert camera.pictures.fresh("first_person")


def test_what_cannot_be_decoded_is_refused_by_its_view() -> None:
    camera = Camera()
    camera.sends()
    camera.pictures.take("first_person")
    camera.pictures.refuse("first_person", "the bytes are no whole JPEG", camera.now_s)
    assert camera.pictures.senders.summary() == {"accepted": 1, "undecodable": 1}
    assert camera.answers == [{"version": 1, "refused": "first_person: the bytes are no whole JPEG"}]


def test_a_jump_of_the_senders_clock_costs_one_picture() -> None:
    camera = Camera()
    camera._sent.append((b"eye", _asking(camera), camera.now_s))
    camera.update()
    camera.sends(echo_s=camera.answers[0]["sent_s"])
    camera.sends(sent_s=5000.0, taken_s=5000.0)
    assert camera.pictures.senders.summary() == {"accepted": 2, "clock": 1}
    camera.sends(sent_s=5000.0, taken_s=5000.0)
    assert camera.pictures.senders.summary() == {"accepted": 3, "clock": 1}


def test_a_silence_is_told_and_another_camera_may_take_the_place() -> None:
    camera = Camera()
    camera.sends()
    camera.now_s += SILENT_S + 0.1
    camera.update()
    assert "none of first_person has come for 1 s" in camera.notes[-1]
    assert camera.pictures.sends("first_person")
    camera.sends(peer=b"restarted", sequence=0)
    assert "those of first_person arrive again" in camera.notes[-1]
    assert camera.pictures.senders.summary() == {"accepted": 2}


@pytest.mark.parametrize(
    ("watched", "size", "asked"),
    [(True, 20_000, 56), (False, 20_000, 4), (True, PICTURE_LIMIT_BYTES, 15), (True, 0, 4)],
)
def test_pictures_are_asked_for_as_often_as_they_are_shown_and_large_ones_more_seldom(
    watched: bool, size: int, asked: int
) -> None:
    """Nothing comes without a request, and after 1 ms with one. Some 60 or 4 a second, or 16 MB; unanswered: again."""
    camera, before = Camera(), 0
    for _ in range(1000):
        camera.now_s += 0.001
        if size and camera.asked > before:
            before = camera.asked
            camera._sent.append((b"eye", bytes(size), camera.now_s))
        camera.update(watched=watched)
    assert camera.asked == pytest.approx(asked, abs=1)
