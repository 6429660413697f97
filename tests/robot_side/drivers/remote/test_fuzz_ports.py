"""Whatever bytes come at the drivers' ports: each message is valid, or refused in one line and without effect."""

import math
import tracemalloc
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.depth import RemoteDepth
from robot_side.drivers.remote.objects import RemoteObjects
from robot_side.drivers.remote.pictures import RemotePictures
from robot_side.surroundings.validity import require_valid
from tests.helpers.hostile.spoiled import spoiled
from tests.robot_side.drivers.remote.driver_desk import SHAPE

LONGEST_LINE: Final = 1500
"""In characters: a name of 100 that cannot be printed has ten for each of them"""
MOST_BYTES: Final = 2_000_000
AHEAD_S: Final = 100.0
"""Sender's clock minus ours"""
BY_DESIGN: Final = {"clock", "impossible"}
"""Reasons after which more changes than counts: another clock counts from then on, and the arm's states are doubted"""
CORNERS: Final = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
FACES: Final = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
INTRINSICS: Final = {"fx": 15.0, "fy": 16.0, "cx": 10.0, "cy": 8.0}


class Port:
    """Receiver of one port, and its connection, in virtual time."""

    fields: Mapping[str, Any]
    """Of a valid message, besides its numbers and times"""
    taken = "taken_s"

    def __init__(self) -> None:
        self.now_s = 10.0
        self.notes: list[str] = []
        self.answers: list[dict[str, Any]] = []
        self._sent: list[tuple[bytes, bytes, float]] = []

    def receive(self) -> list[tuple[bytes, bytes, float]]:
        sent, self._sent = self._sent, []
        return sent

    def send(self, peer: bytes, payload: bytes) -> bool:
        self.answers.append(msgpack.unpackb(payload))
        return bool(peer)

    def ask(self) -> bool:
        return True

    def valid(self, sequence: int) -> dict[str, Any]:
        sent_s = self.now_s + AHEAD_S
        echo_s = self.answers[0]["sent_s"] if self.answers else None
        times = {"sent_s": sent_s, self.taken: sent_s - 0.01, "echo_s": echo_s, "held_s": self.now_s - 10.0}
        return {"version": 1, "sequence": sequence, **times, **self.fields}

    def hears(self, payload: bytes, peer: bytes = b"known") -> None:
        self._sent.append((peer, payload, self.now_s))
        self.update()

    def update(self) -> None:
        raise NotImplementedError

    def counts(self) -> tuple[int, "Counter[Any]"]:
        """Return the number of accepted messages, and of rejected ones by reason."""
        raise NotImplementedError

    def found(self) -> list[Any]:
        """Require that what was taken is valid; return it for `np.testing`."""
        raise NotImplementedError


class ArmPort(Port):
    taken = "measured_s"
    fields: Mapping[str, Any] = {
        **{"joint_positions": [0.1, 0.2], "joint_velocities": [0.0, 0.0], "joint_loads": [1.0, 2.0]},
        **{
            "finger_positions": [0.02],
            "opening_m": 0.04,
            "holding": False,
            "condition": "ready",
            "condition_text": "-",
        },
        "limits": {"velocity_rad_s": [2.0, 2.0], "jerk_rad_s3": [50.0, 50.0], "latency_s": 0.01},
    }

    def __init__(self) -> None:
        super().__init__()
        self.arm = RemoteArm(self, SHAPE, lambda _: None, self.notes.append)

    def update(self) -> None:
        self.arm.begin(self.now_s)

    def counts(self) -> tuple[int, "Counter[Any]"]:
        return self.arm.session.accepted, self.arm.session.rejected

    def found(self) -> list[Any]:
        state = self.arm.state(self.now_s)
        for values, count in (
            *((state.joint_positions_rad, 2), (state.joint_velocities_rad_s, 2), (state.finger_positions, 1)),
            (np.zeros(2) if state.joint_loads_nm is None else state.joint_loads_nm, 2),
        ):
            assert values.shape == (count,)
            assert np.isfinite(values).all()
        assert -math.inf < state.time_s <= self.now_s
        return [vars(state)]


class ObjectsPort(Port):
    fields: Mapping[str, Any] = {
        "meshes": {"four": {"vertices": CORNERS, "triangles": FACES}},
        "objects": [
            {"name": "ball", "role": "target", "sphere": 0.05, "position_m": [0.5, 0.0, 0.1], "sd_m": 0.01},
            {"name": "box", "box": [0.1, 0.1, 0.1], "quaternion": [0.0, 1.0, 0.0, 0.0], "velocity_m_s": [1, 0, 0]},
            {"name": "egg", "ellipsoid": [0.1, 0.2, 0.1], "mean_m": [0.0, 0.0, 0.01]},
            {"name": "table", "half_space": True},
            {"name": "cut", "tetrahedra": [CORNERS]},
            {"name": "made", "mesh": "four"},
        ],
    }

    def __init__(self) -> None:
        super().__init__()
        self.objects = RemoteObjects(self, {}, self.notes.append, unseen_m_s=0.1)

    def update(self) -> None:
        self.objects.exchange(self.now_s)
        while self.objects.busy:
            self.objects.exchange(self.now_s)

    def counts(self) -> tuple[int, "Counter[Any]"]:
        return self.objects.accepted, self.objects.rejected

    def found(self) -> list[Any]:
        seen = self.objects.perceive(self.now_s)
        require_valid(seen)
        assert seen.positions_m is not None
        assert np.isfinite(seen.positions_m).all()
        assert -math.inf < seen.time_s <= self.now_s
        return [vars(replace(seen, mesh_library=None, mesh_index=np.empty(0, np.int64)))]


