"""Array types that the packages share."""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


def require_finite(name: str, values: FloatArray) -> None:
    """Raise ValueError, which names the argument, if an element of `values` is NaN or infinite."""
    if not np.isfinite(values).all():
        raise ValueError(f"{name} holds NaN or infinity; valid: finite numbers")
