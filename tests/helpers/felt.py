"""Messages from a robot side, and strengths made of them, for many tests."""

import struct
from typing import Any

import msgspec

from common.protocol.messages import Header, MotionState, OnsetDistances, StiffnessUpdate, Telemetry, TriggerField
from common.protocol.uniform_field import FAR_M, uniform_field
from common.protocol.view_messages import EnlargementTerms, SceneState
from operator_side.controller.feel import Strengths


def onsets(*metres: float) -> OnsetDistances:
    """Return eight distances; the last given one fills the rest."""
    whole: OnsetDistances = (*metres, *(metres[-1],) * (8 - len(metres)))  # type: ignore[assignment]
    return whole


def field(fast_m: OnsetDistances, slow_m: OnsetDistances | None = None, **changes: Any) -> TriggerField:
    """Return a field with these distances, v_max = 0.25 m/s and a = 3 m/s² unless changed."""
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
    """Return an update with the same strength, 0 to 8, in every zone of each trigger, whatever hands and arm do."""
    return StiffnessUpdate(
        *(header, uniform_field(l2), uniform_field(r2), 0.0, FAR_M, rumble, state),
        stands=stands,
    )


def telemetry(header: Header, **changes: Any) -> Telemetry:
    """Return telemetry of a disarmed tool at the origin that points downwards, unless changed."""
    still = Telemetry(
        *(header, "disarmed", (0.0, 0.0, 0.0), None, None, (0.0, -1.0, 0.0), 0.0),
        *(0.0, False, 0.0, 0.0, 0.0),
    )
    return msgspec.structs.replace(still, **changes)


def scene_state(header: Header, version: int = 1) -> SceneState:
    """Return a scene of one link, one object and no sphere, all in one place."""
    pose = (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
    row, terms = struct.pack("<7f", *pose), EnlargementTerms(0.01, 0.0, 0.001, 0.003, 0.002, 2.3, 0.1, 0.02)
    return SceneState(
        *(header, version, 1.0, row, bytes(4), row, b"\0", pose, b"", ((0, 1e-9, 2e-9),)),
        *(terms, terms, 50.0, 80.0, 0),
    )


def feedback(position: int, strength: int) -> Strengths:
    """Return strengths that are constant from zone `position` to the end of the travel."""
    return (0,) * position + (strength,) * (10 - position)
