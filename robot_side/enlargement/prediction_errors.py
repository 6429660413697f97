"""Errors μ_δ and σ_δ of the predicted delay displacement (eq. 10), by loop age and predicting side."""

import tomllib
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np

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

    def at(self, kind: Compensation, loop_age_s: float, full_speed_m_s: float) -> tuple[float, float]:
        """Return μ_δ and σ_δ in metres at a loop age, by `prediction_error`."""
        return prediction_error(self.rows.get(kind, ()), loop_age_s, full_speed_m_s)


def prediction_error(rows: Rows, loop_age_s: float, full_speed_m_s: float) -> tuple[float, float]:
    """Return μ_δ and σ_δ in m at a loop age, by linear interpolation between the rows.

    The first row also holds before it. Beyond the last row, its values grow in proportion to the loop age.
    """
    if not rows:
        return WITHOUT_TABLE * full_speed_m_s * loop_age_s, 0.0
    after = bisect_right(rows, loop_age_s, key=lambda row: row[0])
    age_s, mean_m, sd_m = rows[max(after - 1, 0)]
    if after in (0, len(rows)):
        beyond = max(1.0, loop_age_s / age_s)
        return beyond * mean_m, beyond * sd_m
    next_s, next_mean_m, next_sd_m = rows[after]
    share = (loop_age_s - age_s) / (next_s - age_s)
    return mean_m + share * (next_mean_m - mean_m), sd_m + share * (next_sd_m - sd_m)


def load_prediction_errors(path: Path) -> PredictionErrors:
    """Read tables from a file; ConfigurationError names what is wrong in an invalid file."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise ConfigurationError(
            f"--prediction-errors {path}: {reason}; valid: a file written by `feelahead bench error --table`"
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
            f"--prediction-errors {path}: [[{kind}]] is missing or invalid; valid: one table or more"
            f" with {', '.join(_KEYS)}, in the order of rising loop ages"
        )
    return rows  # type: ignore[return-value]
