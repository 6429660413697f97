"""The official trigger effects as values: what may be asked of an adaptive trigger, and its exact eleven bytes.

A value can encode no code but the four official ones, and in a file of their own the unofficial ones, so that the
debug codes cannot be made at all. `zone_strengths` of each is what holds against the finger in the ten zones.
"""

from collections.abc import Callable
from typing import Final, Literal, overload

from common.errors import RemoteProtocolError
from operator_side.dualsense.effects.effect_codes import FEEDBACK_CODE, OFF_CODE, VIBRATION_CODE, WEAPON_CODE
from operator_side.dualsense.effects.resisting_effects import (
    Feedback,
    MultiPositionFeedback,
    Off,
    SlopeFeedback,
    Weapon,
)
from operator_side.dualsense.effects.unofficial_effects import UNOFFICIAL_DECODERS, UnofficialEffect
from operator_side.dualsense.effects.vibration_effects import MultiPositionVibration, Vibration
from operator_side.dualsense.effects.zone_packing import (
    EFFECT_LENGTH,
    MAX_STRENGTH,
    ZONE_COUNT,
    one_step,
    stray,
    unpack_ends,
    unpack_zones,
)

__all__ = [
    "EFFECT_LENGTH",
    "MAX_STRENGTH",
    "ZONE_COUNT",
    "AnyEffect",
    "Feedback",
    "MultiPositionFeedback",
    "MultiPositionVibration",
    "Off",
    "SlopeFeedback",
    "TriggerEffect",
    "Vibration",
    "Weapon",
    "decode_effect",
]

TriggerEffect = Off | Feedback | MultiPositionFeedback | SlopeFeedback | Weapon | Vibration | MultiPositionVibration
AnyEffect = TriggerEffect | UnofficialEffect


@overload
def decode_effect(encoded: bytes, *, unofficial: Literal[False] = False) -> TriggerEffect: ...
@overload
def decode_effect(encoded: bytes, *, unofficial: bool) -> AnyEffect: ...
def decode_effect(encoded: bytes, *, unofficial: bool = False) -> AnyEffect:
    """Read the eleven bytes that `encode` makes; whatever decodes, encodes to the same bytes again.

    Where several values have the same bytes (a slope, a one-step profile) they decode to the simplest of them:
    one step, then multi-position. `unofficial`: accept those effects, too. RemoteProtocolError for another length
    or code, and for stray bits outside the packing.
    """
    if len(encoded) != EFFECT_LENGTH:
        raise RemoteProtocolError(f"a trigger effect of {len(encoded)} bytes; valid: {EFFECT_LENGTH}")
    code = encoded[0]
    decoder: Callable[[bytes], AnyEffect] | None = _DECODERS.get(code)
    if decoder is None and unofficial:
        decoder = UNOFFICIAL_DECODERS.get(code)
    if decoder is None:
        valid = ", ".join(f"0x{known:02x}" for known in (*_DECODERS, *(UNOFFICIAL_DECODERS if unofficial else ())))
        raise RemoteProtocolError(f"trigger effect code 0x{code:02x}; valid: {valid}")
    try:
        effect = decoder(encoded)
    except ValueError as error:  # a field out of its range
        raise stray(encoded) from error
    if effect.encode() != encoded:
        raise stray(encoded)
    return effect


def _decode_off(encoded: bytes) -> Off:
    del encoded
    return Off()


def _decode_feedback(encoded: bytes) -> Feedback | MultiPositionFeedback:
    strengths, _ = unpack_zones(encoded)
    simple = Feedback(*one_step(strengths))
    return simple if simple.zone_strengths == strengths else MultiPositionFeedback(strengths)


def _decode_weapon(encoded: bytes) -> Weapon:
    return Weapon(*unpack_ends(encoded), encoded[3] + 1)


def _decode_vibration(encoded: bytes) -> Vibration | MultiPositionVibration:
    amplitudes, frequency_hz = unpack_zones(encoded)
    simple = Vibration(*one_step(amplitudes), frequency_hz)
    return simple if simple.zone_amplitudes == amplitudes else MultiPositionVibration(amplitudes, frequency_hz)


_DECODERS: Final[dict[int, Callable[[bytes], TriggerEffect]]] = {
    OFF_CODE: _decode_off,
    FEEDBACK_CODE: _decode_feedback,
    WEAPON_CODE: _decode_weapon,
    VIBRATION_CODE: _decode_vibration,
}
