"""What a law leaves out, counted by hand in a few ticks."""

from typing import Any

import numpy as np
import pytest

from common.protocol.around import PROBES
from common.skipped import Part, shares
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.field.fields import RADIUS_M, ball_pose
from tests.helpers.field.situations import moving, paper, situation, swept, walls
from tests.helpers.perceived_scenes import Scene

FAR_M = 20.0


def balls(*places_m: tuple[float, float, float]) -> PerceivedObjects:
    scene = Scene()
    for place_m in places_m:
        scene = scene.add().sphere(list(place_m), 0.02)
    return scene.objects()


def after(law: Any, ticks: int, objects: PerceivedObjects, step_s: float = 0.005, **changes: Any) -> dict[str, Part]:
    for tick in range(ticks):
        law.sense(situation(ball_pose(), objects, **changes), 7.0 + step_s * tick)
    found: dict[str, Part] = law.skipped()
    return found


AHEAD, BEHIND, BESIDE = (0.0, 0.0, 0.1), (0.0, 0.0, -0.1), (0.3, 0.0, 0.0)


@pytest.mark.parametrize(
    ("places_m", "entered"),
    [
        ([AHEAD, BEHIND, BESIDE], 2),  # R2 meets one, and L2 another.
        ([AHEAD, BESIDE, BESIDE], 1),
        ([BESIDE, (0.0, 0.0, FAR_M), (0.0, 0.0, -FAR_M)], 0),
        ([(0.0, 0.0, RADIUS_M), BESIDE, BESIDE], 2),  # What it overlaps it meets both ways, and once each.
    ],
)
def test_pairs_are_all_spheres_with_all_primitives_in_all_looks(places_m: list[Any], entered: int) -> None:
    # Looks along R2 and L2: one sphere with three primitives in each.
    assert after(swept(), 1, balls(*places_m))["pairs"] == Part(entered, 2 * 3)


def test_looks_at_rest_are_two_in_ten_ticks_and_along_a_stick_there_would_be_three_in_each() -> None:
    assert after(swept(), 21, walls(0.1))["looks"] == Part(3 * 2, 21 * 2)
    assert after(swept(), 4, walls(0.1), 0.004, lateral=(1.0, 0.0))["looks"] == Part(3, 4 * 3)


def test_looks_from_waypoints_and_probes_count_while_there_are_any() -> None:
    first = 2 + 2 * PROBES
    assert after(swept(maps=True), 3, walls(0.1), compensation="operator")["looks"] == Part(first, 3 * first)
    aside = moving(np.array([0.1, 0.0, 0.0]))
    law = swept()
    done, of = after(law, 1, walls(0.1), joint_velocities_rad_s=aside)["looks"]
    waypoints = sum(law.looking.sides[side].waypoints for side in (0, 1))
    assert done == of == 2 + waypoints
    assert waypoints > 4


def test_the_papers_law_looks_in_one_of_three_ticks_of_4_ms() -> None:
    assert after(paper(), 9, walls(0.1), 0.004) == {"looks": Part(3, 9)}


def test_of_what_has_no_whole_nothing_is_said() -> None:
    assert shares(looks=Part(1, 4), pairs=Part(0, 0)) == {"looks": {"done": 1, "of": 4, "skipped": 0.75}}
