"""A fixed margin, to compare with: what stands within a distance is felt, however fast and late everything is."""

from dataclasses import replace

from common.protocol.uniform_field import FAR_M, uniform_field
from robot_side.ahead.law import Law, Sensed, Situation


class MarginLaw:
    """The ways of another law, felt at every travel as soon as they are no longer than the margin."""

    def __init__(self, law: Law, margin_m: float) -> None:
        self._law = law
        self._margin_m = margin_m

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Work out one tick."""
        sensed = self._law.sense(situation, now_s)
        l2, r2 = (
            uniform_field(
                sum(way <= self._margin_m for way in field.fast_m), field.full_speed_m_s, field.acceleration_m_s2
            )
            for field in (sensed.l2, sensed.r2)
        )
        return replace(sensed, l2=l2, r2=r2, horizon_m=FAR_M)

    def summary(self) -> dict[str, int]:
        """The other law's."""
        return self._law.summary()
