"""Pictures by codec: the measure of quality, the bytes at equal quality, and what a loss does."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

pytest.importorskip("av", reason="needs the extra `video`")
from feelahead.lab.questions.pictures import _bytes_at, _mending, ssim
from feelahead.lab.table import Table
from robot_side.viewing.h264 import H264

NOISE = gaussian_filter(np.random.default_rng(0).normal(0.0, 400.0, (96, 160)), 2.0)
PICTURE = np.repeat(np.clip(128.0 + NOISE, 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)


def test_quality_is_one_for_the_same_picture_and_falls_with_noise() -> None:
    generator = np.random.default_rng(1)
    found = [
        ssim(PICTURE, np.clip(PICTURE + generator.normal(0.0, sd, PICTURE.shape), 0, 255).astype(np.uint8))
        for sd in (0.0, 3.0, 10.0, 60.0)
    ]
    assert found[0] == pytest.approx(1.0, abs=1e-3)
    assert found == sorted(found, reverse=True)
    assert found[-1] < 0.8


def test_bytes_at_equal_quality_lie_between_two_settings_and_are_never_reached_beyond() -> None:
    points = ((30, 0.9, 100.0), (60, 0.98, 400.0), (90, 0.99, 1600.0))
    rows = Table({"method": f"X, {setting}", "ssim": quality, "bytes": size} for setting, quality, size in points)
    assert [_bytes_at(quality, rows, "X, ") for quality in (0.94, 0.985, 0.8)] == ["200", "800", "< 100"]


def test_refreshing_mends_a_loss_within_its_period_and_two() -> None:
    encoder = H264(refresh=10)
    steps = [encoder.encode(np.roll(PICTURE, 4 * number, axis=1), 75)[0] for number in range(50)]
    lost, newcomer = _mending(steps)
    assert 0 < lost <= 20
    assert 0 <= newcomer <= 20
