"""Objects that another process perceives and sends, in virtual time."""

import math
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import FeelaheadError
from common.roles import Role
from robot_side.drivers.remote import objects as objects_module
from robot_side.drivers.remote.objects import RemoteObjects
from robot_side.field.scratch import MOST_WORK
from robot_side.parts import build_parts
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from robot_side.viewing.perceived_shapes import PerceivedModel
from tests.robot_side.session_bench import QUICK, Bench

CUP: dict[str, Any] = {"name": "cup", "sphere": 0.05, "position_m": [0.5, 0.0, 0.1]}
CORNERS = [[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]]
TURNED = [math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
"""Quaternion of a rotation by a right angle about z"""


class Sender:
    """Stand-in for the process that perceives objects, and its connection to the robot side."""

    def __init__(self) -> None:
        self.now_s, self.sequence = 10.0, 0
        self.notes: list[str] = []
        self.answers: list[dict[str, Any]] = []
        self._sent: list[tuple[bytes, bytes, float]] = []
        self.objects = RemoteObjects(self, {"door": Role.IGNORED}, self.notes.append)

    def receive(self) -> list[tuple[bytes, bytes, float]]:
        sent, self._sent = self._sent, []
        return sent

    def send(self, peer: bytes, payload: bytes) -> bool:
        self.answers.append(msgpack.unpackb(payload))
        return bool(peer)

    def sends(self, *things: dict[str, Any], peer: bytes = b"eyes", **fields: Any) -> None:
        """Send a frame with these objects; `fields` replace the frame's own."""
        self.sequence += 1
        frame = {"version": 1, "sequence": self.sequence, "sent_s": 3.0, "taken_s": 2.98, "objects": things} | fields
        self._sent.append((peer, msgpack.packb(frame), self.now_s))

    def says(self, *things: dict[str, Any], **fields: Any) -> PerceivedObjects:
        """Send a frame; return what the robot side perceives."""
        self.sends(*things, **fields)
        self.objects.exchange(self.now_s)
        while self.objects.busy:
            self.objects.exchange(self.now_s)
        return self.objects.perceive(self.now_s)


def test_each_kind_is_where_it_is_said_to_be() -> None:
    place = {"position_m": [1.0, 2.0, 3.0], "quaternion": TURNED}
    frame = Sender().says(
        {"name": "target", "box": [0.1, 0.2, 0.3], "velocity_m_s": [0.1, 0.0, 0.0], **place},
        {"name": "table", "half_space": True, "position_m": [0.0, 0.0, -0.1]},
        {"name": "egg", "ellipsoid": [0.1, 0.2, 0.3], "role": "obstacle", **place},
        {"name": "wedge", "tetrahedra": CORNERS, **place},
        {"name": "door", "box": [1.0, 1.0, 1.0]},
        CUP,
    )
    assert frame.names == ("target", "table", "egg", "wedge", "door", "cup")
    assert [role.value for role in frame.roles] == ["target", "support", "obstacle", "obstacle", "ignored", "obstacle"]
    assert frame.time_s == pytest.approx(9.98)
    assert frame.box_object.tolist() == [0]  # An ignored object has no shape.
    assert frame.box_rotations[0, :, 0] == pytest.approx([0.0, 1.0, 0.0])
    assert (frame.half_space_normals[0], frame.half_space_offsets_m[0]) == (pytest.approx([0, 0, 1]), -0.1)
    assert frame.tetrahedron_vertices_m[0, 1] == pytest.approx([1.0, 2.1, 3.0])
    assert frame.sphere_centers_m[0] == pytest.approx([0.5, 0.0, 0.1])
    assert frame.velocities_m_s is not None
    assert frame.velocities_m_s[0] == pytest.approx([0.1, 0.0, 0.0])
    assert Surroundings().target(frame) == 0


def test_without_any_velocity_the_objects_velocities_are_unknown_and_not_zero() -> None:
    sender, moving = Sender(), {"name": "ball", "sphere": 0.02, "velocity_m_s": [0.0, 0.1, 0.0]}
    assert sender.says(CUP).velocities_m_s is None
    found = sender.says(CUP, moving).velocities_m_s
    assert found is not None
    np.testing.assert_array_equal(found, [[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]])


def test_a_mean_error_is_taken_off_and_a_spread_is_the_objects_own() -> None:
    sender = Sender()
    frame = sender.says(CUP | {"mean_m": [0.01, 0.0, 0.0], "sd_m": 0.005}, {"name": "lid", "sphere": 0.02})
    assert frame.sphere_centers_m[0] == pytest.approx([0.51, 0.0, 0.1])
    assert frame.sds_m is not None
    np.testing.assert_array_equal(frame.sds_m, [0.005, np.nan])
    assert sender.says(CUP).sds_m is None


def test_an_object_keeps_its_place_among_the_names_and_has_no_shape_while_it_is_gone() -> None:
    sender = Sender()
    sender.says(CUP, {"name": "ball", "sphere": 0.02})
    frame = sender.says({"name": "ball", "sphere": 0.02})
    assert (frame.names, frame.roles[0], frame.sphere_object.tolist()) == (("cup", "ball"), Role.IGNORED, [1])
    frame = sender.says({"name": "box", "box": [0.1, 0.1, 0.1]}, CUP)
    assert (frame.names, frame.sphere_object.tolist(), frame.box_object.tolist()) == (("cup", "ball", "box"), [0], [2])


def test_names_are_forgotten_when_they_have_been_gone_longest_and_there_is_no_room() -> None:
    with patch.object(objects_module, "MOST_OBJECTS", 512):
        sender = Sender()
    sender.says(CUP, {"name": "lid", "sphere": 0.02})
    sender.says({"name": "lid", "sphere": 0.02})
    for round_ in range(5):
        names = [f"{round_}.{k}" for k in range(510 if round_ == 0 else 511)]
        frame = sender.says({"name": "lid", "sphere": 0.02}, *({"name": name, "sphere": 0.1} for name in names))
        assert frame.names[1] == "lid"
        assert frame.names[0] == ("cup" if round_ == 0 else names[0] if round_ == 1 else frame.names[0])
        assert {frame.names[index] for index in frame.sphere_object.tolist()} == {"lid", *names}
        assert len(frame.names) == 512
    assert not sender.objects.rejected


@given(st.lists(st.sets(st.sampled_from("abcdefghij"), max_size=5), max_size=20))
def test_an_object_keeps_its_index_while_it_is_known_and_all_that_are_sent_are_there(frames: list[set[str]]) -> None:
    with patch.object(objects_module, "MOST_OBJECTS", 6):
        sender, before = Sender(), tuple[str, ...]()
        for names in frames:
            frame = sender.says(*({"name": name, "sphere": 0.1} for name in sorted(names)))
            assert sorted(frame.names[index] for index in frame.sphere_object.tolist()) == sorted(names)
            assert len(set(frame.names)) == len(frame.names) <= 6
            assert all(frame.names.index(name) == before.index(name) for name in set(before) & set(frame.names))
            # Nothing is forgotten before room is needed.
            assert set(before) <= set(frame.names) or len(frame.names) == 6
            before = frame.names
        assert not sender.objects.rejected


def test_a_role_is_changed_from_the_next_frame_on() -> None:
    sender = Sender()
    sender.says(CUP)
    sender.objects.set_role("cup", Role.TARGET)
    assert sender.says(CUP).roles == (Role.TARGET,)


@pytest.mark.parametrize(
    ("things", "fields", "says"),
    [
        ([CUP, CUP], {}, "'cup' occurs more than once; valid: once"),
        ([{"name": "cup"}], {}, "'cup' has 0 shapes; valid: exactly one of sphere, box"),
        ([CUP | {"box": [1, 1, 1]}], {}, "'cup' has 2 shapes"),
        (
            [CUP | {"quaternion": [1, 1, 0, 0]}],
            {},
            "quaternion = (1.0, 1.0, 0.0, 0.0); valid: a quaternion of length 1",
        ),
        ([CUP | {"position_m": [math.nan, 0, 0]}], {}, "position_m"),
        ([CUP | {"sphere": -1.0}], {}, "sphere"),
        ([CUP], {"taken_s": 4.0}, "taken_s = 4.0; valid: up to sent_s = 3.0"),
        ([CUP], {"taken_s": -1e15}, "taken_s"),
        ([CUP], {"version": 2}, "version 2; valid: 1"),
        ([CUP], {"sequence": 1}, "sequence = 1; valid: above"),
        ([CUP], {"peer": b"other"}, "a second perception"),
        ([{"name": f"n{k}", "sphere": 0.1} for k in range(4097)], {}, "Expected `array` of length <= 4096"),
        ([CUP | {"sd_m": -0.1}], {}, "objects[0]"),
        ([CUP | {"colour": "red"}], {}, "objects[0]"),
    ],
)
def test_what_cannot_be_is_rejected_whole_counted_and_told_once(
    things: list[dict[str, Any]], fields: dict[str, Any], says: str
) -> None:
    sender = Sender()
    before = sender.says({"name": "first", "sphere": 0.1})
    for _ in range(3):
        assert sender.says(*things, **fields) is before
    assert sum(sender.objects.rejected.values()) == 3
    assert len([note for note in sender.notes if says in note]) == 1
    assert says in sender.answers[0]["refused"]
    assert len(sender.answers) == 1


def test_a_silence_is_told_and_what_was_seen_last_holds_on() -> None:
    sender = Sender()
    frame = sender.says(CUP)
    sender.now_s += 0.6
    assert sender.objects.perceive(sender.now_s) is frame
    assert "the newest frame is 0.6 s old" in sender.notes[-1]
    sender.says(CUP, peer=b"restarted", sequence=0)
    assert "arrive again" in sender.notes[-1]


def test_nothing_is_perceived_before_the_first_frame() -> None:
    with pytest.raises(FeelaheadError, match="no objects"):
        Sender().objects.perceive(0.0)


def test_what_is_drawn_follows_the_frames(scene: Any) -> None:
    sender, model = Sender(), PerceivedModel(scene)
    assert model.update(sender.says(CUP, {"name": "wedge", "tetrahedra": CORNERS, "quaternion": TURNED}))
    assert not model.update(sender.says(CUP | {"position_m": [0, 0, 0]}, {"name": "wedge", "tetrahedra": CORNERS}))
    assert model.objects == ("cup", "wedge")
    (ball,), (wedge,) = model.object_shapes(0), model.object_shapes(1)
    assert (ball.kind, ball.size_m) == ("sphere", (0.05, 0.0, 0.0))
    corners = np.frombuffer(wedge.vertices_m, "<f4").reshape(-1, 3)
    assert corners == pytest.approx(np.array(CORNERS[0]))
    first, second, third = corners[np.frombuffer(wedge.triangles, "<u4").reshape(-1, 3)].swapaxes(0, 1)
    outward = np.einsum("ti,ti->t", np.cross(second - first, third - first), first - corners.mean(axis=0))
    assert (outward > 0.0).all()
    assert model.update(sender.says({"name": "wedge", "tetrahedra": CORNERS}))
    assert list(model.object_shapes(0)) == []


@pytest.mark.parametrize("shape", ["box", "tetrahedra"])
def test_objects_that_all_overlap_the_gripper_cost_no_more_than_the_limit_and_that_is_said(shape: str) -> None:
    """Frames within the limits of the message, but of things that cannot be: turns stay short, and triggers stiff."""
    parts = build_parts(QUICK, 1, "clock")
    sender, rng = Sender(), np.random.default_rng(1)
    bench = Bench(parts=replace(parts, camera=sender.objects))
    place = {"position_m": [0.45, 0.0, 0.3]}
    sender.says({"name": "far", "sphere": 0.1, "position_m": [9.0, 0.0, 0.0]})
    operator = bench.join(2)
    bench.cruise(operator)
    assert bench.robot.status(bench.now_s).hindrance is None
    if shape == "box":
        things = [{"name": f"b{k}", "box": rng.uniform(0.1, 0.3, 3).tolist(), **place} for k in range(500)]
    else:
        corners = rng.uniform(-0.3, 0.3, (5, 1024, 4, 3)).tolist()
        things = [{"name": f"t{k}", "tetrahedra": corners[k], **place} for k in range(5)]
    sender.says(*things)
    bench.drive(0.02, operator, r2=0.4)
    before = bench.robot.parts.law.summary()
    bench.drive(0.02, operator, r2=0.4)
    after = bench.robot.parts.law.summary()
    assert after["looks_cut"] > before["looks_cut"]
    looks = after["looks"] - before["looks"]
    assert sum(after[name] - before[name] for name in ("pairs_touching", "overlaps")) <= looks * (MOST_WORK + 2000)
    assert bench.state == "armed"
    assert "too many things overlap" in str(bench.robot.status(bench.now_s).hindrance)
    assert operator.updates[-1].r2.course_stiffness == 1.0
