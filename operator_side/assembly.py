"""Settings to an operator side that is ready to feel."""

from collections.abc import Sequence

from operator_side.core import CoreSettings, OperatorSide
from operator_side.events import Listener
from operator_side.settings import OperatorSettings


def build_operator_side(
    settings: OperatorSettings, epoch: int, clock_domain: str, listeners: Sequence[Listener] = ()
) -> OperatorSide:
    """Put an operator side together. listeners: hear what happens to it."""
    core = CoreSettings(
        haptics=settings.haptics,
        calibration=settings.calibration,
        rendering=settings.rendering,
        compensation=settings.compensation,
        swap_sides=settings.swap_sides,
        seed=settings.seed,
        asymmetry_s=settings.asymmetry_s(),
        full_rate=settings.full_rate,
    )
    return OperatorSide(epoch, clock_domain, core, listeners)
