"""Classes of objects: how a look along a direction treats each of them."""

from typing import Final

OBSTACLE: Final = 0
TOUCHABLE: Final = 1
"""It is to be touched: a support, while something is held."""
TARGET: Final = 2
"""It is to be touched: a finger's inflation towards it ends at half the gap."""
PASSED_OVER: Final = 3
"""Ignored, or held."""
