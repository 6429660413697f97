"""Fixed workload ("mixed") that resembles a tick. Ratios to its time depend less on the machine than times do."""

from typing import Final

import numpy as np

from common.arrays import FloatArray
from robot_side.drivers.mujoco.scene import load_scene

_SETTLING_STEPS: Final = 3000
"""Number of physics steps after which the objects on the table are at rest or asleep."""
_LOOP_TURNS: Final = 600


class Mixed:
    """The workload: a step of the demo's physics in its own scene, a Python loop of 600 turns, six NumPy calls."""

    def __init__(self) -> None:
        self._scene = load_scene()
        self._one, self._other = np.arange(6.0), np.arange(6.0)
        for _ in range(_SETTLING_STEPS):
            self._scene.step()

    def work(self) -> None:
        """Run the workload once."""
        self._scene.step()
        total, one, other = 0, self._one, self._other
        for k in range(_LOOP_TURNS):
            total += k * k
        np.add(one, other)
        np.multiply(one, other)
        np.minimum(one, other)
        one.take([1])
        one.sum()
        self._scene.data.qpos.copy()


def as_ratios(spent_s: FloatArray, mixed_s: FloatArray) -> dict[str, float]:
    """Return p50 and p99 of `spent_s` in us, and their ratios to p50 and p99 of "mixed" in the same run."""
    (p50, p99), (p50_mixed, p99_mixed) = (np.quantile(one, (0.5, 0.99)).tolist() for one in (spent_s, mixed_s))
    ratios = {"p50_of_mixed": p50 / p50_mixed, "p99_of_mixed": p99 / p99_mixed}
    return {"p50_us": 1e6 * p50, "p99_us": 1e6 * p99, **ratios}