class DepthPort(Port):
    fields: Mapping[str, Any] = {
        **{"camera": "wrist", "width": 20, "height": 16, "depth": bytes(range(256)) + bytes(384)},
        **{"depth_unit_m": 0.001, "intrinsics": INTRINSICS, "labels": bytes(320), "roles": {1: "target"}},
        "mount": {"link": "hand", "position_m": [0.0, -0.05, 0.02], "quaternion": [0.0, 0.0, 0.0, 1.0]},
    }

    def __init__(self) -> None:
        super().__init__()
        self.depth = RemoteDepth(self, self.notes.append)

    def update(self) -> None:
        self.depth.update(self.now_s)

    def counts(self) -> tuple[int, "Counter[Any]"]:
        return self.depth.senders.accepted, self.depth.senders.rejected

    def found(self) -> list[Any]:
        every = [taken for camera in self.depth.update(self.now_s) if (taken := self.depth.take(camera)) is not None]
        for taken in every:
            picture = taken.picture
            assert np.isfinite(picture.depth_m).all()
            assert picture.labels is None or picture.labels.shape == picture.depth_m.shape
            assert -math.inf < picture.taken_s <= taken.latest_s <= self.now_s
        return [(vars(taken.picture), *taken[1:]) for taken in every]


class PicturesPort(Port):
    fields: Mapping[str, Any] = {
        **{"view": "overview", "width": 16, "height": 16, "format": "rgb8", "bytes": bytes(768)},
        "intrinsics": INTRINSICS,
    }

    def __init__(self) -> None:
        super().__init__()
        self.pictures = RemotePictures(self, self.notes.append)

    def update(self) -> None:
        self.pictures.update(self.now_s, watched=True)

    def counts(self) -> tuple[int, "Counter[Any]"]:
        return self.pictures.senders.accepted, self.pictures.senders.rejected

    def found(self) -> list[Any]:
        every = [self.pictures.take(view) for view in ("first_person", "overview")]
        for picture in filter(None, every):
            assert picture.format == "jpeg" or len(picture.content) == 3 * picture.width * picture.height
            assert -math.inf < picture.captured_s <= self.now_s
        return every


@pytest.mark.parametrize("kind", [ArmPort, ObjectsPort, DepthPort, PicturesPort])
@given(st.data())
@settings(max_examples=300)
def test_whatever_comes_is_valid_or_refused_in_one_line_and_without_effect(
    kind: type[Port], data: st.DataObject
) -> None:
    attacked, spared = kind(), kind()
    for port in (attacked, spared):
        for sequence in (1, 2):
            port.hears(msgpack.packb(port.valid(sequence)))
            port.now_s += 0.01
        port.found()
    accepted, rejected = attacked.counts()[0], attacked.counts()[1].copy()
    notes, answers = len(attacked.notes), len(attacked.answers)
    payload = data.draw(spoiled(attacked.valid(3)))
    peer = data.draw(st.sampled_from([b"known", b"known", b"known", b"stranger"]))
    tracemalloc.start()
    try:
        attacked.hears(payload, peer)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < MOST_BYTES
    assert all(0 < len(note) < LONGEST_LINE for note in attacked.notes[notes:])
    assert all(len(answer.get("refused", "")) < LONGEST_LINE for answer in attacked.answers[answers:])
    [why] = (attacked.counts()[1] - rejected) or [None]
    assert attacked.counts()[0] - accepted == (why is None)
    if why is None:
        attacked.found()
    elif why not in BY_DESIGN:
        np.testing.assert_equal(attacked.found(), spared.found())
        for port in (attacked, spared):
            port.now_s = 10.03
            port.hears(msgpack.packb(port.valid(4)))
        np.testing.assert_equal(attacked.found(), spared.found())
        assert attacked.counts()[0] == accepted + 1


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        *((kind, {"y" * 10_000: 1}) for kind in (ArmPort, ObjectsPort, DepthPort, PicturesPort)),
        (ObjectsPort, {"objects": [{"y" * 10_000: 1}]}),
        (ObjectsPort, {"meshes": {"four": {"y" * 10_000: 1}}}),
    ],
)
def test_a_refusal_quotes_no_whole_message(kind: type[Port], fields: dict[str, Any]) -> None:
    port = kind()
    port.hears(msgpack.packb(port.valid(1) | fields))
    [note], [answer] = port.notes[-1:], port.answers[-1:]
    assert "unknown field `yyy" in note
    assert len(note) < LONGEST_LINE
    assert len(answer["refused"]) < LONGEST_LINE
