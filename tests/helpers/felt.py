"""Messages that a robot side may send, and strengths that they become: what tests need often."""

import struct
from typing import Any

import msgspec

from common.protocol.messages import Header, MotionState, StiffnessUpdate, Telemetry, TriggerField, Ways
from common.protocol.uniform_field import FAR_M, uniform_field
from common.protocol.view_messages import EnlargementTerms, SceneState
from operator_side.controller.feel import Strengths


def ways(*metres: float) -> Ways:
    """Eight ways; the last of those given, again and again, for those that are not."""
    whole: Ways = (*metres, *(metres[-1],) * (8 - len(metres)))  # type: ignore[assignment]
    return whole


def field(fast_m: Ways, slow_m: Ways | None = None, **changes: Any) -> TriggerField:
    """A field with these ways, v_max = 0.25 m/s and a = 3 m/s² unless `changes` say otherwise."""
    return msgspec.structs.replace(uniform_field(0), fast_m=fast_m, slow_m=slow_m or fast_m, **changes)


def felt(
    header: Header,
    *,
    l2: int = 0,
    r2: int = 0,
    rumble: float = 0.0,
    state: MotionState = "armed",
    stands: bool = False,
) -> StiffnessUpdate:
    """The same strength in every zone of each trigger, 0 to 8, whatever the hands and the arm do."""
    return StiffnessUpdate(
        *(header, uniform_field(l2), uniform_field(r2), 0.0, FAR_M, rumble, state),
        stands=stands,
    )


def telemetry(header: Header, **changes: Any) -> Telemetry:
    """A tool at the origin that looks downwards, disarmed, and nothing else, unless `changes` say otherwise."""
    still = Telemetry(
        *(header, "disarmed", (0.0, 0.0, 0.0), None, None, (0.0, -1.0, 0.0), 0.0),
        *(0.0, False, 0.0, 0.0, 0.0),
    )
    return msgspec.structs.replace(still, **changes)


def scene_state(header: Header, version: int = 1) -> SceneState:
    """One link, one object and no sphere, all in one place."""
    pose = (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
    row, terms = struct.pack("<7f", *pose), EnlargementTerms(0.01, 0.0, 0.001, 0.003, 0.002, 2.3, 0.1, 0.02)
    return SceneState(
        *(header, version, 1.0, row, bytes(4), row, b"\0", pose, b"", ((0, 1e-9, 2e-9),)),
        *(terms, terms, 50.0, 80.0, 0),
    )


def feedback(position: int, strength: int) -> Strengths:
    """One strength from a zone to the end of the travel."""
    return (0,) * position + (strength,) * (10 - position)
