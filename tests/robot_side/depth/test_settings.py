from typing import Any

import pytest

from robot_side.depth.settings import MapSettings


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"cell_m": 0.0}, "cell_m = 0.0; valid: 0.004 to 0.05"),
        ({"slots": 10}, "slots = 10; valid: 64 to 16384"),
        ({"lower_m": (0.0, 0.0)}, r"lower_m = \(0.0, 0.0\); valid: three coordinates"),
        ({"lower_m": (0.0, 0.0, 30.0)}, r"lower_m\[2\] = 30.0; valid: -20 to 20"),
        ({"upper_m": (1.0, -1.0, 1.0)}, "upper_m = "),
        ({"upper_m": (20.0, 20.0, 20.0)}, "cell_m = 0.01 makes"),
    ],
)
def test_settings_out_of_range_are_refused(changed: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        MapSettings(**changed)


def test_cells_cover_the_region() -> None:
    assert MapSettings().cells == (200, 200, 120)
