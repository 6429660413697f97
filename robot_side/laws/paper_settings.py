"""Settings of the paper's own law: what the paper leaves open."""

from dataclasses import dataclass
from typing import Annotated, Final, Literal

import tyro
from msgspec import Meta

PAPERS: Final = ("paper", "paper-isotropic")
"""Names of the paper's laws"""
EnlargementTime = Literal["always", "once"]
MARGIN_M: Final = 0.02
Share = Annotated[float, Meta(gt=0.0, le=1.0)]
BEST_SHARE: Final = 2e-5
"""f that prevents most contacts for the fewest false alarms, as chosen by: feelahead bench front"""


@dataclass(frozen=True)
class PaperSettings:
    """What §3.4 and §4.2 leave open."""

    share: float = BEST_SHARE
    """f: share of Σ_i V_i, the volume of all enlarged spheres, whose overlap gives full strength"""
    enlargement: EnlargementTime = "always"
    """always: D_incr follows pose, speed and loop age. once: it is computed once, for full speed (§3.4)"""
    margin_m: float = MARGIN_M
    """D_incr of the law `margin`"""

    def __str__(self) -> str:
        """Return the settings as figures and tables name them."""
        return f"f = {self.share:g}{', D_incr once' if self.enlargement == 'once' else ''}"


@dataclass(frozen=True)
class PaperFlags:
    """Flags of the paper's laws."""

    law_paper_share: Annotated[Share, tyro.conf.arg(metavar="F")] = BEST_SHARE
    """f of the paper's laws: share of the volume of the enlarged gripper, each sphere counted by itself, whose overlap
    gives full strength. The default is the best one found by: feelahead bench front."""
    enlargement: EnlargementTime = "always"
    """When the paper's laws compute D_incr (eq. 10). always: from pose, speed and loop age, 100 times a second. once:
    at the first look with a measured loop age, for full speed, as §3.4 of the paper says."""
    law_margin_m: Annotated[float, Meta(gt=0.0, le=0.5)] = MARGIN_M
    """Margin of the law `margin`. For a fair comparison, give it the mean enlargement of the law beside it."""

    @property
    def paper(self) -> PaperSettings:
        """Settings of the paper's laws"""
        return PaperSettings(self.law_paper_share, self.enlargement, self.law_margin_m)
