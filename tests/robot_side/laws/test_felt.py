"""What holds of the looks of the last tenth of a second, against plain lists of them."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.reaction import HORIZON_S
from robot_side.arm.ability import Ability
from robot_side.laws.felt import (
    ACCELERATION,
    BEYOND_M,
    DISPLACEMENT,
    ENLARGEMENT,
    FULL_SPEED,
    HORIZON,
    OF_A_SIDE,
    OVERLAP,
    RUMBLE,
    SPEED,
    STIFFNESS,
    feel,
    room_to_feel,
)
from robot_side.laws.recent_looks import L2, R2, ROOM, STEADY_S, STICK, Looks
from tests.helpers.perceived_scenes import random_rotation


@dataclass
class Look:
    """One, as it was found."""

    place: int
    at_s: float
    direction: FloatArray
    tool_m: FloatArray
    ways_m: FloatArray
    able: Ability
    reach_m: float
    sigma_m: float
    overlap_m3: float

    def moved_m(self, tool_m: FloatArray) -> float:
        return float(self.direction @ (tool_m - self.tool_m))


class Kept:
    """The same as `Looks`, as plain lists."""

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

    def ways_m(self, side: int, tool_m: FloatArray) -> FloatArray:
        ways_m: FloatArray = np.min([one.ways_m - one.moved_m(tool_m) for one in self.sides[side]], axis=0)
        return ways_m


def random_look(rng: np.random.Generator, place: int, now_s: float) -> Look:
    direction = np.array([0.0, 0.0, 1.0]) + rng.choice([0.005, 0.1]) * rng.normal(size=3)
    ways_m = np.sort(rng.uniform(-0.01, 0.3, (2, 8)))
    ways_m[:, rng.integers(0, 9) :] = np.inf
    speed_m_s, acceleration_m_s2 = rng.uniform(0.1, 1.0, 2).tolist()
    able = Ability(speed_m_s, acceleration_m_s2, within_reach=True)
    direction /= np.linalg.norm(direction)
    return Look(place, now_s, direction, 0.01 * rng.normal(size=3), ways_m, able, *rng.uniform(0.1, 0.4, 3))


def looked(rng: np.random.Generator, *, stick: bool) -> tuple[Looks, Kept]:
    looks, kept, now_s = Looks(), Kept(), 0.0
    for _ in range(150):
        places = int(rng.integers(1, 10))
        for side in (R2, L2, STICK)[: 3 if stick else 2]:
            looks.look_from(side, max(places, 1))
            kept.sides[side] = [one for one in kept.sides[side] if one.place < places]
            for place in sorted({0, int(rng.integers(0, places))}):
                now_s += rng.uniform(0.0, 0.005)
                new = random_look(rng, place, now_s)
                kept.add(side, new)
                where = new.direction, new.tool_m, new.ways_m
                looks.add(side, place, now_s, *where, new.able, new.reach_m, new.sigma_m, new.overlap_m3)
    return looks, kept


@settings(derandomize=True, deadline=None, max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), known=st.booleans(), stick=st.booleans())
def test_the_shortest_ways_hold_less_what_the_tool_has_moved(seed: int, known: bool, stick: bool) -> None:
    rng = np.random.default_rng(seed)
    looks, kept = looked(rng, stick=stick)
    assert looks.counts.tolist() == [len(side) for side in kept.sides]
    tool_m, rotation = 0.01 * rng.normal(size=3), random_rotation(rng)
    jacobian, rates = rng.normal(size=(6, 6)), 0.1 * rng.normal(size=6)
    loop_s, stick_m_s, touch_m_s, felt = (
        float(rng.uniform(0.0, 0.3)),
        float(rng.uniform(0.0, 0.1)),
        0.05,
        room_to_feel(),
    )
    motion = jacobian, rates, loop_s, known, stick_m_s, touch_m_s
    feel(looks.seen, looks.counts, looks.newest, tool_m, rotation, *motion, felt)

    velocity = jacobian[:3] @ rates
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
    for side, sign in ((R2, 1.0), (L2, -1.0)):
        mine, able = felt[side * OF_A_SIDE :][:OF_A_SIDE], newest[side].able
        ways_m = np.clip(kept.ways_m(side, tool_m), -100.0, horizon_m)
        np.testing.assert_allclose(mine[:16].reshape(2, 8), ways_m, atol=1e-12)
        under_way = sign * speed_m_s if known else max(sign * speed_m_s, able.full_speed_m_s)
        assert mine[DISPLACEMENT] == pytest.approx(under_way * loop_s, abs=1e-12)
        assert mine[STIFFNESS] == np.count_nonzero(ways_m[0] <= under_way * loop_s) / 8
        assert (mine[FULL_SPEED], mine[ACCELERATION]) == (able.full_speed_m_s, able.acceleration_m_s2)
    reach_m = stick_m_s * (loop_s + HORIZON_S)
    if stick:
        reach_m += stick_m_s**2 / (2.0 * kept.newest(STICK).able.acceleration_m_s2)
        ways_m = kept.ways_m(STICK, tool_m)[int(stick_m_s < touch_m_s)]
        assert felt[RUMBLE] == np.count_nonzero(ways_m <= reach_m) / 8
    else:
        assert felt[RUMBLE] == 0.0


def test_a_tool_that_is_nowhere_is_said_to_be_no_number() -> None:
    looks, _ = looked(np.random.default_rng(1), stick=False)
    felt = room_to_feel()
    nowhere = np.array([0.0, np.nan, 0.0])
    feel(
        *(looks.seen, looks.counts, looks.newest),
        nowhere,
        np.eye(3),
        np.zeros((6, 6)),
        np.zeros(6),
        0.1,
        True,
        0.0,
        0.0,
        felt,
    )
    assert np.isnan(felt[:16]).all()


def test_more_looks_than_there_is_room_for_cost_the_oldest() -> None:
    looks, rng = Looks(), np.random.default_rng(2)
    looks.look_from(R2, 1)
    new = random_look(rng, 0, 0.0)
    for number in range(2 * ROOM):
        where = new.direction, new.tool_m, np.full((2, 8), 1.0 + number)
        looks.add(R2, 0, 1e-6 * number, *where, new.able, new.reach_m, new.sigma_m, new.overlap_m3)
    assert looks.counts.tolist() == [ROOM, 0, 0]
    assert sorted(looks.seen["ways"][:ROOM, 0, 0]) == [1.0 + number for number in range(ROOM, 2 * ROOM)]
