"""Meshes that a perception process defines by name, once."""

from typing import Any

import numpy as np
import pytest

from robot_side.recording.frames import FramePacker, FrameUnpacker
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from tests.helpers.perceived_scenes import Scene
from tests.robot_side.drivers.remote.test_objects import CUP, Sender

CORNERS = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
WEDGE: dict[str, Any] = {"vertices": CORNERS, "triangles": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]}
ONE: dict[str, Any] = {"name": "one", "mesh": "wedge", "position_m": [0.5, 0.0, 0.1]}


def test_a_mesh_is_defined_once_and_then_poses_are_enough() -> None:
    sender, surroundings = Sender(), Surroundings()
    first = sender.says(ONE, CUP, meshes={"wedge": WEDGE})
    assert surroundings.see(first).object_volumes[0] == pytest.approx(1e-3 / 6.0)
    moved = sender.says(ONE | {"position_m": [0.6, 0.0, 0.1]}, ONE | {"name": "two"}, CUP)
    assert moved.mesh_library is first.mesh_library
    assert moved.names == ("one", "cup", "two")
    assert moved.mesh_object.tolist() == [0, 2]
    np.testing.assert_allclose(moved.mesh_positions_m[:, 0], [0.6, 0.5])
    assert not sender.objects.rejected


def test_a_mesh_that_is_defined_anew_changes_its_shape_and_others_keep_theirs() -> None:
    sender = Sender()
    large = WEDGE | {"vertices": (2.0 * np.array(CORNERS)).tolist()}
    sender.says(ONE, meshes={"other": WEDGE, "wedge": WEDGE})
    frame = sender.says(ONE, ONE | {"name": "two", "mesh": "other"}, meshes={"wedge": large})
    assert Surroundings().see(frame).object_volumes == pytest.approx([8e-3 / 6.0, 1e-3 / 6.0])


@pytest.mark.parametrize(
    ("meshes", "says"),
    [
        ({"wedge": WEDGE | {"triangles": WEDGE["triangles"][1:]}}, "meshes: 'wedge': "),
        ({"wedge": WEDGE | {"triangles": [one[::-1] for one in WEDGE["triangles"]]}}, "meshes: 'wedge': "),
        ({"wedge": WEDGE | {"triangles": [[0, 2, 9]]}}, "meshes: 'wedge': "),
        ({"wedge": {"vertices": CORNERS}}, "meshes: 'wedge': Object missing required field `triangles`"),
        ({"wedge": WEDGE | {"vertices": [[float("nan"), 0, 0]]}}, "meshes: 'wedge': "),
        ({}, "mesh = 'wedge' is not known; valid: a mesh that this frame or an earlier one defines in meshes"),
    ],
)
def test_a_bad_mesh_and_one_that_is_not_known_are_refused_by_name(meshes: dict[str, Any], says: str) -> None:
    sender = Sender()
    before = sender.says(CUP)
    assert sender.says(ONE, meshes=meshes) is before
    assert says in sender.answers[-1]["refused"]
    assert sender.answers[-1].get("unknown_meshes", []) == ([] if meshes else ["wedge"])
    assert sum(sender.objects.rejected.values()) == 1


def test_a_refused_frame_defines_no_mesh() -> None:
    sender = Sender()
    sender.says(CUP)
    sender.says(ONE, ONE, meshes={"wedge": WEDGE})
    sender.says(ONE)
    assert sender.objects.rejected == {"malformed": 1, "mesh": 1}


def test_a_frame_that_defines_meshes_is_not_overtaken() -> None:
    sender = Sender()
    sender.sends(ONE, meshes={"wedge": WEDGE})
    sender.sends(ONE)
    assert sender.says(ONE).names == ("one",)
    assert (sender.objects.accepted, sender.objects.rejected) == (2, {})


def same(one: PerceivedObjects, other: PerceivedObjects) -> bool:
    arrays = (
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=name == "sds_m")
        for name in ("mesh_index", "mesh_object", "mesh_positions_m", "sphere_centers_m", "sds_m")
        if getattr(one, name) is not None
    )
    return all(arrays) and (one.unseen_m, one.late_s, one.names) == (other.unseen_m, other.late_s, other.names)


def test_a_recording_holds_the_meshes_and_the_errors() -> None:
    sender, packer, unpacker = Sender(), FramePacker(), FrameUnpacker(Scene().objects())
    sizes = []
    for things, fields in (
        ([CUP], {}),
        ([ONE, CUP | {"sd_m": 0.01}], {"meshes": {"wedge": WEDGE}}),
        ([ONE | {"position_m": [0.6, 0.0, 0.1]}, CUP | {"sd_m": 0.01}], {}),
        ([ONE, CUP], {}),
    ):
        frame = sender.says(*things, **fields)
        content = packer.pack(frame)
        found = unpacker.unpack(content)
        assert same(frame, found)
        sizes.append(len(content))
        if frame.mesh_library is not None:
            assert found.mesh_library is not None
            for one, other in zip(frame.mesh_library.tables, found.mesh_library.tables, strict=True):
                np.testing.assert_array_equal(one, other)
    assert sizes[2] < sizes[1]
