"""A fixed margin, for comparison: the paper's law with one enlargement, whatever errors, speed and delay are.

A warning by distance alone does this. With the mean enlargement of another law it compares to that one.
"""

import numpy as np

from common.arrays import FloatArray
from common.protocol.view_messages import EnlargementTerms
from robot_side.laws.paper import PaperLaw
from robot_side.tick.situation import Situation


class MarginLaw(PaperLaw):
    """The paper's law with D_incr = `law_margin_m`."""

    def _enlarged(self, situation: Situation, camera: tuple[float, float]) -> tuple[FloatArray, EnlargementTerms]:
        """Return the margin for each sphere (m,), and its terms: a mean, and nothing that varies."""
        del camera
        margin_m = self._inputs.paper.margin_m
        terms = EnlargementTerms(margin_m, margin_m, 0.0, 0.0, 0.0, 0.0, situation.loop_age_s, 0.0)
        return np.full(len(situation.pose.sphere_radii_m), margin_m), terms
