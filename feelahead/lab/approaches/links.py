"""Refuse links whose delay is so long that the robot side can never be armed."""

from common.emulation.clauses import LinkModel
from common.emulation.spec import LinkSpec

_LONGEST_LOOP_S = 2.0
"""Loop age, in seconds, from which on the robot side is never armed (SafetySettings.max_delay_s)."""


def mean_loop_s(spec: str, link_model: LinkModel) -> float:
    """Return the sum of both directions' mean delays, in seconds; ConfigurationError for an invalid link."""
    link = LinkSpec.parse(spec, 0, link_model)
    return sum(link.profile(direction).mean_delay_s() for direction in ("to_robot", "to_operator"))


def require_young_loop(spec: str, link_model: LinkModel) -> None:
    """Raise ValueError if the link's delay prevents arming for ever, ConfigurationError for an invalid link."""
    loop_s = mean_loop_s(spec, link_model)
    if loop_s >= _LONGEST_LOOP_S:
        raise ValueError(
            f"--link {spec!r}: a message and its answer take {loop_s:g} s; valid: below {_LONGEST_LOOP_S:g} s, beyond"
            " which the robot side is never armed"
        )
