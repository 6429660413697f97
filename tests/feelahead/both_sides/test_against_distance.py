from pathlib import Path
from typing import Any

import numpy as np
import pytest

from feelahead.both_sides.against_distance import draw_courses, strength_against_distance
from feelahead.lab.approaches.frozen import SITE
from tests.helpers.repository import DATA

FAR_M, STEP_M = 0.12, 0.005


@pytest.mark.parametrize("law", ["swept", "paper"])
def test_the_strength_grows_towards_the_wall_and_begins_earlier_at_speed(law: str) -> None:
    place: dict[str, Any] = {"model": DATA / "wall.xml", "site": SITE, "farthest_m": FAR_M, "step_m": STEP_M}
    slow, fast = strength_against_distance(law, [0.06, 0.12], loop_age_s=0.1, **place)
    for course in (slow, fast):
        assert course.distance_m == pytest.approx(np.arange(FAR_M, -1e-9, -STEP_M))
        assert np.all(np.diff(course.strength) >= 0.0)
        assert course.strength[0] == 0.0
        assert course.strength[-1] > 0.0
    assert np.all(fast.strength >= slow.strength)
    assert fast.strength.sum() > slow.strength.sum()
    if law == "swept":
        # 60 mm/s: δ 6, reaction 18, D_σ 7 and the cover's 3 mm, and what the prediction misses.
        full_m = slow.distance_m[slow.strength == 8.0].max()
        assert 0.035 <= full_m <= 0.05


def test_a_picture_has_a_panel_for_each_place(tmp_path: Path) -> None:
    place: dict[str, Any] = {"site": SITE, "law_paper_share": 0.001}
    courses = {
        name: strength_against_distance(
            "paper", [0.1], loop_age_s=0.1, model=DATA / f"{name}.xml", farthest_m=0.02, step_m=0.01, **place
        )
        for name in ("wall", "ball")
    }
    draw_courses(courses, tmp_path / "two.svg")
    drawn = (tmp_path / "two.svg").read_text(encoding="utf-8")
    assert all(f"<!-- {text} -->" in drawn for text in ("wall", "ball", "paper (f = 0.001), 100 mm/s"))
