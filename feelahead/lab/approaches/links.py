"""Links over which the robot side can be armed."""

from common.emulation.clauses import LinkModel
from common.emulation.spec import LinkSpec

_LONGEST_LOOP_S = 2.0
"""Loop age from which the robot side is never armed, in seconds (SafetySettings.max_delay_s)."""


def mean_loop_s(spec: str, link_model: LinkModel) -> float:
    """Sum the mean delays of both directions, in seconds; ConfigurationError for a bad link."""
    link = LinkSpec.parse(spec, 0, link_model)
    return sum(link.profile(direction).mean_delay_s() for direction in ("to_robot", "to_operator"))


def require_young_loop(spec: str, link_model: LinkModel) -> None:
    """Raise ValueError for a link over which the robot side is never armed, ConfigurationError for a bad one."""
    loop_s = mean_loop_s(spec, link_model)
    if loop_s >= _LONGEST_LOOP_S:
        raise ValueError(
            f"--link {spec!r}: a message and its answer take {loop_s:g} s; valid: below {_LONGEST_LOOP_S:g} s, beyond"
            " which the robot side is never armed"
        )
