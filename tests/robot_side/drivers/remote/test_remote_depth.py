"""Depth pictures that a camera's process sends, in virtual time."""

from typing import Any

import msgpack
import numpy as np
import pytest

from common.roles import Role
from robot_side.drivers.remote.depth import RemoteDepth, TakenDepth
from robot_side.drivers.remote.sender_clock import UNBOUNDED_S
from robot_side.drivers.remote.senders import SILENT_S

AHEAD_S = 321.0
"""Sender's clock minus ours"""
WIDTH, HEIGHT = 20, 16
INTRINSICS = {"fx": 15.0, "fy": 16.0, "cx": 10.0, "cy": 8.0}
MOUNT = {"link": "hand", "position_m": [0.0, -0.05, 0.02], "quaternion": [0.0, 0.0, 0.0, 1.0]}


class Cameras:
    """Stand-in for the process that has the depth cameras, and its connection to the robot side."""

    def __init__(self) -> None:
        self.now_s, self.sequence = 10.0, 0
        self.notes: list[str] = []
        self.answers: list[dict[str, Any]] = []
        self._sent: list[tuple[bytes, bytes, float]] = []
        self.depth = RemoteDepth(self, self.notes.append)

    def receive(self) -> list[tuple[bytes, bytes, float]]:
        sent, self._sent = self._sent, []
        return sent

    def send(self, peer: bytes, payload: bytes) -> bool:
        self.answers.append(msgpack.unpackb(payload))
        return bool(peer)

    def sends(self, peer: bytes = b"eye", way_s: float = 0.0, exposed_s: float = 0.07, **fields: Any) -> None:
        """Send a picture that leaves `way_s` before now. `fields` replace those of the message; ... leaves one out."""
        self.sequence += 1
        sent_s = self.now_s - way_s + AHEAD_S
        message: dict[str, Any] = {"version": 1, "sequence": self.sequence, "sent_s": sent_s}
        message |= {"taken_s": sent_s - exposed_s, "camera": "wrist", "width": WIDTH, "height": HEIGHT}
        message |= {"depth": raw(1).tobytes(), "depth_unit_m": 0.001, "intrinsics": INTRINSICS} | fields
        whole = {name: value for name, value in message.items() if value is not ...}
        self._sent.append((peer, msgpack.packb(whole), self.now_s))
        self.depth.update(self.now_s)

    def take(self, camera: str = "wrist") -> TakenDepth:
        taken = self.depth.take(camera)
        assert taken is not None
        return taken


def raw(seed: int) -> "np.ndarray[tuple[int, int], np.dtype[np.uint16]]":
    return np.random.default_rng(seed).integers(0, 65536, (HEIGHT, WIDTH)).astype("<u2")


def test_the_newest_picture_of_each_camera_is_there_until_it_is_taken() -> None:
    cameras = Cameras()
    assert cameras.depth.take("wrist") is None
    cameras.sends()
    cameras.sends(depth=raw(2).tobytes(), depth_unit_m=0.0001)
    cameras.sends(peer=b"other", camera="fixed")
    assert cameras.depth.update(cameras.now_s) == ("wrist", "fixed")
    taken = cameras.take()
    assert taken.picture.depth_m == pytest.approx(1e-4 * raw(2), rel=1e-6)
    assert taken.picture.depth_m.dtype == np.float32
    assert (taken.picture.pinhole.fx, taken.picture.pinhole.cy) == (15.0, 8.0)
    assert taken.picture.labels is None
    assert taken.mount is None
    assert cameras.depth.take("wrist") is None
    assert cameras.take("fixed").picture.depth_m == pytest.approx(1e-3 * raw(1), rel=1e-6)
    assert cameras.depth.update(cameras.now_s) == ()
    assert cameras.depth.senders.summary() == {"accepted": 3}


def test_labels_roles_and_a_mount_arrive_as_they_were_sent() -> None:
    cameras = Cameras()
    labels = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH)).astype(np.uint8)
    cameras.sends(labels=labels.tobytes(), roles={1: "target", 255: "support"}, mount=MOUNT)
    taken = cameras.take()
    assert taken.picture.labels is not None
    assert np.array_equal(taken.picture.labels, labels)
    assert taken.picture.roles == {1: Role.TARGET, 255: Role.SUPPORT}
    assert taken.mount is not None
    assert (taken.mount.link, taken.mount.position_m) == ("hand", (0.0, -0.05, 0.02))
    # A half turn about the optical axis.
    assert taken.mount.quaternion == (0.0, 0.0, 0.0, 1.0)


