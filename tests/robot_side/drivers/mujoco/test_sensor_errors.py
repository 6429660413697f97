"""Simulated errors of encoders and camera have the given size, and are the same for the same seed."""

import math

import numpy as np
import pytest

from robot_side.drivers.mujoco.camera import CameraError
from robot_side.drivers.mujoco.encoders import Encoder


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


def test_the_lasting_error_has_the_mean_and_deviation_asked_for_with_the_papers_sign() -> None:
    """By eq. 1-2, perceived = true - e_c: the drawn error e_c is subtracted from the true positions."""
    names = tuple(f"object{index}" for index in range(4000))
    offsets = CameraError(names, mean_m=0.004, standard_deviation_m=0.002, seed=1).next_frame()
    assert offsets.shape == (4000, 3)
    # 4 standard deviations of the two estimates from 12 000 draws.
    assert offsets.mean() == pytest.approx(-0.004, abs=4.0 * 0.002 / math.sqrt(12_000))
    assert offsets.std() == pytest.approx(0.002, rel=4.0 / math.sqrt(24_000))


def test_the_mean_may_differ_from_axis_to_axis() -> None:
    error = CameraError(("a", "b"), mean_m=(0.001, -0.002, 0.003))
    np.testing.assert_array_equal(error.next_frame(), [[-0.001, 0.002, -0.003]] * 2)
    np.testing.assert_array_equal(error.mean_m, [0.001, -0.002, 0.003])
    np.testing.assert_array_equal(CameraError(("a",), mean_m=0.004).mean_m, [0.004] * 3)
    # The draws are the same for every mean.
    drawn, shifted = (CameraError(("a",), mean, 0.003, 0.001, seed=5).next_frame() for mean in (0.0, (0.1, 0.0, -0.1)))
    np.testing.assert_allclose(shifted - drawn, [[-0.1, 0.0, 0.1]], atol=1e-15)


def test_an_objects_error_does_not_depend_on_the_others() -> None:
    settings = {"standard_deviation_m": 0.003, "frame_standard_deviation_m": 0.001}
    many = CameraError(("box", "target", "ball"), seed=7, **settings)
    alone = CameraError(("target",), seed=7, **settings)
    for _ in range(3):
        np.testing.assert_array_equal(many.next_frame()[1], alone.next_frame()[0])


def test_the_lasting_part_lasts_and_the_other_is_drawn_anew() -> None:
    lasting = CameraError(("target",), standard_deviation_m=0.003, seed=2)
    np.testing.assert_array_equal(lasting.next_frame(), lasting.next_frame())
    error = CameraError(("target",), standard_deviation_m=0.003, frame_standard_deviation_m=0.001, seed=2)
    frames = np.array([error.next_frame()[0] for _ in range(4000)])
    np.testing.assert_allclose(frames.mean(axis=0), lasting.next_frame()[0], atol=4.0 * 0.001 / math.sqrt(4000))
    assert frames.std(axis=0) == pytest.approx(np.full(3, 0.001), rel=4.0 / math.sqrt(8000))
    assert error.variance_m2 == pytest.approx(0.003**2 + 0.001**2)
