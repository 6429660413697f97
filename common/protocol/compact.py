"""Packed form of stiffness and telemetry: all but the header and texts are in one binary field.

    stiffness    [tag, header, field]            110 bytes of field, some 260 with distances around
    telemetry    [tag, header, texts, field]     69 bytes

Onset distances are whole steps of 2^-14 m, a sixteenth of a millimetre, in 16 bits. They are rounded towards the
gripper, never up. The step is a power of two, so that packing unpacked values again loses nothing. Speeds,
accelerations and stiffnesses are single-precision numbers. Rumble is in eighths, rounded up. All is little-endian.
"""

import math
import struct
from bisect import bisect_left
from typing import Any, Final, get_args

from msgspec import inspect

from common.protocol.around import LISTS, PROBES, Around
from common.protocol.messages import (
    Hello,
    LeaseNotice,
    LinkReport,
    Mark,
    Message,
    MotionCommand,
    MotionState,
    OnsetDistances,
    StiffnessUpdate,
    Telemetry,
    TriggerField,
    Tune,
    Watch,
)

STEP_M: Final = 2.0**-14
_STEPS: Final = 2.0**14
_IN_STEPS: Final = _STEPS.__mul__
_IN_METRES: Final = STEP_M.__rmul__
_BEYOND: Final = 2**15 - 1
"""Code for a distance at or beyond the horizon."""
_ALL_BEYOND: Final = [_BEYOND] * 8
_NOTHING_NEAR: Final = tuple(_ALL_BEYOND)
_FARTHEST: Final = _BEYOND - 1
"""Largest distance in steps (2 m), to which longer distances below the horizon are clipped."""
_PAST: Final = -(2**15)
"""Code for a negative distance that 16 bits cannot hold."""
_PAST_M: Final = -100.0
_STATES: Final[tuple[MotionState, ...]] = get_args(MotionState)
_STANDS, _HINDERED = 4, 8
_ROUNDING: Final = 1e-6
_LARGEST_SINGLE: Final = (2.0 - 2.0**-23) * 2.0**127

_STIFFNESS: Final = struct.Struct("<32h10fiBBB")
"""Fields in order: onset distances (L2 fast, L2 slow, R2 fast, R2 slow); v_max, a, δ and s of L2, then of R2; v;
commanded speed, NaN for None; horizon; rumble; one byte with the state and bits for `stands` and `hindered`; the
response in `_RESPONSES` a second."""
_RESPONSES: Final = 250.0
_AROUND: Final = struct.Struct(f"<f{LISTS * PROBES}s")
"""Optional part after _STIFFNESS: `full_s` and `steps` of an Around; its `changes` follow, to the end of the field."""


def _numbers(kind: inspect.Type) -> int:
    """Return how many floats a message's field of that type holds; 0 if it holds something else."""
    match kind:
        case inspect.UnionType(types=types):
            return max(map(_numbers, types))
        case inspect.TupleType(item_types=items):
            return len(items)
    return int(isinstance(kind, inspect.FloatType))


_VIEW: Final = {one.name: one.type for one in inspect.type_info(Telemetry).fields}  # type: ignore[attr-defined]  # a struct's
_NUMBERS: Final = {name: count for name, kind in _VIEW.items() if (count := _numbers(kind))}
_TRUE: Final = [name for name, kind in _VIEW.items() if isinstance(kind, inspect.BoolType)]
_KNOWN: Final = [name for name in _NUMBERS if isinstance(_VIEW[name], inspect.UnionType)]
_BITS: Final = {name: 4 << place for place, name in enumerate((*_TRUE, *_KNOWN))}
"""Bits above the two of the state: one for each boolean's value, and one for each optional field's presence."""
_TELEMETRY: Final = struct.Struct(f"<{sum(_NUMBERS.values())}fB")
"""All numbers in the order of Telemetry's fields, zeros for None; then one byte with the state and _BITS."""


class StiffnessOnWire(Message, frozen=True, tag="stiffness"):
    """StiffnessUpdate in packed form."""

    field: bytes


class TelemetryOnWire(Message, frozen=True, tag="telemetry"):
    """Telemetry in packed form."""

    target: str | None
    hindrance: str | None
    field: bytes


AnyOnWire = Hello | MotionCommand | Watch | Tune | Mark | LeaseNotice | LinkReport | StiffnessOnWire | TelemetryOnWire


def packed(message: Message) -> Message:
    """Return the packed form of a message; kinds without one are returned unchanged."""
    if isinstance(message, StiffnessUpdate):
        return StiffnessOnWire(message.header, _pack_stiffness(message))
    if isinstance(message, Telemetry):
        return TelemetryOnWire(message.header, message.target, message.hindrance, _pack_telemetry(message))
    return message


def unpacked(
    message: AnyOnWire,
) -> Hello | MotionCommand | Watch | Tune | Mark | LeaseNotice | LinkReport | StiffnessUpdate | Telemetry:
    """Return the unpacked form of a received message; raises ValueError or struct.error for an invalid binary field."""
    if isinstance(message, StiffnessOnWire):
        return _unpack_stiffness(message)
    return _unpack_telemetry(message) if isinstance(message, TelemetryOnWire) else message


