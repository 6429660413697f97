"""Messages as a robot side sends them, and strengths of a trigger's zones, for many tests."""

import struct
from typing import Any

import msgspec

from common.protocol.messages import Header, MotionState, OnsetDistances, StiffnessUpdate, Telemetry, TriggerField
from common.protocol.uniform_field import FAR_M, uniform_field
from common.protocol.view_messages import EnlargementTerms, SceneState
from operator_side.controller.feel import Strengths


def onsets(*metres: float) -> OnsetDistances:
    """Return eight onset distances: the given ones, with the last one repeated."""
    whole: OnsetDistances = (*metres, *(metres[-1],) * (8 - len(metres)))  # type: ignore[assignment]
    return whole


def field(fast_m: OnsetDistances, slow_m: OnsetDistances | None = None, **changes: Any) -> TriggerField:
    """Return a trigger's field with these onset distances. Unless changed, v_max is 0.25 m/s and a is 3 m/s²."""
    return msgspec.structs.replace(uniform_field(0), fast_m=fast_m, slow_m=slow_m or fast_m, **changes)


def uniform_update(
    header: Header,
    *,
    l2: int = 0,
    r2: int = 0,
    rumble: float = 0.0,
    state: MotionState = "armed",
    stands: bool = False,
    hindered: bool = False,
) -> StiffnessUpdate:
    """Return an update that gives each zone of a trigger the same strength, `l2` or `r2` (0 to 8), at every speed."""
    return StiffnessUpdate(
        *(header, uniform_field(l2), uniform_field(r2), 0.0, FAR_M, rumble, state),
        stands=stands,
        hindered=hindered,
    )


def telemetry(header: Header, **changes: Any) -> Telemetry:
    """Return telemetry of a disarmed robot side. Unless changed, the tool is at the origin and points downwards."""
    still = Telemetry(
        *(header, "disarmed", (0.0, 0.0, 0.0), None, None, (0.0, -1.0, 0.0), 0.0),
        *(0.0, False, 0.0, 0.0, 0.0),
    )
    return msgspec.structs.replace(still, **changes)


def scene_state(header: Header, version: int = 1) -> SceneState:
    """Return a scene of one link and one object, both at the same pose, and without spheres of the gripper."""
    pose = (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
    row, terms = struct.pack("<7f", *pose), EnlargementTerms(0.01, 0.0, 0.001, 0.003, 0.002, 2.3, 0.1, 0.02)
    return SceneState(
        *(header, version, 1.0, row, bytes(4), row, b"\0", pose, b"", ((0, 1e-9, 2e-9),)),
        *(terms, terms, 50.0, 80.0, 0),
    )


def feedback(position: int, strength: int) -> Strengths:
    """Return the strengths of ten zones: 0 before zone `position`, `strength` from there to the end of the travel."""
    return (0,) * position + (strength,) * (10 - position)