def test_an_echo_bounds_the_age_from_both_sides() -> None:
    cameras = Cameras()
    cameras.sends(echo_s=None)
    taken = cameras.take()
    assert taken.latest_s == pytest.approx(cameras.now_s - 0.07)
    assert taken.picture.taken_s == pytest.approx(cameras.now_s - 0.07 - UNBOUNDED_S)
    [answer] = cameras.answers
    assert answer == {"version": 1, "sent_s": cameras.now_s}
    cameras.now_s += 0.1
    # Read 3 ms after it left, echoed 95 ms later, and 2 ms on the way.
    cameras.sends(way_s=0.002, echo_s=answer["sent_s"], held_s=0.095)
    taken = cameras.take()
    true_s = cameras.now_s - 0.002 - 0.07
    assert true_s - 0.0035 < taken.picture.taken_s <= true_s <= taken.latest_s < true_s + 0.0025
    assert cameras.notes == []


def test_without_an_echo_that_is_told_once() -> None:
    cameras = Cameras()
    for _ in range(3):
        cameras.sends()
    assert cameras.answers == []
    assert [note for note in cameras.notes if "the age of wrist is not bounded" in note] == cameras.notes
    assert len(cameras.notes) == 1


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"version": 2}, "version 2; valid: 1"),
        ({"sequence": 1}, "sequence = 1; valid: above that of the picture before, 1"),
        ({"peer": b"second"}, "another camera sends wrist, too; valid: one at a time"),
        ({"camera": ""}, "camera"),
        ({"width": 15}, ">= 16"),
        ({"depth": raw(1).tobytes()[:-1]}, "depth has 639 bytes; valid: 640, 2 for each of 20 x 16 pixels"),
        ({"depth": ...}, "`depth`"),
        ({"depth_unit_m": 0.0}, "depth_unit_m"),
        ({"depth_unit_m": ...}, "`depth_unit_m`"),
        ({"intrinsics": ...}, "`intrinsics`"),
        ({"intrinsics": INTRINSICS | {"fy": -1.0}}, "fy"),
        ({"labels": bytes(319)}, "labels has 319 bytes; valid: 320, 1 for each of 20 x 16 pixels"),
        ({"roles": {1: "target"}}, "roles is there without labels; valid: both, or none"),
        ({"labels": bytes(320), "roles": {0: "target"}}, "roles"),
        ({"labels": bytes(320), "roles": {1: "friend"}}, "friend"),
        ({"mount": MOUNT | {"quaternion": [1.0, 1.0, 0.0, 0.0]}}, "mount: quaternion = (1.0, 1.0, 0.0, 0.0); valid"),
        ({"mount": {"link": "hand"}}, "position_m"),
        ({"taken_s": float("nan")}, "taken_s"),
        ({"exposed_s": -1.0}, "taken_s = "),
        ({"colour": "red"}, "colour"),
    ],
)
def test_what_cannot_be_is_refused_counted_told_once_and_answered(fields: dict[str, Any], says: str) -> None:
    cameras = Cameras()
    cameras.sends()
    cameras.take()
    for _ in range(3):
        cameras.sends(**fields)
    assert cameras.depth.take("wrist") is None
    assert sum(cameras.depth.senders.rejected.values()) == 3
    assert len([note for note in cameras.notes if says in note]) == 1
    assert len(cameras.answers) == 1
    assert says in cameras.answers[0]["refused"]
    cameras.sends()
    cameras.take()


def test_a_mount_on_no_link_of_ours_is_refused_by_its_camera() -> None:
    cameras = Cameras()
    cameras.sends(mount=MOUNT)
    cameras.take()
    cameras.depth.refuse("mount", "wrist", "link = 'hand'; valid: world, arm", cameras.now_s)
    assert cameras.depth.senders.summary() == {"accepted": 1, "mount": 1}
    assert cameras.answers == [{"version": 1, "refused": "wrist: link = 'hand'; valid: world, arm"}]


def test_a_jump_of_the_senders_clock_costs_one_picture() -> None:
    cameras = Cameras()
    cameras.sends(echo_s=None)
    cameras.sends(echo_s=cameras.answers[0]["sent_s"])
    for _ in range(2):
        cameras.sends(sent_s=5000.0, taken_s=5000.0)
    assert cameras.depth.senders.summary() == {"accepted": 3, "clock": 1}


def test_a_silence_is_told_for_each_camera_and_another_sender_may_take_the_place() -> None:
    cameras = Cameras()
    cameras.sends(camera="fixed")
    cameras.sends()
    cameras.now_s += SILENT_S + 0.1
    cameras.sends(camera="fixed")
    assert [note for note in cameras.notes if "none of wrist has come for 1 s" in note] == cameras.notes[-1:]
    cameras.sends(peer=b"restarted", sequence=0)
    cameras.depth.update(cameras.now_s)
    assert "those of wrist arrive again" in cameras.notes[-1]
    assert cameras.depth.senders.summary() == {"accepted": 4}
