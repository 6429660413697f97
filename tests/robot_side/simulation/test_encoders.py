import math

import numpy as np
import pytest

from robot_side.simulation.encoders import Encoder


def test_the_standard_deviation_is_what_the_readings_show() -> None:
    for sigma_rad, step_rad in ((2e-4, 1e-4), (1e-4, 3e-4), (3e-4, 0.0)):
        encoder = Encoder(sigma_rad, step_rad, seed=3)
        true = np.random.default_rng(4).uniform(-3.0, 3.0, 40_000)
        errors = encoder.read(true) - true
        # The sample deviation of 40 000 errors is itself uncertain by 0.35 %; 4 of its deviations are allowed.
        assert np.std(errors) == pytest.approx(encoder.standard_deviation_rad(), rel=0.015)
        assert abs(errors.mean()) < 4.0 * encoder.standard_deviation_rad() / math.sqrt(errors.size)


def test_readings_are_whole_steps() -> None:
    step = 2.0 * math.pi / 2**12
    steps = Encoder(1e-3, step, seed=1).read(np.linspace(-2.0, 2.0, 100)) / step
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)


def test_the_seed_alone_decides_the_readings() -> None:
    true = np.zeros(6)
    first, second = Encoder(seed=5), Encoder(seed=5)
    for _ in range(3):
        np.testing.assert_array_equal(first.read(true), second.read(true))
    assert (Encoder(seed=6).read(true) != Encoder(seed=5).read(true)).any()


@pytest.mark.parametrize("bad", [-1e-6, math.nan, math.inf])
def test_bad_specifications_are_named(bad: float) -> None:
    with pytest.raises(ValueError, match="sigma_rad"):
        Encoder(sigma_rad=bad)
    with pytest.raises(ValueError, match="resolution_rad"):
        Encoder(resolution_rad=bad)
