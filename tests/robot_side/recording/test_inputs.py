"""Recorded arm states and frames of objects are read back bit for bit, also those stored as differences."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.roles import Role
from robot_side.arm.port import ArmState
from robot_side.recording.arm_states import pack_state, unpack_state
from robot_side.recording.frames import ARRAYS, FramePacker, FrameUnpacker
from robot_side.surroundings.perceived import PerceivedObjects, UnknownSpace

ANY_FLOAT = st.floats(width=64)
NAMES = ("table", "target", "post")


def same_bits(one: Any, other: Any) -> bool:
    if one is None or other is None:
        return one is other
    return bool(one.shape == other.shape and one.dtype == other.dtype and one.tobytes() == other.tobytes())


def same(one: PerceivedObjects, other: PerceivedObjects) -> bool:
    return (one.time_s, one.names, one.roles) == (other.time_s, other.names, other.roles) and all(
        same_bits(getattr(one, name), getattr(other, name)) for name in ARRAYS
    )


def frame(seed: int, counts: tuple[int, ...], time_s: float = 0.0) -> PerceivedObjects:
    generator = np.random.default_rng(seed)
    arrays: dict[str, Any] = {}
    for (name, (kind, shape)), count in zip(ARRAYS.items(), counts, strict=True):
        arrays[name] = (
            generator.normal(size=(count, *shape))
            if kind is np.float64
            else generator.integers(0, 3, (count, *shape), dtype=np.int64)
        )
    roles = tuple(generator.choice(np.array(Role), len(NAMES)).tolist())
    return PerceivedObjects(time_s=time_s, names=NAMES, roles=roles, **arrays)


COUNTS = st.tuples(*(st.integers(0, 5) for _ in ARRAYS))


def test_every_array_of_a_frame_is_recorded() -> None:
    # The core does not read `positions_m` and `rotations`, `since` repeats the arrays; errors are recorded if there.
    others = {
        "sds_m",
        "surfaces",
        "unknown",
        "unseen_m",
        "late_s",
        "time_s",
        "names",
        "roles",
        "mesh_library",
        "positions_m",
        "rotations",
        "since",
    }
    assert {field.name for field in fields(PerceivedObjects)} == {*ARRAYS, *others}


@given(
    st.lists(ANY_FLOAT, max_size=9),
    st.lists(ANY_FLOAT, max_size=3),
    ANY_FLOAT.filter(lambda value: value == value),  # noqa: PLR0124
    st.booleans(),
    st.booleans(),
)
def test_a_state_comes_back_bit_for_bit(
    joints: list[float], fingers: list[float], time_s: float, holding: bool, measures: bool
) -> None:
    values = np.array(joints)
    loads, simulated_s = (0.5 * values, 0.5 * time_s) if joints and measures else (None, None)
    doubt = "joint 1 (élbow)" if measures else None
    state = ArmState(time_s, values, -values, np.array(fingers), 0.1, holding, loads, simulated_s, doubt)
    found = unpack_state(pack_state(state))
    assert (found.time_s, found.gripper_opening_m, found.gripper_holding) == (time_s, 0.1, holding)
    assert found.doubt == doubt
    assert found.simulated_s == simulated_s
    for name in ("joint_positions_rad", "joint_velocities_rad_s", "finger_positions", "joint_loads_nm"):
        assert same_bits(getattr(found, name), getattr(state, name))


@given(st.lists(st.tuples(st.integers(0, 9), COUNTS), min_size=1, max_size=5))
def test_frames_come_back_bit_for_bit(frames: list[tuple[int, tuple[int, ...]]]) -> None:
    packer, unpacker = FramePacker(), FrameUnpacker(frame(0, (0,) * len(ARRAYS)))
    for number, (seed, counts) in enumerate(frames):
        one = frame(seed, counts, time_s=0.1 * number)
        assert same(unpacker.unpack(packer.pack(one)), one)


@given(st.integers(0, 4), st.sampled_from([np.nan, -0.0, np.inf, 5e-324]))
def test_one_row_that_moves_is_all_that_is_told(row: int, value: float) -> None:
    counts = (5,) * len(ARRAYS)
    packer, unpacker = FramePacker(), FrameUnpacker(frame(0, counts))
    before = frame(1, counts)
    whole = packer.pack(before)
    unpacker.unpack(whole)
    moved = before.box_centers_m.copy()
    moved[row, 1] = value
    after = replace(before, box_centers_m=moved, time_s=1.0)
    told = packer.pack(after)
    assert len(told) < len(whole) / 10
    assert same(unpacker.unpack(told), after)


def test_unknown_space_comes_and_goes() -> None:
    boxes_m = np.random.default_rng(5).normal(size=(4, 2, 3))
    packer, plain = FramePacker(), frame(2, (3,) * len(ARRAYS))
    unpacker = FrameUnpacker(plain)
    for shares, boxes in (((0.1, 0.2, 0.3, 0.4, 0.5), boxes_m), ((0.0,) * 5, boxes_m[1:]), ((1.0,) * 5, boxes_m[1:])):
        read = unpacker.unpack(packer.pack(replace(plain, unknown=UnknownSpace(*shares, boxes_m=boxes)))).unknown
        assert read is not None
        assert read.shares == shares
        assert same_bits(read.boxes_m, boxes)
    assert unpacker.unpack(packer.pack(plain)).unknown is None


def test_nobody_measures_velocities() -> None:
    one = replace(frame(2, (3,) * len(ARRAYS)), velocities_m_s=None)
    assert same(FrameUnpacker(one).unpack(FramePacker().pack(one)), one)


def test_after_a_gap_only_a_whole_frame_is_taken() -> None:
    one, packer = frame(3, (2,) * len(ARRAYS)), FramePacker()
    packer.pack(one)
    with pytest.raises(ValueError, match="no complete frame came before"):
        FrameUnpacker(one).unpack(packer.pack(one))
    packer.begin_epoch()
    assert same(FrameUnpacker(one).unpack(packer.pack(one)), one)


def test_frames_of_another_scene_are_refused() -> None:
    one = frame(4, (2,) * len(ARRAYS))
    with pytest.raises(ValueError, match="other objects"):
        FrameUnpacker(replace(one, names=("a", "b", "c"))).unpack(FramePacker().pack(one))
