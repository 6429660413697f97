"""Losses and delays of an emulated link, compared with theory or with the kernel's netem."""

import math

import numpy as np
import pytest

from tests.helpers.link_runs import Run, bursts, lag_one

pytestmark = pytest.mark.long


def test_random_loss_is_independent() -> None:
    lost = Run("loss 10%", 50_000).lost
    assert np.mean(lost) == pytest.approx(0.10, abs=0.005)
    assert np.mean(bursts(lost)) == pytest.approx(1.0 / 0.9, abs=0.02)


def test_gilbert_elliott_loses_in_bursts_of_the_length_asked_for() -> None:
    lost = Run("loss gemodel 1% 25%", 400_000).lost
    assert np.mean(lost) == pytest.approx(0.01 / 0.26, abs=0.003)
    assert np.mean(bursts(lost)) == pytest.approx(4.0, abs=0.25)
    lengths = np.array(bursts(lost))
    assert np.mean(lengths > 4) == pytest.approx(0.75**4, abs=0.03)


@pytest.mark.parametrize(
    ("shape", "mean_ms", "sd_ms"),
    [
        ("uniform", 50.0, 10.0 / math.sqrt(3.0)),
        ("normal", 50.0, 10.0),
        ("pareto", 49.67, 8.20),
        ("paretonormal", 49.75, 8.34),
        ("exponential", 60.0, 10.0),
    ],
)
def test_delays_have_the_moments_of_their_shape(shape: str, mean_ms: float, sd_ms: float) -> None:
    delays_s = Run(f"delay 50ms 10ms 40% distribution {shape}", 40_000, seed=5).delays_s
    assert 1e3 * delays_s.mean() == pytest.approx(mean_ms, abs=0.2)
    assert 1e3 * delays_s.std() == pytest.approx(sd_ms, abs=0.2)
    assert lag_one(delays_s) == pytest.approx(0.0, abs=0.02), "netem's correlation leaves delays as they are"
