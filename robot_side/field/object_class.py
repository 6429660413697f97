"""Classes of objects: how a look along a direction treats each of them."""

from typing import Final

OBSTACLE: Final = 0
TOUCHABLE: Final = 1
"""Object that is to be touched: a support, while an object is held"""
TARGET: Final = 2
"""Object that is to be touched: a finger's inflation towards it ends at half the gap."""
SKIPPED: Final = 3
"""Object that is ignored or held"""
