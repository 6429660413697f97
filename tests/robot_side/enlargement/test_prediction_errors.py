"""Mean and standard deviation of the predicted displacement's error, by a table over the loop age."""

from pathlib import Path

import pytest

from common.errors import ConfigurationError
from robot_side.enlargement.prediction_errors import (
    PredictionErrors,
    load_prediction_errors,
)

ROWS = ((0.1, 0.001, 0.002), (0.2, -0.002, 0.004), (0.4, 0.004, 0.010))
TABLE = PredictionErrors({"operator": ROWS})
GOOD = """
arm = "0123456789ab"
[[operator]]
loop_age_ms = 100
mu_mm = 1.0
sigma_mm = 2.0
p99_mm = 7
[[operator]]
loop_age_ms = 200.0
mu_mm = -2.0
sigma_mm = 4.0
[[robot]]
loop_age_ms = 150.0
mu_mm = 0.0
sigma_mm = 20.0
"""


def read(folder: Path, content: str) -> PredictionErrors:
    path = folder / "errors.toml"
    path.write_text(content)
    return load_prediction_errors(path)


@pytest.mark.parametrize(
    ("loop_age_s", "expected"),
    [
        *((age_s, (mean_m, sd_m)) for age_s, mean_m, sd_m in ROWS),
        # Linear between two rows; before the first row no less than in it.
        *((0.15, (-0.0005, 0.003)), (0.25, (-0.0005, 0.0055)), (0.0, (0.001, 0.002)), (0.01, (0.001, 0.002))),
        # Beyond the last one it grows with the loop age.
        *((0.8, (0.008, 0.020)), (60.0, (0.6, 1.5))),
    ],
)
def test_what_is_missed_at_a_loop_age(loop_age_s: float, expected: tuple[float, float]) -> None:
    assert TABLE.at("operator", loop_age_s, 0.25) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("table", [TABLE, PredictionErrors()])
def test_without_rows_it_is_a_fifth_of_the_way_that_full_speed_goes(table: PredictionErrors) -> None:
    assert table.at("robot", 0.3, 0.25) == pytest.approx((0.2 * 0.25 * 0.3, 0.0))
    assert table.at("robot", 0.0, 0.25) == (0.0, 0.0)


def test_a_file_is_in_the_units_of_its_keys(tmp_path: Path) -> None:
    errors = read(tmp_path, GOOD)
    assert errors.arm == "0123456789ab"
    assert errors.at("operator", 0.1, 0.25) == pytest.approx((0.001, 0.002))
    assert errors.at("operator", 0.2, 0.25) == pytest.approx((-0.002, 0.004))
    assert errors.at("robot", 0.3, 0.25) == pytest.approx((0.0, 0.040))
    assert read(tmp_path, GOOD.replace('"0123456789ab"', "3")).arm is None


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("sigma_mm = 2.0", "", "[[operator]]"),
        ("sigma_mm = 2.0", "sigma_mm = -2.0", "[[operator]]"),
        ("mu_mm = 1.0", 'mu_mm = "much"', "[[operator]]"),
        ("mu_mm = 1.0", "mu_mm = inf", "[[operator]]"),
        ("loop_age_ms = 100", "loop_age_ms = 0", "[[operator]]"),
        ("loop_age_ms = 100", "loop_age_ms = 300", "[[operator]]"),
        ("[[robot]]", "[[momentary]]", "[[robot]]"),
        ("[[robot]]", "robot = 3\n[other]", "[[robot]]"),
        ("[[robot]]", "[[robot", "valid: a file written"),
    ],
)
def test_a_file_that_is_none_is_named_with_what_is_wrong(tmp_path: Path, old: str, new: str, named: str) -> None:
    assert old in GOOD
    with pytest.raises(ConfigurationError) as caught:
        read(tmp_path, GOOD.replace(old, new, 1))
    text = str(caught.value)
    assert str(tmp_path / "errors.toml") in text
    assert named in text
    assert "\n" not in text.strip()


def test_a_file_that_is_not_there_or_no_text_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"nowhere\.toml"):
        load_prediction_errors(tmp_path / "nowhere.toml")
    (tmp_path / "picture.toml").write_bytes(b"\xff\xd8")
    with pytest.raises(ConfigurationError, match=r"picture\.toml"):
        load_prediction_errors(tmp_path / "picture.toml")
