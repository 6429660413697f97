"""What the benchmark sets otherwise really is otherwise, and only for as long as it is asked for."""

from importlib import import_module
from typing import Any

import numpy as np
import pytest

import robot_side.ahead.turns
from feelahead.benchmarks.felt.hulls import Hulls
from feelahead.benchmarks.felt.ladders import MESHES, ladders
from feelahead.benchmarks.felt.recorded_ticks import record, scene_of, with_cover
from feelahead.benchmarks.felt.replay import replay
from feelahead.benchmarks.felt.turning import COVER_M, LateLaw, Turned, exchanged, turned
from feelahead.lab.approaches.approach import Approach
from feelahead.lab.approaches.frozen import SITE, frozen_scene
from robot_side.ahead.law import Law
from robot_side.ahead.swept_law import SweptLaw
from robot_side.objects.perceived import PerceivedObjects
from robot_side.simulation.scene import Scene
from tests.helpers.ahead.fields import along, ball_pose, look
from tests.helpers.ahead.situations import LIMITS, MOTION, at, moving, situation, uncertain, walls

AWAY_M = 0.05
SPEED_M_S = 0.2


def as_loaded(name: str) -> tuple[Scene, PerceivedObjects]:
    scene = scene_of(name)
    nowhere = np.zeros((len(scene.objects), 3))
    return scene, scene.primitives.place(0.0, scene.roles, nowhere, scene.data.geom_xpos, scene.data.geom_xmat)


def law(late_ticks: int) -> SweptLaw:
    return Turned(late_ticks=late_ticks).new_law(uncertain(), np.zeros(6), LIMITS, MOTION)


def first_felt(of: Law, appears: int, ticks: int = 60) -> int:
    """In which tick a wall is felt that appears in one."""
    for tick in range(ticks):
        asked = situation(at(0.0), walls(AWAY_M if tick >= appears else None))
        sensed = of.sense(asked, 1.0 + 0.001 * tick)
        if sensed.r2.fast_m[0] < sensed.horizon_m - 1e-9:
            return tick
    return ticks


@pytest.mark.parametrize("late_ticks", [1, 2, 4, 10])
@pytest.mark.parametrize("appears", [7, 13])
def test_a_look_that_is_late_is_felt_by_so_many_ticks_later(late_ticks: int, appears: int) -> None:
    assert first_felt(law(late_ticks), appears) == first_felt(law(0), appears) + late_ticks


def test_while_the_tool_moves_straight_on_a_late_look_is_felt_as_one_in_time() -> None:
    on_time, late = law(0), law(7)
    ways = []
    for tick in range(40):
        asked = situation(
            at(0.001 * tick * SPEED_M_S), walls(AWAY_M), joint_velocities_rad_s=moving(np.array([0.0, 0.0, SPEED_M_S]))
        )
        ways.append([one.sense(asked, 1.0 + 0.001 * tick).r2.fast_m for one in (on_time, late)])
    np.testing.assert_allclose(np.array(ways)[:, 0], np.array(ways)[:, 1], atol=1e-9)


def test_what_is_exchanged_comes_back_even_after_an_error() -> None:
    module = robot_side.ahead.turns
    before = module.FIELD_PERIOD_S
    with pytest.raises(ZeroDivisionError), exchanged(module.__name__, FIELD_PERIOD_S=0.0):
        _ = 1.0 / module.FIELD_PERIOD_S
    assert before == module.FIELD_PERIOD_S
    with pytest.raises(AttributeError, match="NO_SUCH_NAME"), exchanged(module.__name__, NO_SUCH_NAME=1.0):
        pass


def test_everything_is_set_while_it_is_asked_for() -> None:
    def now(module: str, name: str) -> Any:
        return getattr(import_module(module), name)

    def cover_m() -> Any:
        asked = Approach(frozen_scene("wall"), 2.0, SITE)
        return now("feelahead.lab.approaches.approach", "robot_settings")(asked).cover_m

    with turned(Turned(period_s=0.02, late_ticks=2, cover_m=0.008, nodes=3)):
        assert [now(f"robot_side.ahead.{name}", "FIELD_PERIOD_S") for name in ("swept_law", "turns")] == [0.02, 0.02]
        assert now("robot_side.ahead.ask", "NODES_PER_MARGIN") == 3
        made = now("robot_side.assembly", "SweptLaw")(uncertain(), np.zeros(6), LIMITS, MOTION)
        assert isinstance(made, LateLaw)
        assert cover_m() == 0.008
    assert now("robot_side.assembly", "SweptLaw") is SweptLaw
    assert cover_m() == COVER_M


def test_each_ladder_holds_the_look_ahead_as_it_is_and_ends_with_its_finest() -> None:
    for quick in (False, True):
        for knob, rung in ladders(quick=quick).items():
            assert sum(Turned(knob, how.value) == how for how in rung) == 1
            assert len(set(rung)) == len(rung)
        assert ladders(quick=quick)[MESHES][-1] == Turned(MESHES, "as meshes")


def test_the_hull_of_a_u_is_a_block() -> None:
    scene, seen = as_loaded("u_mesh")
    hulls = Hulls(scene, seen).of(seen)
    assert hulls.mesh_library is not None
    assert hulls.mesh_library.tables.volumes == pytest.approx([0.12 * 0.213 * 0.17])
    # From above, between the sides: the bottom is 150 mm farther than the hull's top.
    down = along(np.array([0.0, 0.0, -1.0]), reach_m=0.5)
    pose = ball_pose(tool_position_m=[0.45, 0.0, 0.4])
    apart = look(pose, seen, down).fast_m - look(pose, hulls, down).fast_m
    np.testing.assert_allclose(apart, 0.15, atol=1e-6)
    with pytest.raises(ValueError, match="nothing of meshes"):
        Hulls(*as_loaded("wall"))


@pytest.mark.long
def test_recorded_ticks_go_through_the_law_as_it_is_and_otherwise() -> None:
    recorded = record("wall", 2.0)
    assert len(recorded.ticks) == 2001
    fewer = with_cover(recorded, 0.008)
    for before, after in zip(recorded.ticks, fewer.ticks, strict=True):
        assert len(after.situation.pose.sphere_radii_m) == 52
        np.testing.assert_array_equal(after.situation.pose.tool_position_m, before.situation.pose.tool_position_m)
    plain, seldom, often, late, coarse = replay(
        recorded,
        [Turned(), Turned(period_s=0.02), Turned(period_s=0.0005), Turned(late_ticks=3), Turned(cover_m=0.008)],
        1,
    )
    looks = [one.looks_per_s for one in (plain, seldom, often, late)]
    assert looks == pytest.approx([200.0, 100.0, 2000.0, 200.0], rel=0.02)
    assert (plain.spheres, coarse.spheres) == (246, 52)
    felt = plain.ways_m[:, 0] < plain.horizon_m
    assert felt.sum() > 100
    for other in (seldom, often, late):
        assert np.abs(other.ways_m - plain.ways_m)[felt, 0].max() < 1e-4
    # Coarser spheres stand out farther.
    assert 1e-4 < np.abs(coarse.ways_m - plain.ways_m)[felt, 0].max() < 0.01
    assert (plain.took_us > 0.0).all()