def _pack_stiffness(update: StiffnessUpdate) -> bytes:
    l2, r2, horizon_m, commanded_m_s = update.l2, update.r2, update.horizon_m, update.commanded_m_s
    field = _STIFFNESS.pack(
        *_steps(l2.fast_m, horizon_m),
        *_steps(l2.slow_m, horizon_m),
        *_steps(r2.fast_m, horizon_m),
        *_steps(r2.slow_m, horizon_m),
        *(l2.full_speed_m_s, l2.acceleration_m_s2, l2.displacement_m, l2.course_stiffness),
        *(r2.full_speed_m_s, r2.acceleration_m_s2, r2.displacement_m, r2.course_stiffness),
        update.speed_m_s,
        math.nan if commanded_m_s is None else commanded_m_s,
        math.floor(horizon_m * _STEPS),
        math.ceil(8.0 * update.rumble),
        _STATES.index(update.state) + _STANDS * update.stands + _HINDERED * update.hindered,
        math.ceil(_RESPONSES * update.response_s - _ROUNDING),
    )
    around = update.around
    return field if around is None else field + _AROUND.pack(around.full_s, around.steps) + around.changes


def _unpack_stiffness(message: StiffnessOnWire) -> StiffnessUpdate:
    content = _STIFFNESS.unpack_from(message.field)
    behind = message.field[_STIFFNESS.size :]
    speed_m_s, commanded_m_s, horizon, rumble, bits, response = content[40:]
    state = bits % _STANDS
    if state >= len(_STATES) or bits >= 2 * _HINDERED:
        raise ValueError(f"bits = {bits}; valid: a state from 0 to {len(_STATES) - 1}, and two flags above it")
    horizon_m = horizon * STEP_M
    return StiffnessUpdate(
        message.header,
        TriggerField(
            _onset_distances(content[:8], horizon_m), _onset_distances(content[8:16], horizon_m), *content[32:36]
        ),
        TriggerField(
            _onset_distances(content[16:24], horizon_m), _onset_distances(content[24:32], horizon_m), *content[36:40]
        ),
        speed_m_s,
        horizon_m,
        rumble / 8.0,
        _STATES[state],
        commanded_m_s if commanded_m_s == commanded_m_s else None,  # noqa: PLR0124  # faster than a call
        bool(bits & _STANDS),
        bool(bits & _HINDERED),
        _unpack_around(behind) if behind else None,
        response / _RESPONSES,
    )


def _unpack_around(behind: bytes) -> Around:
    full_s, steps = _AROUND.unpack_from(behind)
    return Around(full_s, steps, behind[_AROUND.size :])


def _steps(onsets: OnsetDistances, horizon_m: float) -> list[int]:
    within = bisect_left(onsets, horizon_m)
    if not within:
        return _ALL_BEYOND
    steps = list(map(math.floor, map(_IN_STEPS, onsets[:within])))
    if steps[0] <= _PAST or steps[-1] > _FARTHEST:
        steps = [max(_PAST, min(step, _FARTHEST)) for step in steps]
    return steps + _ALL_BEYOND[within:]


def _onset_distances(steps: tuple[int, ...], horizon_m: float) -> OnsetDistances:
    if steps == _NOTHING_NEAR:
        return (horizon_m,) * 8
    onsets = tuple(map(_IN_METRES, steps))
    if steps[0] == _PAST or steps[-1] == _BEYOND:
        if steps != tuple(sorted(steps)):
            raise ValueError(f"distances = {steps}; valid: each at least as long as the one before")
        past, within = steps.count(_PAST), len(steps) - steps.count(_BEYOND)
        onsets = (_PAST_M,) * past + onsets[past:within] + (horizon_m,) * (len(steps) - within)
    if onsets[-1] > horizon_m:
        raise ValueError(f"distances = {onsets}; valid: none beyond the horizon, {horizon_m}")
    return onsets  # type: ignore[return-value]  # the format says eight


def _pack_telemetry(view: Telemetry) -> bytes:
    numbers: list[float] = []
    for name, count in _NUMBERS.items():
        value = getattr(view, name)
        numbers += [0.0] * count if value is None else value if isinstance(value, tuple) else (value,)
    bits = _STATES.index(view.state)
    for name, bit in _BITS.items():
        if getattr(view, name) not in (None, False):
            bits += bit
    try:
        return _TELEMETRY.pack(*numbers, bits)
    except OverflowError:
        # A simulation that becomes unstable has huge values, and must still be able to report that.
        return _TELEMETRY.pack(*(max(-_LARGEST_SINGLE, min(one, _LARGEST_SINGLE)) for one in numbers), bits)


def _unpack_telemetry(message: TelemetryOnWire) -> Telemetry:
    *numbers, bits = _TELEMETRY.unpack(message.field)
    state = bits % 4
    if state >= len(_STATES) or bits >= 4 << len(_BITS):
        raise ValueError(f"bits = {bits}; valid: a state from 0 to {len(_STATES) - 1}, and {len(_BITS)} flags above it")
    fields: dict[str, Any] = {name: bool(bits & _BITS[name]) for name in _TRUE}
    first = 0
    for name, count in _NUMBERS.items():
        known = name not in _KNOWN or bits & _BITS[name]
        fields[name] = None if not known else numbers[first] if count == 1 else tuple(numbers[first : first + count])
        first += count
    return Telemetry(message.header, state=_STATES[state], target=message.target, hindrance=message.hindrance, **fields)
