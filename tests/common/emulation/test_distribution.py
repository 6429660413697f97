import math
from pathlib import Path

import numpy as np
import pytest

from common.emulation.distribution import delays_at, moments, table

IPROUTE2_TABLES = Path("/usr/lib/x86_64-linux-gnu/tc")


@pytest.mark.parametrize("shape", ["normal", "pareto", "paretonormal"])
def test_tables_have_netems_size_and_resolution(shape: str) -> None:
    quantiles = table(shape)
    assert quantiles is not None
    assert quantiles.shape == (4096,)
    assert np.all(np.diff(quantiles) >= 0.0)
    assert np.array_equal(quantiles * 8192, np.rint(quantiles * 8192))
    assert not quantiles.flags.writeable


@pytest.mark.skipif(not IPROUTE2_TABLES.is_dir(), reason="iproute2's tables are not on this machine")
@pytest.mark.parametrize("shape", ["normal", "pareto", "paretonormal"])
def test_tables_differ_from_iproute2s_by_rounding_alone(shape: str) -> None:
    quantiles = table(shape)
    lines = (IPROUTE2_TABLES / f"{shape}.dist").read_text(encoding="utf-8").splitlines()
    theirs = np.sort([int(word) for line in lines for word in line.partition("#")[0].split()]) / 8192
    assert quantiles is not None
    assert np.max(np.abs(quantiles - theirs)) <= 1.0 / 8192


def test_exponential_is_a_floor_with_a_tail() -> None:
    probabilities = np.array([0.0, 0.5, 1.0 - math.exp(-3.0)])
    assert delays_at(probabilities, 0.050, 0.010, "exponential") == pytest.approx(
        [0.050, 0.050 + 0.010 * math.log(2.0), 0.080]
    )
    mean_s, sd_s, greatest_s = moments(0.050, 0.010, "exponential")
    assert (mean_s, sd_s) == pytest.approx((0.060, 0.010), rel=1e-4)
    assert greatest_s == math.inf
