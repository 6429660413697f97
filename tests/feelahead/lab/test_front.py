"""The front of the paper's law: its cells, the points of a table, and which f is chosen."""

import pytest

from feelahead.lab.questions.front import FrontSettings, Judging, Pull, best, cells, points, run
from feelahead.lab.table import Row, Table
from robot_side.laws.paper_settings import BEST_SHARE, PaperSettings


def pull(law: str, share: float | None, link: str, speed_mm_s: float | None, **changes: object) -> Row:
    when = None if share is None else "always"
    row = {"group": "apart", "law": law, "share": share, "enlargement": when, "scene": "wall", "link": link, "seed": 0}
    return row | {"passes": False, "contact_speed_mm_s": speed_mm_s, "gone_s": 2.0, "disarmed": None} | changes


def judged(law: str, share: float | None, alarms: int) -> Row:
    when = None if share is None else "always"
    row = {"group": "apart", "law": law, "share": share, "enlargement": when, "scene": "wall", "seed": 0}
    return row | {"coverage": 0.5, "alarms": alarms, "alarm_s": 0.1 * alarms, "judged_s": 60.0}


def test_a_point_has_what_a_law_prevents_and_what_it_costs() -> None:
    rows = [
        *(pull("none", None, link, speed) for link, speed in (("0 ms", 120.0), ("200 ms", 110.0), ("400 ms", None))),
        *(pull("paper", 0.01, link, speed) for link, speed in (("0 ms", None), ("200 ms", 80.0), ("400 ms", None))),
        pull("none", None, "200 ms", None, passes=True),
        pull("paper", 0.01, "200 ms", None, passes=True, gone_s=None),
        pull("paper", 0.01, "50 ms", None),  # nothing to compare it with, in an unfinished sweep
        pull("paper", 0.01, "0 ms", 90.0, disarmed="a button"),
        judged("paper", 0.01, 3),
        judged("paper", 0.01, 1),
    ]
    none, paper = points(Table(rows), "apart")
    assert (none["prevented"], none["contacts"], none["of"], none["lost_s"]) == (0.0, 2, 2, 0.0)
    # Where nothing is touched without haptics, nothing is prevented.
    assert (paper["prevented"], paper["contacts"], paper["of"], paper["fastest_mm_s"]) == (0.5, 1, 2, 80.0)
    assert (paper["alarms_per_min"], paper["lost_s"], paper["covered"]) == (2.0, 3.0, 0.5)
    assert paper["alarm_share"] == pytest.approx(0.4 / 120.0)
    assert len(points(Table(rows), "chosen")) == 0


def test_the_best_prevents_most_for_the_fewest_alarms_and_of_equal_ones_it_is_the_largest_f() -> None:
    def point(share: float, prevented: float | None, alarm_share: float) -> Row:
        return {"share": share, "prevented": prevented, "alarm_share": alarm_share}

    worse = [point(0.1, 0.5, 0.0), point(1e-6, 1.0, 0.3), point(0.2, None, 0.0)]
    assert best([*worse, point(1e-4, 1.0, 0.1), point(1e-3, 1.0, 0.1)]) == point(1e-3, 1.0, 0.1)
    assert best([point(0.2, None, 0.0)]) is None


def test_each_law_pulls_in_each_scene_and_the_default_f_is_among_those_tried() -> None:
    settings = FrontSettings()
    found = list(cells(settings))
    judging = [cell for cell in found if isinstance(cell, Judging)]
    assert [cell.group for cell in judging] == ["chosen"] * 2 + ["apart"] * 2
    # The scenes of the choice are none of those kept apart.
    pulls = [cell for cell in found if isinstance(cell, Pull)]
    scenes = [{cell.scene for cell in pulls if cell.group == group} for group in ("chosen", "apart")]
    assert not scenes[0] & scenes[1]
    of_paper = {cell.paper for cell in pulls if cell.law == "paper"}
    assert of_paper == set(settings.papers)
    assert PaperSettings(BEST_SHARE) in of_paper
    assert len(of_paper) == 2 * 7
    assert FrontSettings(quick=True, shares=(0.3,)).papers[0] == PaperSettings(0.3)


@pytest.mark.long
def test_a_small_f_stops_a_finger_that_a_large_one_does_not() -> None:
    ends = {}
    for law, paper in (("none", None), ("paper", PaperSettings(0.05)), ("paper", PaperSettings(BEST_SHARE))):
        (row,) = run(Pull("chosen", "wall", "0 ms", law, paper, passes=False), 0)
        ends[paper and paper.share] = row["contact_speed_mm_s"]
    assert ends[None] > ends[0.05] > 100.0
    assert ends[BEST_SHARE] is None
