"""Table of a frame of objects: one row for each primitive, grouped by object; made once; refused if invalid."""

import dataclasses
import weakref
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.roles import Role
from robot_side.overlap import Mesh
from robot_side.surroundings import surroundings as module
from robot_side.surroundings.blocks import TOGETHER
from robot_side.surroundings.movers import Movers
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.scene_table import SceneTable, make, scene_table
from robot_side.surroundings.surroundings import Surroundings
from robot_side.surroundings.target import object_centers
from robot_side.surroundings.validity import require_valid
from tests.helpers.field.fields import along, ball_pose, look
from tests.helpers.field.primitive_rows import object_bound, rows_of
from tests.helpers.meshes import CUBE_CORNERS, CUBE_TRIANGLES
from tests.helpers.perceived_scenes import Scene, random_rotation, random_scene


def mixed() -> PerceivedObjects:
    """Return objects with primitives of several kinds, so that primitives of one kind are not next to each other."""
    cube = Mesh(0.1 * CUBE_CORNERS, CUBE_TRIANGLES)
    scene = Scene().add().sphere([1.0, 0.0, 0.0], 0.1).box([1.0, 0.0, 0.2], [0.1, 0.2, 0.3]).mesh(cube, [1.0, 0.5, 0.0])
    scene.add(Role.IGNORED).add().half_space([0.0, 0.0, 1.0], -1.0)
    scene.add().box([2.0, 0.0, 0.0], [0.1, 0.1, 0.1]).sphere([2.0, 0.0, 0.3], 0.2)
    return scene.tetrahedron([[2.0, 0.0, 0.0], [2.1, 0.0, 0.0], [2.0, 0.1, 0.0], [2.0, 0.0, 0.3]]).objects()


def test_what_has_no_volume_is_left_out_and_counted() -> None:
    scene = Scene().add().sphere([0.0, 0.0, 0.02], 0.0).box([0.0, 0.0, 0.02], [0.1, 0.0, 0.1])
    scene.tetrahedron([[0.0, 0.0, 0.02], [0.1, 0.0, 0.02], [0.0, 0.1, 0.02], [0.1, 0.1, 0.02]])
    whole = scene_table(scene.objects())
    assert whole.flat == 3
    assert len(whole.kinds) == 0
    assert np.isinf(look(ball_pose(0.05), whole.objects, along()).fast_m).all()
    beside = scene_table(scene.sphere([0.0, 0.0, 0.1], 0.01).objects())
    assert beside.flat == 3
    assert beside.rows_of_kind.tolist() == [1]


def test_a_table_is_made_once_for_each_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[PerceivedObjects] = []

    def counting(objects: PerceivedObjects) -> None:
        seen.append(objects)
        require_valid(objects)

    monkeypatch.setattr(module, "require_valid", counting)
    first, second = (random_scene(np.random.default_rng(count), count) for count in (2, 8))
    seeing = Surroundings()
    tables = [seeing.see(objects) for objects in (first, first, second, first, second)]
    assert [objects is first for objects in seen] == [True, False]
    assert tables[0] is tables[1] is tables[3]
    assert tables[2] is tables[4]
    assert tables[2].objects is second


def moved(objects: PerceivedObjects, rng: np.random.Generator) -> PerceivedObjects:
    shift, turn = rng.normal(size=3), random_rotation(rng)
    return dataclasses.replace(
        objects,
        sphere_centers_m=objects.sphere_centers_m @ turn.T + shift,
        box_centers_m=objects.box_centers_m @ turn.T + shift,
        box_rotations=turn @ objects.box_rotations,
        tetrahedron_vertices_m=objects.tetrahedron_vertices_m @ turn.T + shift,
        half_space_normals=objects.half_space_normals @ turn.T,
        half_space_offsets_m=objects.half_space_offsets_m + 0.01,
        mesh_positions_m=objects.mesh_positions_m @ turn.T + shift,
        mesh_rotations=turn @ objects.mesh_rotations,
    )


def frame_of(movers: Movers, objects: PerceivedObjects) -> PerceivedObjects:
    return movers.frame(0.0, movers.numbers_in(objects), objects.roles)


def assert_as_defined(table: SceneTable, objects: PerceivedObjects) -> None:
    """Assert that the table has the rows that follow from the definitions of primitives and objects."""
    rows = rows_of(objects)
    of_thing = [[row for row in rows if row.thing == thing] for thing in range(len(objects.names))]
    same = partial(np.testing.assert_allclose, rtol=1e-12, atol=1e-12)
    assert [row.kind for row in rows] == table.kinds.tolist()
    assert [row.row_of_kind for row in rows] == table.rows_of_kind.tolist()
    assert np.diff(table.first_rows).tolist() == [len(mine) for mine in of_thing]
    same(table.bounds, np.reshape([row.bound for row in rows], (-1, 4)))
    same(table.shapes, np.reshape([row.shape for row in rows], (-1, 15)))
    same(table.object_bounds, np.reshape([object_bound(mine) for mine in of_thing], (-1, 4)))
    same(table.object_volumes, [sum(row.volume_m3 for row in mine) for mine in of_thing])
    if table.placed is not None:
        np.testing.assert_array_equal(table.placed.positions, objects.mesh_positions_m)
        np.testing.assert_array_equal(table.placed.rotations, objects.mesh_rotations)


