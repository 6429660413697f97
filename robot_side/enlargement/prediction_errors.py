"""Errors μ_δ and σ_δ of the predicted delay displacement (eq. 10), by loop age and predicting side."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.protocol.messages import Compensation

BUILT_IN: Final = Path(__file__).parent / "prediction_errors.toml"
"""File with the errors of the built-in arm, written by `feelahead bench error --table`"""
WITHOUT_TABLE: Final = 0.2
"""Without a table, μ_δ is this share of v_max t_d"""
_KEYS: Final = ("loop_age_ms", "mu_mm", "sigma_mm")

Rows = tuple[tuple[float, float, float], ...]
"""Rows (loop age in s, μ_δ in m, σ_δ in m), in the order of rising loop ages"""


@dataclass(frozen=True)
class PredictionErrors:
    """Tables of μ_δ and σ_δ, by compensating side; without rows, μ_δ is 20 % of v_max times the loop age."""

    rows: Mapping[Compensation, Rows] = field(default_factory=dict)
    arm: str | None = None
    """Fingerprint of the arm on which the errors were measured"""

    def table(self, kind: Compensation) -> FloatArray:
        """Return the rows (k, 3) for one compensating side; no rows if its errors are unknown."""
        return np.array(self.rows.get(kind, ()), dtype=np.float64).reshape(-1, 3)

    def at(self, kind: Compensation, loop_age_s: float, full_speed_m_s: float) -> tuple[float, float]:
        """Return μ_δ and σ_δ in metres at a loop age, by `prediction_error`."""
        return prediction_error(self.table(kind), loop_age_s, full_speed_m_s)


def prediction_error(rows: FloatArray, loop_age_s: float, full_speed_m_s: float) -> tuple[float, float]:
    """Return μ_δ and σ_δ in m at a loop age, by linear interpolation between the rows (k, 3).

    The first row also holds before it. Beyond the last row, its values grow in proportion to the loop age.
    """
    count, after = rows.shape[0], 0
    if count == 0:
        return WITHOUT_TABLE * full_speed_m_s * loop_age_s, 0.0
    while after < count and rows[after, 0] <= loop_age_s:
        after += 1
    if after in (0, count):
        last = max(after - 1, 0)
        beyond = max(1.0, loop_age_s / rows[last, 0])
        return beyond * rows[last, 1], beyond * rows[last, 2]
    share = (loop_age_s - rows[after - 1, 0]) / (rows[after, 0] - rows[after - 1, 0])
    mean_m, sd_m = rows[after - 1, 1], rows[after - 1, 2]
    return mean_m + share * (rows[after, 1] - mean_m), sd_m + share * (rows[after, 2] - sd_m)


def load_prediction_errors(path: Path) -> PredictionErrors:
    """Read tables from a file; ConfigurationError names what is wrong in an invalid file."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise ConfigurationError(
            f"--prediction-errors {path}: {reason}; valid: a file that feelahead bench error --table wrote"
        ) from None
    rows = {kind: _rows(path, kind, content.get(kind, [])) for kind in get_args(Compensation)}
    arm = content.get("arm")
    return PredictionErrors(rows, arm if isinstance(arm, str) else None)


def _rows(path: Path, kind: str, tables: Any) -> Rows:
    try:
        rows = tuple(tuple(1e-3 * float(table[key]) for key in _KEYS) for table in tables)
    except (KeyError, TypeError, ValueError):
        rows = ()
    valid = all(np.isfinite(row).all() and row[0] > 0.0 and row[2] >= 0.0 for row in rows)
    if not (rows and valid and list(rows) == sorted(rows)):
        raise ConfigurationError(
            f"--prediction-errors {path}: [[{kind}]] is missing or invalid; valid: tables with"
            f" {', '.join(_KEYS)}, loop ages rising"
        )
    return rows  # type: ignore[return-value]
