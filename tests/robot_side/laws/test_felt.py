"""Onset distances kept from the looks of the last tenth of a second, against a memory of plain lists."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.reaction import HORIZON_S
from robot_side.arm.ability import Ability
from robot_side.laws.felt import felt_array
from robot_side.laws.memory import ROOM, Memory
from robot_side.laws.prospect import BEYOND_M
from robot_side.laws.recent_looks import STEADY_S
from robot_side.tick.sensed import (
    ACCELERATION,
    DISPLACEMENT,
    ENLARGEMENT,
    FULL_SPEED,
    HORIZON,
    L2,
    NUMBERS_PER_SIDE,
    OVERLAP,
    R2,
    RUMBLE,
    SPEED,
    STICK,
    STIFFNESS,
    TOOL_SPEED,
)
from tests.helpers.field.law_memory import feel, keep, look_from, memory
from tests.helpers.perceived_scenes import random_rotation


@dataclass
class Look:
    """Result of one look, for comparison."""

    place: int
    at_s: float
    direction: FloatArray
    tool_m: FloatArray
    onsets_m: FloatArray
    able: Ability
    reach_m: float
    sigma_m: float
    overlap_m3: float

    def moved_m(self, tool_m: FloatArray) -> float:
        return float(self.direction @ (tool_m - self.tool_m))


class Kept:
    """The law's memory of looks, as plain lists, for comparison."""

    def __init__(self) -> None:
        self.sides: list[list[Look]] = [[], [], []]

    def add(self, side: int, new: Look) -> None:
        self.sides[side] = [
            one
            for one in self.sides[side]
            if one.place != new.place or (new.at_s - one.at_s < STEADY_S and one.direction @ new.direction > 0.999)
        ]
        self.sides[side].append(new)

    def newest(self, side: int) -> Look:
        return [one for one in self.sides[side] if one.place == 0][-1]

    def onsets_m(self, side: int, tool_m: FloatArray) -> FloatArray:
        onsets_m: FloatArray = np.min([one.onsets_m - one.moved_m(tool_m) for one in self.sides[side]], axis=0)
        return onsets_m


def random_look(rng: np.random.Generator, place: int, now_s: float) -> Look:
    direction = np.array([0.0, 0.0, 1.0]) + rng.choice([0.005, 0.1]) * rng.normal(size=3)
    onsets_m = np.sort(rng.uniform(-0.01, 0.3, (2, 8)))
    onsets_m[:, rng.integers(0, 9) :] = np.inf
    speed_m_s, acceleration_m_s2 = rng.uniform(0.1, 1.0, 2).tolist()
    able = Ability(speed_m_s, acceleration_m_s2, within_reach=True)
    direction /= np.linalg.norm(direction)
    return Look(place, now_s, direction, 0.01 * rng.normal(size=3), onsets_m, able, *rng.uniform(0.1, 0.4, 3))


def note(found: Memory, side: int, new: Look) -> None:
    found.direction[:] = new.direction
    keep(found.bundle, side, new.place, new.at_s, new.tool_m, new.onsets_m)
    if new.place == 0:
        able = new.able.full_speed_m_s, new.able.acceleration_m_s2
        found.newest[side] = new.reach_m, *able, new.sigma_m, new.overlap_m3


def looked(rng: np.random.Generator, *, stick: bool) -> tuple[Memory, Kept]:
    found, kept, now_s = memory(), Kept(), 0.0
    for _ in range(150):
        places = int(rng.integers(1, 10))
        for side in (R2, L2, STICK)[: 3 if stick else 2]:
            look_from(found.bundle, side, places)
            kept.sides[side] = [one for one in kept.sides[side] if one.place < places]
            for place in sorted({0, int(rng.integers(0, places))}):
                now_s += rng.uniform(0.0, 0.005)
                new = random_look(rng, place, now_s)
                kept.add(side, new)
                note(found, side, new)
    return found, kept


