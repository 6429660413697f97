"""Pieces of one surface are one object of the law."""

from dataclasses import replace

import numpy as np
import pytest

from common.arrays import FloatArray, IntArray
from common.roles import Role
from feelahead.lab.reference.onsets_by_definition import defined_onsets
from feelahead.lab.tiles import Boxes, Tiling, flat, tiled
from robot_side.arm.port import GripperPose
from robot_side.field.along import Along
from robot_side.field.field import Ahead
from robot_side.field.object_class import OBSTACLE, TARGET
from robot_side.recording.frames import FramePacker, FrameUnpacker
from robot_side.surroundings.movers import Movers
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from tests.helpers.field.fields import ball_pose

X = np.array([1.0, 0.0, 0.0])
LEANING = np.array([-np.cos(0.6), 0.0, np.sin(0.6)])
MIDDLE_M = np.array([0.06, 0.0, 0.0])
LATE_M = 1e-4


def _wall(tiling: Tiling, seed: int = 0) -> Boxes:
    return tiled(MIDDLE_M, LEANING, (0.08, 0.08), tiling, seed)


def _surface(boxes: Boxes) -> PerceivedObjects:
    return replace(boxes.objects(), surfaces=np.zeros(len(boxes.centers_m), dtype=np.int64))


def _one_object(boxes: Boxes) -> PerceivedObjects:
    owners = np.zeros(len(boxes.centers_m), dtype=np.int64)
    return replace(boxes.objects(), names=("wall",), roles=(Role.OBSTACLE,), box_object=owners)


def _fast_m(
    seen: PerceivedObjects, pose: GripperPose, classes: IntArray | None = None, of_objects: FloatArray | None = None
) -> FloatArray:
    classes = np.full(len(seen.names), OBSTACLE, dtype=np.int64) if classes is None else classes
    variance_m2 = 1e-6 if of_objects is None else float(of_objects[:, 1].max())
    along = Along(X, 0.0, variance_m2, 2.3, 0.2, of_objects=of_objects)
    return Ahead(np.zeros(6)).look(pose, Surroundings().see(seen), classes, along).fast_m


@pytest.mark.parametrize("tile_m", [0.01, 0.02])
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("its_class", [OBSTACLE, TARGET])
def test_a_surface_has_the_field_of_one_object_and_that_of_the_definition(
    tile_m: float, seed: int, its_class: int
) -> None:
    boxes, pose, along = _wall(Tiling(tile_m, 1e-3, 1e-3), seed), ball_pose(), Along(X, 0.0, 1e-6, 2.3, 0.2)
    seen, ahead = _surface(boxes), Ahead(np.zeros(6))
    classes = np.full(len(seen.names), its_class, dtype=np.int64)
    found = ahead.look(pose, Surroundings().see(seen), classes, along).onsets_m.copy()
    one = ahead.look(pose, Surroundings().see(_one_object(boxes)), classes[:1], along).onsets_m
    np.testing.assert_allclose(found, one, rtol=0.0, atol=LATE_M)
    defined = defined_onsets(pose, seen, classes, along, np.inf, np.zeros(6))
    np.testing.assert_allclose(found, defined.onsets_m[0], rtol=0.0, atol=LATE_M)


def test_tiles_of_a_surface_are_felt_as_the_whole_wall_and_objects_of_their_own_too_early() -> None:
    boxes, pose = _wall(Tiling(0.01)), ball_pose()
    whole_m = _fast_m(flat(MIDDLE_M, LEANING, (0.08, 0.08)).objects(), pose)
    np.testing.assert_allclose(_fast_m(_surface(boxes), pose), whole_m, rtol=0.0, atol=LATE_M)
    assert _fast_m(boxes.objects(), pose)[-1] < whole_m[-1] - 1e-3


def test_the_largest_errors_of_the_pieces_count_for_the_surface() -> None:
    boxes, pose = _wall(Tiling(0.02)), ball_pose()
    count = len(boxes.centers_m)
    one, all_of_them = np.tile([0.0, 1e-6], (count, 1)), np.tile([0.0, 9e-6], (count, 1))
    one[len(one) // 2] = 0.0, 9e-6
    assert (_fast_m(_surface(boxes), pose, None, one) == _fast_m(_surface(boxes), pose, None, all_of_them)).all()


def test_the_order_of_blocks_does_not_count() -> None:
    boxes, pose, rng = _wall(Tiling(0.01, 1e-3, 1e-3)), ball_pose(), np.random.default_rng(3)
    seen = _surface(boxes)
    parked = replace(seen, box_centers_m=rng.permutation(seen.box_centers_m))
    movers, surroundings = Movers(parked, np.arange(len(seen.names))), Surroundings()
    surroundings.see(parked)
    frame = movers.frame(1.0, movers.numbers_in(seen), seen.roles, surfaces=seen.surfaces)
    classes, along = np.full(len(seen.names), OBSTACLE, dtype=np.int64), Along(X, 0.0, 1e-6, 2.3, 0.2)
    assert (Ahead(np.zeros(6)).look(pose, surroundings.see(frame), classes, along).fast_m == _fast_m(seen, pose)).all()


def test_surfaces_change_from_frame_to_frame_of_movers() -> None:
    boxes, pose = _wall(Tiling(0.01)), ball_pose()
    first, whole = boxes.objects(), np.zeros(len(boxes.centers_m), dtype=np.int64)
    movers, surroundings = Movers(first, np.arange(3)), Surroundings()
    classes, along, ahead = np.zeros_like(whole), Along(X, 0.0, 1e-6, 2.3, 0.2), Ahead(np.zeros(6))
    found = []
    for surfaces in (None, whole, None):
        frame = movers.frame(1.0, movers.at_first, first.roles, surfaces=surfaces)
        found.append(ahead.look(pose, surroundings.see(frame), classes, along).fast_m)
    assert (found[0] == found[2]).all()
    assert (found[1] == _fast_m(_surface(boxes), pose)).all()


def test_recorded_surfaces_are_read_back() -> None:
    seen, packer = _surface(_wall(Tiling(0.02))), FramePacker()
    unpacker = FrameUnpacker(seen)
    assert seen.surfaces is not None
    for surfaces in (seen.surfaces, np.flip(np.arange(len(seen.names)) - 1), None):
        read = unpacker.unpack(packer.pack(replace(seen, surfaces=surfaces)))
        np.testing.assert_array_equal(read.surfaces, surfaces)


@pytest.mark.parametrize("surfaces", [np.zeros(3, dtype=np.int64), np.full(16, 16), np.full(16, -2), np.zeros(16)])
def test_invalid_surfaces_are_refused(surfaces: IntArray) -> None:
    seen = replace(_wall(Tiling(0.02)).objects(), surfaces=surfaces)
    with pytest.raises(ValueError, match=r"objects\.surfaces holds .*; valid: int64, from -1 to 15 for each of 16"):
        Surroundings().see(seen)
