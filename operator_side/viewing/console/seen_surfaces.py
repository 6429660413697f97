"""Surfaces that depth cameras see: where those of the target are, and how far below a point the next one lies."""

import numpy as np

from common.protocol.view_messages import SceneState
from common.roles import ROLES, Role
from operator_side.viewing.console.outlines import SIGNS, Floats, rotation

_LEAST_SLOPE = 1e-9


class SeenSurfaces:
    """Newest surfaces, in the world frame."""

    def __init__(self) -> None:
        self._centers_m: Floats = np.empty((0, 3))
        self._axes: Floats = np.empty((0, 3, 3))
        self._half_m: Floats = np.empty((0, 3))
        self._is_target = np.empty(0, dtype=bool)

    def take(self, state: SceneState) -> None:
        """Take the surfaces of a state; those of an earlier one stay if it has none."""
        if state.surfaces is None:
            return
        rows = np.frombuffer(state.surfaces, np.float32).reshape(-1, 10).astype(np.float64)
        self._centers_m, self._half_m = rows[:, :3], rows[:, 7:]
        self._axes = np.array([rotation(row[:7]) for row in rows]).reshape(-1, 3, 3)
        self._is_target = np.frombuffer(state.surface_roles, np.uint8) == ROLES.index(Role.TARGET)

    def target_corners_m(self) -> Floats | None:
        """Return the corners (8 n, 3) of the target's surfaces; None if there are none."""
        chosen = self._is_target
        if not chosen.any():
            return None
        across = np.einsum("nij,nkj->nki", self._axes[chosen], SIGNS * self._half_m[chosen, None])
        corners: Floats = (self._centers_m[chosen, None] + across).reshape(-1, 3)
        return corners

    def top_below_m(self, point: Floats, *, with_target: bool) -> float | None:
        """Return how far below a point the next surface lies; None if none does."""
        chosen = np.ones(len(self._is_target), dtype=bool) if with_target else ~self._is_target
        axes, half_m = self._axes[chosen], self._half_m[chosen]
        start = np.einsum("nji,nj->ni", axes, point - self._centers_m[chosen])
        down = -axes[:, 2, :]
        down = np.where(np.abs(down) < _LEAST_SLOPE, _LEAST_SLOPE, down)
        ends = np.stack([(-half_m - start) / down, (half_m - start) / down])
        enters, leaves = ends.min(axis=0).max(axis=1, initial=-np.inf), ends.max(axis=0).min(axis=1, initial=np.inf)
        met = enters[(enters <= leaves) & (enters >= 0.0)]
        return float(met.min()) if met.size else None
