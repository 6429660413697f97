"""Construction of an operator side from its settings."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from operator_side.core import OperatorSide
from operator_side.core_settings import CoreSettings
from operator_side.events import Listener
from operator_side.settings import OperatorSettings


def build_operator_side(
    settings: OperatorSettings, epoch: int, clock_domain: str, listeners: Sequence[Listener] = ()
) -> OperatorSide:
    """Build an operator side's core from `settings`. listeners: notified of its inputs and outputs."""
    parsed: dict[str, Any] = {"asymmetry_s": settings.asymmetry_s(), "tick_period_s": settings.tick_period_s()}
    alike = {one.name: getattr(settings, one.name) for one in fields(CoreSettings) if one.name not in parsed}
    core = CoreSettings(**parsed, **alike)
    return OperatorSide(epoch, clock_domain, core, listeners)
