"""The definition of onset distances, by which the field is judged, compared with closed forms and a fine grid."""

from dataclasses import replace

import numpy as np
import pytest

from common.arrays import FloatArray
from feelahead.lab.approaches.ticks import DEMO, record
from feelahead.lab.reference import onsets_by_definition
from feelahead.lab.reference.looks import compare, looks_of
from feelahead.lab.reference.onsets_by_definition import GRAZE_M, Defined, defined_onsets
from tests.helpers.field.fields import AHEAD, RADIUS_M, along, ball_pose
from tests.helpers.perceived_scenes import Scene

MARGIN_M, REACH_M, STEP_M = 0.012, 0.06, 3e-5
DUE = (np.arange(8) + 0.5) / 8


@pytest.mark.parametrize("inflated_m", [0.0, 0.007])
def test_before_a_wall_the_ways_are_those_of_a_cap(inflated_m: float) -> None:
    radius, gap_m = RADIUS_M + inflated_m, 0.03
    wall = Scene().add().half_space(-AHEAD, -RADIUS_M - gap_m).objects()
    none = np.zeros(1, dtype=np.int64)
    defined = defined_onsets(ball_pose(), wall, none, along(AHEAD, inflated_m), np.inf, np.zeros(6))
    depths = defined.onsets_m[0, 0] + MARGIN_M - (gap_m - inflated_m)

    def cap(depth: FloatArray | float) -> FloatArray | float:
        return np.pi * depth**2 * (radius - depth / 3.0)

    np.testing.assert_allclose(cap(depths) / cap(MARGIN_M), DUE, atol=1e-3)
    np.testing.assert_array_equal(defined.onsets_m[:, 0], defined.onsets_m[:, 1])
    assert (defined.onsets_m[1] < defined.onsets_m[0]).all()
    assert (defined.onsets_m[0] < defined.onsets_m[2]).all()
    assert defined.sigma_m == inflated_m


def test_a_way_is_off_by_its_distance_and_in_a_graze_from_its_band() -> None:
    onsets_m = np.full((3, 2, 8), np.inf)
    onsets_m[:, 0, 0], onsets_m[:, 0, 1], onsets_m[:, 0, 2] = (0.1, 0.0998, 0.1002), (0.1, 0.09, 0.2), (0.3, 0.29, 0.31)
    defined = Defined(onsets_m, 0.0, np.zeros((2, 8), dtype=np.int64))
    assert onsets_m[2, 0, 1] - onsets_m[1, 0, 1] > GRAZE_M
    found_m = np.full((2, 8), np.inf)
    for first, second, off_m in ((0.101, 0.19, (0.001, 0.0)), (0.05, 0.08, (-0.05, -0.01)), (0.1, np.inf, (0.0, 0.05))):
        found_m[0, :2] = first, second
        judged = defined.judge(found_m, 0.25)
        np.testing.assert_allclose(judged.off_m, off_m, atol=1e-12)
        assert judged.grazes.tolist() == [False, True]
    found_m[0, 0] = np.nan
    assert defined.judge(found_m, 0.25).off_m[0] == np.inf


@pytest.mark.long
def test_looks_of_the_demo_are_noted_and_another_law_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    recorded = record(DEMO, 7.0)
    spheres = [len(tick.situation.pose.sphere_radii_m) for tick in recorded.ticks]
    gripped = spheres.index(max(spheres))
    near = replace(recorded, ticks=recorded.ticks[gripped - 200 : gripped + 61])
    asked, encoder_sigma_rad = looks_of(near, 40)
    assert {len(one.pose.sphere_radii_m) for one, _ in asked} == {246, 383}
    assert 20 < len(asked) <= 40
    found = compare(asked, encoder_sigma_rad).row()
    assert found["looks"] == len(asked)
    assert found["distances"] > 100
    assert (found["late"], found["out_of_band"]) == (0, 0)
    assert found["sigma_off_mm"] < 1e-9
    monkeypatch.setattr(onsets_by_definition, "MARGIN_M", 0.0125)
    assert compare(asked, encoder_sigma_rad).row()["late"] > 100
