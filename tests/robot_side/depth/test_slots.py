from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.roles import ROLES, Role
from robot_side.depth.boxes import Boxes
from robot_side.depth.slots import PIECES, SlotChanges, Slots
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings
from robot_side.surroundings.target import center_m

NEAR = np.zeros(3)


def _boxes(ids: list[int], seed: int = 0) -> Boxes:
    random, count = np.random.default_rng(seed), len(ids)
    return Boxes(
        ids=np.array(ids, dtype=np.int64),
        centers_m=random.uniform(-1.0, 1.0, (count, 3)),
        rotations=np.tile(np.eye(3), (count, 1, 1)),
        half_sizes_m=random.uniform(0.005, 0.1, (count, 3)),
        roles=random.choice([-1, 0, 2], count),
        sds_m=random.uniform(0.0, 0.01, count),
    )


def _frame(slots: Slots, changes: SlotChanges, time_s: float) -> PerceivedObjects:
    slots.apply(changes)
    return slots.frame(time_s, slots.sds_m)


def _without(boxes: Boxes, row: int) -> Boxes:
    return Boxes(**{name: np.delete(values, row, axis=0) for name, values in vars(boxes).items()})


def test_what_changed_makes_the_same_frame_on_the_other_side() -> None:
    here, there = Slots(64), Slots(64)
    boxes = _boxes([3, 5, 900])
    objects = _frame(there, here.update(boxes, NEAR), 1.5)
    assert objects.time_s == 1.5
    assert objects.names[:3] == ("target", "surface 1", "surface 2")
    np.testing.assert_array_equal(objects.box_centers_m[PIECES : PIECES + 3], boxes.centers_m)
    np.testing.assert_array_equal(objects.box_half_sizes_m[PIECES : PIECES + 3], boxes.half_sizes_m)
    np.testing.assert_array_equal(there.sds_m[PIECES : PIECES + 3], boxes.sds_m)
    wanted = [Role.OBSTACLE if role < 0 else ROLES[role] for role in boxes.roles]
    assert list(objects.roles[1:4]) == wanted


def test_only_changes_are_handed_on() -> None:
    slots, boxes = Slots(64), _boxes([3, 5, 900])
    assert slots.update(boxes, NEAR).slots.tolist() == [PIECES, PIECES + 1, PIECES + 2]
    assert slots.update(boxes, NEAR).slots.size == 0
    moved = replace(boxes, centers_m=boxes.centers_m + np.array([[0.0], [0.01], [0.0]]))
    assert slots.update(moved, NEAR).slots.tolist() == [PIECES + 1]


def test_a_box_keeps_its_slot_while_others_go() -> None:
    slots, boxes = Slots(64), _boxes([3, 5, 900])
    slots.update(boxes, NEAR)
    changes = slots.update(_without(boxes, 0), NEAR)
    assert changes.slots.tolist() == [PIECES]
    assert (changes.numbers[0, 12:] > 0.0).all()
    assert changes.numbers[0, 2] < -100.0


def test_the_nearest_win_and_the_rest_is_counted() -> None:
    slots, boxes = Slots(64), _boxes(list(range(100)))
    changes = slots.update(boxes, np.array([0.5, 0.5, 0.5]))
    assert (changes.crowded_out, len(changes.slots)) == (36, 64)
    away = np.abs(boxes.centers_m - 0.5) - boxes.half_sizes_m
    away_m = np.linalg.norm(np.maximum(away, 0.0), axis=1)
    held = (boxes.centers_m[:, None] == changes.numbers[None, :, :3]).all(axis=2).any(axis=1)
    assert away_m[held].max() <= away_m[~held].min()


def test_a_scene_takes_over_the_changes_without_being_built_anew() -> None:
    here, there, scene = Slots(64), Slots(64), Surroundings()
    scene.see(there.first)
    table = scene.see(_frame(there, here.update(_boxes([1, 2]), NEAR), 0.1))
    later = scene.see(_frame(there, here.update(_boxes([2, 7], seed=1), NEAR), 0.2))
    assert later is table


