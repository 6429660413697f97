"""Fields that a robot side may send, and effects that they become: what tests need often."""

from typing import Any

import msgspec

from common.protocol.messages import Header, MotionState, StiffnessUpdate, TriggerField, Ways
from common.protocol.uniform_field import FAR_M, uniform_field
from operator_side.dualsense.effects.official import MultiPositionFeedback


def ways(*metres: float) -> Ways:
    """Eight ways; the last of those given, again and again, for those that are not."""
    whole: Ways = (*metres, *(metres[-1],) * (8 - len(metres)))  # type: ignore[assignment]
    return whole


def field(fast_m: Ways, slow_m: Ways | None = None, **changes: Any) -> TriggerField:
    """A field with these ways, v_max = 0.25 m/s and a = 3 m/s² unless `changes` say otherwise."""
    return msgspec.structs.replace(uniform_field(0), fast_m=fast_m, slow_m=slow_m or fast_m, **changes)


def felt(
    header: Header, *, l2: int = 0, r2: int = 0, rumble: float = 0.0, state: MotionState = "armed"
) -> StiffnessUpdate:
    """The same strength in every zone of each trigger, 0 to 8, whatever the hands and the arm do."""
    return StiffnessUpdate(
        header, uniform_field(l2), uniform_field(r2), speed_m_s=0.0, horizon_m=FAR_M, rumble=rumble, state=state
    )


def feedback(position: int, strength: int) -> MultiPositionFeedback:
    """One strength from a zone to the end of the travel."""
    return MultiPositionFeedback((0,) * position + (strength,) * (10 - position))
