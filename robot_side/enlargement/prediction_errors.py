"""What the prediction of the delay's displacement misses: μ_δ and σ_δ of eq. 10, over loop age and who predicts."""

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
"""Of the built-in arm, written by `feelahead bench error --table`."""
WITHOUT_TABLE: Final = 0.2
"""Share of v_max t_d that is taken for μ_δ where no table is known."""
_KEYS: Final = ("loop_age_ms", "mu_mm", "sigma_mm")

Rows = tuple[tuple[float, float, float], ...]
"""(loop age in s, μ_δ in m, σ_δ in m), loop ages rising."""


@dataclass(frozen=True)
class PredictionErrors:
    """μ_δ and σ_δ; without rows, 20 % of the way that full speed goes in the loop age."""

    rows: Mapping[Compensation, Rows] = field(default_factory=dict)
    arm: str | None = None
    """The fingerprint of the arm that they were measured on."""

    def at(self, kind: Compensation, loop_age_s: float, full_speed_m_s: float) -> tuple[float, float]:
        """μ_δ and σ_δ in metres at a loop age, between the rows; beyond the last one they grow with the loop age."""
        rows = self.rows.get(kind, ())
        if not rows:
            return WITHOUT_TABLE * full_speed_m_s * loop_age_s, 0.0
        after = bisect_right(rows, loop_age_s, key=lambda row: row[0])
        if after in (0, len(rows)):
            age_s, mean_m, sd_m = rows[max(after - 1, 0)]
            beyond = max(1.0, loop_age_s / age_s)
            return beyond * mean_m, beyond * sd_m
        (age_s, mean_m, sd_m), (next_age_s, next_mean_m, next_sd_m) = rows[after - 1 : after + 1]
        share = (loop_age_s - age_s) / (next_age_s - age_s)
        return mean_m + share * (next_mean_m - mean_m), sd_m + share * (next_sd_m - sd_m)


def load_prediction_errors(path: Path) -> PredictionErrors:
    """Read a table; ConfigurationError for a file that is none, naming what is wrong with it."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or error
        raise ConfigurationError(
            f"--prediction-errors {path}: {reason}; valid: a table of: feelahead bench error --table"
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
            f"--prediction-errors {path}: [[{kind}]] is missing or not as it should be; valid: tables with"
            f" {', '.join(_KEYS)}, loop ages rising"
        )
    return rows  # type: ignore[return-value]
