"""Real stereo pictures, matched and mapped, beside their truth."""

import numpy as np
import pytest

from tests.robot_side.depth.real_pictures import Approach, fronts_off, mapped, perceived, pictures

pytestmark = pytest.mark.long


@pytest.fixture(scope="module", name="depths_m")
def _depths_m() -> tuple[np.ndarray, np.ndarray]:
    return pictures()


def test_surfaces_of_matched_pictures_are_where_the_true_ones_are(depths_m: tuple[np.ndarray, np.ndarray]) -> None:
    true_m, matched_m = depths_m
    of_true, of_matched = (fronts_off(mapped(depth_m), true_m) for depth_m in depths_m)
    assert (matched_m > 0.0).mean() > 0.8
    assert of_true.within > 0.99
    assert of_true.p90_m < 0.003
    # Matched wrongly is what lies before and beside edges.
    assert of_matched.within > 0.94
    assert of_matched.median_m < 0.003


def test_full_strength_comes_in_time_at_what_real_pictures_show(depths_m: tuple[np.ndarray, np.ndarray]) -> None:
    approach, objects = Approach(depths_m[0]), perceived(mapped(depths_m[1]))
    early_m = [approach.early_m(objects, 0.9, *place) for place in approach.places_m()[::7].tolist()]
    assert min(early_m) > 0.0
    assert np.median(early_m) < 0.04
