"""Classes of objects: how a look along a direction treats each of them."""

from typing import Final

OBSTACLE: Final = 0
TOUCHABLE: Final = 1
"""Object that is to be touched: a support, while an object is held"""
TARGET: Final = 2
"""Object that is to be grasped. The inflation of a finger's sphere towards it is at most half the gap (§3.4)."""
SKIPPED: Final = 3
"""Object that is ignored or held"""