@settings(derandomize=True, deadline=None, max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), known=st.booleans(), stick=st.booleans())
def test_the_shortest_ways_hold_less_what_the_tool_has_moved(seed: int, known: bool, stick: bool) -> None:
    rng = np.random.default_rng(seed)
    looks, kept = looked(rng, stick=stick)
    assert looks.counts.tolist() == [len(side) for side in kept.sides]
    tool_m, rotation = 0.01 * rng.normal(size=3), random_rotation(rng)
    loop_s, deflection, felt = float(rng.uniform(0.0, 0.3)), float(rng.uniform(0.0, 1.2)), felt_array()
    looks.settings["stick_speed"], looks.settings["touch_speed"], stick_m_s = 0.1, 0.05, 0.1 * min(deflection, 1.0)
    velocity = 0.1 * rng.normal(size=3)
    feel(looks.bundle, np.array([tool_m, rotation[:, 2], velocity]), loop_s, known, deflection, felt)

    speed_m_s = float(velocity @ rotation[:, 2])
    newest = [kept.newest(side) for side in (R2, L2)]
    stops_m = [
        one.able.full_speed_m_s * (loop_s + HORIZON_S)
        + one.able.full_speed_m_s**2 / (2.0 * one.able.acceleration_m_s2)
        + BEYOND_M
        for one in newest
    ]
    horizon_m = min(*stops_m, *(one.reach_m - one.moved_m(tool_m) for one in newest))
    assert felt[HORIZON] == pytest.approx(horizon_m, abs=1e-12)
    assert felt[SPEED] == pytest.approx(speed_m_s, abs=1e-12)
    leading = newest[0 if speed_m_s >= 0.0 else 1]
    assert felt[ENLARGEMENT] == pytest.approx(np.linalg.norm(velocity) * loop_s + leading.sigma_m, abs=1e-12)
    assert felt[OVERLAP] == leading.overlap_m3
    assert felt[TOOL_SPEED] == pytest.approx(np.linalg.norm(velocity), abs=1e-12)
    for side, sign in ((R2, 1.0), (L2, -1.0)):
        mine, able = felt[side * NUMBERS_PER_SIDE :][:NUMBERS_PER_SIDE], newest[side].able
        onsets_m = np.clip(kept.onsets_m(side, tool_m), -100.0, horizon_m)
        np.testing.assert_allclose(mine[:16].reshape(2, 8), onsets_m, atol=1e-12)
        under_way = sign * speed_m_s if known else max(sign * speed_m_s, able.full_speed_m_s)
        assert mine[DISPLACEMENT] == pytest.approx(under_way * loop_s, abs=1e-12)
        assert mine[STIFFNESS] == np.count_nonzero(onsets_m[0] <= under_way * loop_s) / 8
        assert (mine[FULL_SPEED], mine[ACCELERATION]) == (able.full_speed_m_s, able.acceleration_m_s2)
    reach_m = stick_m_s * (loop_s + HORIZON_S)
    if stick:
        reach_m += stick_m_s**2 / (2.0 * kept.newest(STICK).able.acceleration_m_s2)
        onsets_m = kept.onsets_m(STICK, tool_m)[int(stick_m_s < 0.05)]
        assert felt[RUMBLE] == np.count_nonzero(onsets_m <= reach_m) / 8
    else:
        assert felt[RUMBLE] == 0.0


def test_more_looks_than_there_is_room_for_cost_the_oldest() -> None:
    looks, new = memory(), random_look(np.random.default_rng(2), 0, 0.0)
    for number in range(2 * ROOM):
        note(looks, R2, replace(new, at_s=1e-6 * number, onsets_m=np.full((2, 8), 1.0 + number)))
    assert looks.counts.tolist() == [ROOM, 0, 0]
    assert sorted(looks.seen["onsets"][:ROOM, 0, 0]) == [1.0 + number for number in range(ROOM, 2 * ROOM)]
