"""Trigger field with the same strength in every zone, at every distance and speed."""

from typing import Final

from common.protocol.messages import OnsetDistances, TriggerField

STRENGTHS: Final = 8
FAR_M: Final = 10.0
"""Horizon of a uniform field, in metres: farther than the gripper moves within a reaction time."""


def uniform_field(strength: int, full_speed_m_s: float = 0.25, acceleration_m_s2: float = 3.0) -> TriggerField:
    """Return a trigger field that has `strength` (0 to 8) at every speed; raises ValueError outside that range."""
    if not 0 <= strength <= STRENGTHS:
        raise ValueError(f"strength = {strength}; valid: 0 to {STRENGTHS}")
    near, far = (-FAR_M,) * strength, (FAR_M,) * (STRENGTHS - strength)
    onsets: OnsetDistances = (*near, *far)  # type: ignore[assignment]
    return TriggerField(
        fast_m=onsets,
        slow_m=onsets,
        full_speed_m_s=full_speed_m_s,
        acceleration_m_s2=acceleration_m_s2,
        displacement_m=0.0,
        course_stiffness=strength / STRENGTHS,
    )
