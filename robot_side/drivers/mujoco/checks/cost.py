"""Check of a model's cost: the time of a step of its physics, against the time that the step simulates."""

from typing import Final

import mujoco  # type: ignore[import-untyped]
import numpy as np

from common.clock import Clock, ThreadClock
from robot_side.drivers.mujoco.scene import Scene

_STEPS: Final = 25
_LONGEST_S: Final = 0.5


def cost_findings(scene: Scene, clock: Clock | None = None) -> list[str]:
    """Return a line if the median step takes longer than the time that it simulates, by `clock`: processor time."""
    model, clock = scene.model, clock or ThreadClock()
    data, began_s = mujoco.MjData(model), clock.now()
    took_s: list[float] = []
    mujoco.mj_copyData(data, model, scene.data)
    while len(took_s) < _STEPS and clock.now() - began_s < _LONGEST_S:
        start_s = clock.now()
        mujoco.mj_step(model, data)
        took_s.append(clock.now() - start_s)
    step_s, needs_s = float(model.opt.timestep), float(np.median(took_s))
    if needs_s <= step_s:
        return []
    return [
        f"physics takes {1e3 * needs_s:.1f} ms for each step of {1e3 * step_s:g} ms: the arm runs"
        f" {needs_s / step_s:.1f} times slower than real time (a longer timestep, or simpler geoms, help)"
    ]
