"""Kernels that compile quickly, not yet compiled, as in a new process."""

import robot_side.parts  # noqa: F401  (brings the kernels)
from robot_side.compiled import kernel as compile_module
from robot_side.compiled.kernel import Compiled, imported_kernels

NAMES = (
    "robot_side.drivers.mujoco.plant.sense",
    "robot_side.arm.resolved_rate._resolve",
    "robot_side.surroundings.kinds.box.overlap_one_box",
)


def fresh_kernels() -> tuple[Compiled, ...]:
    """Return new copies of the kernels `NAMES`: not yet compiled, and not in the list of imported kernels."""
    fresh = tuple(
        Compiled(kernel.function, tuple(kernel.signature.args), kernel.signature.return_type)
        for kernel in imported_kernels()
        if kernel.name in NAMES
    )
    for kernel in fresh:
        compile_module._kernels.remove(kernel)
    return fresh
