"""Construction of an operator side from its settings."""

from collections.abc import Sequence
from dataclasses import fields

from operator_side.core import OperatorSide
from operator_side.core_settings import CoreSettings
from operator_side.events import Listener
from operator_side.settings import OperatorSettings


def build_operator_side(
    settings: OperatorSettings, epoch: int, clock_domain: str, listeners: Sequence[Listener] = ()
) -> OperatorSide:
    """Build an operator side's core from `settings`. listeners: notified of its inputs and outputs."""
    alike = {one.name: getattr(settings, one.name) for one in fields(CoreSettings) if one.name != "asymmetry_s"}
    core = CoreSettings(asymmetry_s=settings.asymmetry_s(), **alike)
    return OperatorSide(epoch, clock_domain, core, listeners)