def any_objects(seed: int) -> tuple[PerceivedObjects, np.random.Generator]:
    rng = np.random.default_rng(seed)
    return (mixed() if seed % 3 == 0 else random_scene(rng, 3, meshes=seed % 2)), rng


@settings(derandomize=True, deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_tables_of_a_frame_agree_with_the_definitions(seed: int) -> None:
    first, _ = any_objects(seed)
    assert_as_defined(make(first), first)


@settings(derandomize=True, deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32 - 1))
def test_what_is_new_since_an_earlier_frame_is_written_into_its_table_alone(seed: int) -> None:
    first, rng = any_objects(seed)
    some, others = (Movers(first, np.flatnonzero(rng.uniform(size=len(first.names)) < share)) for share in (0.5, 0.5))
    frames = [frame_of(movers, moved(first, rng)) for movers in (some, some, others)]
    seeing = Surroundings()
    table = seeing.see(first)
    kept = table.bounds
    for objects in (*frames, first, frames[0], first):
        assert seeing.see(objects) is table
        assert table.objects is objects
        assert_as_defined(table, objects)
        # To the bit: a recording holds the same frame whole.
        said_whole = make(dataclasses.replace(objects))
        for name in ("shapes", "bounds", "object_bounds", "object_volumes"):
            np.testing.assert_array_equal(getattr(table, name), getattr(said_whole, name))
        centers_m = object_centers(table)
        for thing in range(len(objects.names)):
            np.testing.assert_array_equal(seeing.center_m(objects, thing), centers_m[thing])
    assert table.bounds is kept


def test_a_frame_that_is_refused_changes_nothing() -> None:
    first = mixed()
    movers = Movers(first, np.array([0, 3]))
    good = moved(first, np.random.default_rng(1))
    frame = frame_of(movers, good)
    seeing = Surroundings()
    table = seeing.see(frame)
    bad = frame_of(movers, dataclasses.replace(good, box_rotations=1.1 * good.box_rotations))
    for _ in range(2):
        with pytest.raises(ValueError, match="box_rotations"):
            seeing.see(bad)
        assert_as_defined(table, frame)
    assert seeing.see(frame) is table


def test_what_loses_its_volume_has_a_table_of_its_own() -> None:
    first = mixed()
    movers = Movers(first, np.array([0, 3]))
    frame = frame_of(movers, first)
    seeing = Surroundings()
    table = seeing.see(frame)
    flat = dataclasses.replace(first, box_half_sizes_m=first.box_half_sizes_m * [0.0, 1.0, 1.0])
    without = frame_of(movers, flat)
    assert seeing.see(without).flat == 2
    assert_as_defined(seeing.see(without), without)
    assert_as_defined(table, frame)
    # Also where an object had no volume from the start.
    spread = Movers(dataclasses.replace(without), np.array([0, 3]))
    assert_as_defined(seeing.see(frame_of(spread, first)), frame)


@pytest.mark.parametrize("unbounded", [0, 3])
def test_blocks_bound_their_objects_wherever_these_go(unbounded: int) -> None:
    rng = np.random.default_rng(unbounded)
    scene = Scene()
    for _ in range(unbounded):
        scene.add().half_space([0.0, 0.0, 1.0], -1.0)
    for center in rng.uniform(-1.0, 1.0, (5000, 3)):
        scene.add().sphere(center, float(rng.uniform(0.001, 0.01)))
    first = scene.add(Role.IGNORED).objects()
    movers = Movers(first, np.sort(rng.choice(5000, 50, replace=False)))
    seeing = Surroundings()
    for objects in (first, frame_of(movers, moved(first, rng))):
        table = seeing.see(objects)
        blocks = table.blocks
        assert sorted(blocks.order) == list(range(5000 + unbounded))
        assert set(blocks.order[:unbounded]) == set(range(unbounded))
        np.testing.assert_array_equal(blocks.bounds, table.object_bounds[blocks.order])
        places = np.arange(len(blocks.order))
        for bounds, tuple_type in ((blocks.blocks, TOGETHER), (blocks.groups, TOGETHER**2)):
            assert len(bounds) == -(-len(places) // tuple_type)
            around = bounds[places // tuple_type]
            apart = np.linalg.norm(blocks.bounds[:, :3] - around[:, :3], axis=1) + blocks.bounds[:, 3]
            assert (apart <= around[:, 3] * (1.0 + 1e-12)).all()
        if objects is first:
            # Consecutive objects are near each other: a block of random ones would be 1.7 m large.
            assert np.median(blocks.blocks[:, 3]) < 0.7


def test_frames_do_not_pile_up() -> None:
    frames, seeing = [], Surroundings()
    for seed in range(100):
        objects = random_scene(np.random.default_rng(seed), 1)
        seeing.see(objects)
        frames.append(weakref.ref(objects))
    del objects
    # A tick in real time runs without Python's cyclic garbage collector.
    assert len([frame for frame in frames if frame() is not None]) <= 10