def test_pieces_of_the_target_are_one_object_and_return_when_it_is_none() -> None:
    here, there = Slots(64), Slots(64)
    boxes = _boxes([3, 5, 900])
    beside_m = boxes.centers_m[0] + np.array([[0.0] * 3, [0.9, 0.9, 0.9], [0.05, 0.0, 0.0]])
    boxes = replace(boxes, centers_m=beside_m, half_sizes_m=np.full((3, 3), 0.02))
    target = replace(boxes, roles=np.array([1, 0, 1]))
    objects = _frame(there, here.update(target, NEAR), 1.0)
    assert objects.roles[0] is Role.TARGET
    table = Surroundings().see(objects)
    middle_m = center_m(table, 0)
    assert np.linalg.norm(middle_m - boxes.centers_m[[0, 2]].mean(axis=0)) < 0.05
    np.testing.assert_array_equal(objects.box_centers_m[PIECES], boxes.centers_m[1])
    freed = _frame(there, here.update(replace(boxes, roles=np.array([0, 0, 0])), NEAR), 2.0)
    assert freed.roles[0] is Role.OBSTACLE
    assert (freed.box_centers_m[:PIECES, 2] < -100.0).all()
    assert np.count_nonzero(freed.box_centers_m[:, 2] > -100.0) == 3


def test_neighbours_with_fronts_in_one_plane_are_pieces_of_one_surface() -> None:
    here, there = Slots(64), Slots(64)
    places_m = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.001], [0.0, 0.1, 0.02], [0.5, 0.0, 0.0]])
    tiles = replace(
        _boxes([1, 2, 3, 4, 5]),
        centers_m=places_m,
        half_sizes_m=np.tile([0.05, 0.05, 0.01], (5, 1)),
        roles=np.full(5, -1),
    )
    surfaces = _frame(there, here.update(tiles, NEAR), 1.0).surfaces
    assert surfaces is not None
    # The first three are in one plane; the fourth is higher, and the fifth far away.
    assert surfaces[1:6].tolist() == [1, 1, 1, -1, -1]
    assert (np.delete(surfaces, slice(1, 4)) == -1).all()


def test_what_only_looks_like_a_part_of_the_target_is_an_obstacle() -> None:
    here, there = Slots(64), Slots(64)
    places_m = np.array([[0.0, 0.0, 0.0], [0.03, 0.0, 0.0], [0.2, 0.0, 0.0]])
    seen = replace(_boxes([1, 2, 3]), centers_m=places_m, half_sizes_m=np.full((3, 3), 0.01), roles=np.full(3, 1))
    objects = _frame(there, here.update(seen, NEAR), 1.0)
    np.testing.assert_array_equal(objects.box_centers_m[:2], places_m[:2])
    np.testing.assert_array_equal(objects.box_centers_m[PIECES], places_m[2])
    assert objects.roles[:2] == (Role.TARGET, Role.OBSTACLE)


def test_what_is_ignored_gets_no_slot() -> None:
    slots = Slots(64)
    assert slots.update(replace(_boxes([3, 5, 900]), roles=np.array([3, 3, 3])), NEAR).slots.size == 0


@given(st.lists(st.lists(st.integers(0, 40), unique=True, max_size=30), max_size=6))
def test_a_history_of_changes_is_as_good_as_all_at_once(history: list[list[int]]) -> None:
    here, there = Slots(64), Slots(64)
    objects, kept = there.first, dict[int, int]()
    for step, ids in enumerate(history):
        boxes = _boxes(sorted(ids), seed=step)
        objects = _frame(there, here.update(boxes, NEAR), float(step))
        rows = {number: int(np.flatnonzero((objects.box_centers_m == c).all(axis=1))[0])
                for number, c in zip(boxes.ids.tolist(), boxes.centers_m, strict=True)}  # fmt: skip
        assert all(rows[number] == kept[number] for number in rows.keys() & kept.keys())
        kept = rows
    afresh = _frame(Slots(64), here.whole(), 9.0)
    np.testing.assert_array_equal(afresh.box_centers_m, objects.box_centers_m)
    np.testing.assert_array_equal(afresh.box_rotations, objects.box_rotations)
    assert afresh.roles == objects.roles


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"slots": np.array([160])}, "slots = 160 to 160; valid: 0 to 159"),
        ({"roles": np.array([9])}, "roles = 9 to 9; valid: 0 to 3"),
        ({"planes": np.array([65])}, "planes = 65 to 65; valid: -1 to 64"),
        ({"numbers": np.zeros((1, 3))}, r"numbers has the shape \(1, 3\)"),
        ({"numbers": np.full((1, 15), np.nan)}, "numbers holds NaN"),
    ],
)
def test_wrong_changes_are_refused(changed: dict[str, Any], complaint: str) -> None:
    valid = SlotChanges(
        np.array([0]), np.ones((1, 15)), np.array([0]), np.zeros(1), np.zeros((1, 3)), np.array([-1]), 0
    )
    with pytest.raises(ValueError, match=complaint):
        Slots(64).apply(replace(valid, **changed))
