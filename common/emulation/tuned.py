"""Limits on what the operator may change in an emulated link during a run: only delay, jitter and loss, within bounds.

Traces are refused, because their file's name would let the other side open files here. Long delays are refused,
because no further change could arrive.
"""

import dataclasses
from typing import Final

from common.emulation.loss import RandomLoss
from common.emulation.profile import LinkProfile
from common.emulation.spec import LinkSpec
from common.errors import ConfigurationError

LONGEST_DELAY_S: Final = 0.5
LONGEST_JITTER_S: Final = 0.1
MOST_LOSS: Final = 0.2
_WORDS: Final = frozenset({"delay", "loss", "distribution", "uniform", "normal", "pareto", "paretonormal"})
_VALID: Final = (
    f"delay up to {1e3 * LONGEST_DELAY_S:g}ms, jitter up to {1e3 * LONGEST_JITTER_S:g}ms, distribution"
    f" uniform|normal|pareto|paretonormal, loss up to {100 * MOST_LOSS:g}%"
)


def tuned_link(link: LinkSpec, words: str) -> LinkSpec:
    """Return `link` with the profile `words` for both directions. ConfigurationError, in one line, beyond the limits.

    Clauses of `link` for telemetry and video are kept, such as a rate of video alone.
    """
    profile = tunable_profile(words)
    profile = dataclasses.replace(profile, model=link.model)
    kept = {name: one for name, one in link.clauses.items() if name.endswith(("telemetry", "video"))}
    return dataclasses.replace(link, clauses={"": profile} | kept)


def tunable_profile(words: str) -> LinkProfile:
    """Return the profile that `words` specify, if it is within the limits; errors as in `tuned_link`."""
    for word in words.split():
        if word not in _WORDS and not word[0].isdigit():
            raise ConfigurationError(f"link {words!r}: {word!r} cannot be tuned; valid: {_VALID}")
    profile = LinkProfile.parse(words)
    if not (profile.loss is None or type(profile.loss) is RandomLoss):
        raise ConfigurationError(f"link {words!r}: cannot be tuned; valid: {_VALID}")
    loss = 0.0 if profile.loss is None else profile.loss.share()
    if profile.delay_s > LONGEST_DELAY_S or profile.jitter_s > LONGEST_JITTER_S or loss > MOST_LOSS:
        raise ConfigurationError(f"link {words!r}: too much of it to tune; valid: {_VALID}")
    return profile
