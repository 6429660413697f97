from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.roles import ROLES, Role
from robot_side.depth.boxes import Boxes
from robot_side.depth.slots import SlotChanges, Slots
from robot_side.surroundings.surroundings import Surroundings

NEAR = np.zeros(3)


def _boxes(ids: list[int], seed: int = 0) -> Boxes:
    random, count = np.random.default_rng(seed), len(ids)
    return Boxes(
        ids=np.array(ids, dtype=np.int64),
        centers_m=random.uniform(-1.0, 1.0, (count, 3)),
        rotations=np.tile(np.eye(3), (count, 1, 1)),
        half_sizes_m=random.uniform(0.005, 0.1, (count, 3)),
        roles=random.integers(-1, 3, count),
        sds_m=random.uniform(0.0, 0.01, count),
    )


def _without(boxes: Boxes, row: int) -> Boxes:
    return Boxes(**{name: np.delete(values, row, axis=0) for name, values in vars(boxes).items()})


def test_what_changed_makes_the_same_frame_on_the_other_side() -> None:
    here, there = Slots(64), Slots(64)
    boxes = _boxes([3, 5, 900])
    objects = there.apply(here.update(boxes, NEAR), 1.5)
    assert objects.time_s == 1.5
    assert objects.names[:2] == ("surface 0", "surface 1")
    np.testing.assert_array_equal(objects.box_centers_m[:3], boxes.centers_m)
    np.testing.assert_array_equal(objects.box_half_sizes_m[:3], boxes.half_sizes_m)
    np.testing.assert_array_equal(there.sds_m[:3], boxes.sds_m)
    wanted = [Role.OBSTACLE if role < 0 else ROLES[role] for role in boxes.roles]
    assert list(objects.roles[:3]) == wanted


def test_only_changes_are_handed_on() -> None:
    slots, boxes = Slots(64), _boxes([3, 5, 900])
    assert slots.update(boxes, NEAR).slots.tolist() == [0, 1, 2]
    assert slots.update(boxes, NEAR).slots.size == 0
    moved = replace(boxes, centers_m=boxes.centers_m + np.array([[0.0], [0.01], [0.0]]))
    assert slots.update(moved, NEAR).slots.tolist() == [1]


def test_a_box_keeps_its_slot_while_others_go() -> None:
    slots, boxes = Slots(64), _boxes([3, 5, 900])
    slots.update(boxes, NEAR)
    changes = slots.update(_without(boxes, 0), NEAR)
    assert changes.slots.tolist() == [0]
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
    table = scene.see(there.apply(here.update(_boxes([1, 2]), NEAR), 0.1))
    later = scene.see(there.apply(here.update(_boxes([2, 7], seed=1), NEAR), 0.2))
    assert later is table


@given(st.lists(st.lists(st.integers(0, 40), unique=True, max_size=30), max_size=6))
def test_a_history_of_changes_is_as_good_as_all_at_once(history: list[list[int]]) -> None:
    here, there = Slots(64), Slots(64)
    objects, kept = there.first, dict[int, int]()
    for step, ids in enumerate(history):
        boxes = _boxes(sorted(ids), seed=step)
        objects = there.apply(here.update(boxes, NEAR), float(step))
        rows = {number: int(np.flatnonzero((objects.box_centers_m == c).all(axis=1))[0])
                for number, c in zip(boxes.ids.tolist(), boxes.centers_m, strict=True)}  # fmt: skip
        assert all(rows[number] == kept[number] for number in rows.keys() & kept.keys())
        kept = rows
    afresh = Slots(64).apply(here.whole(), 9.0)
    np.testing.assert_array_equal(afresh.box_centers_m, objects.box_centers_m)
    np.testing.assert_array_equal(afresh.box_rotations, objects.box_rotations)
    assert afresh.roles == objects.roles


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"slots": np.array([64])}, "slots = 64 to 64; valid: 0 to 63"),
        ({"roles": np.array([9])}, "roles = 9 to 9; valid: 0 to 3"),
        ({"numbers": np.zeros((1, 3))}, r"numbers has the shape \(1, 3\)"),
        ({"numbers": np.full((1, 15), np.nan)}, "numbers holds NaN"),
    ],
)
def test_wrong_changes_are_refused(changed: dict[str, Any], complaint: str) -> None:
    valid = SlotChanges(np.array([0]), np.ones((1, 15)), np.array([0]), np.zeros(1), 0)
    with pytest.raises(ValueError, match=complaint):
        Slots(64).apply(replace(valid, **changed), 0.0)
