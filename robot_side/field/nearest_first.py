"""Queue of numbered items in two arrays: a binary heap with the item of the least key first, of these the least number.

So the order does not depend on when items were added.
"""

from common.arrays import FloatArray, IntArray
from robot_side.compiled.kernel import building_block, inlined


@inlined
def _is_before(keys: FloatArray, items: IntArray, place: int, key: float, item: int) -> bool:
    before: bool = keys[place] < key or (keys[place] == key and items[place] < item)
    return before


@building_block
def push(keys: FloatArray, items: IntArray, count: int, key: float, item: int) -> int:
    """Add an item with its key to a queue of `count` items; return the new count."""
    place = count
    while place > 0 and not _is_before(keys, items, (place - 1) // 2, key, item):
        above = (place - 1) // 2
        keys[place], items[place] = keys[above], items[above]
        place = above
    keys[place], items[place] = key, item
    return count + 1


@building_block
def drop_first(keys: FloatArray, items: IntArray, count: int) -> int:
    """Remove the first item, that of the least key, from a queue of `count` items; return the new count."""
    left, place = count - 1, 0
    key, item = keys[left], items[left]
    while 2 * place + 1 < left:
        below = 2 * place + 1
        if below + 1 < left and _is_before(keys, items, below + 1, keys[below], items[below]):
            below += 1
        if not _is_before(keys, items, below, key, item):
            break
        keys[place], items[place] = keys[below], items[below]
        place = below
    keys[place], items[place] = key, item
    return left
