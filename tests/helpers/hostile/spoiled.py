"""Spoiled MessagePack, as hypothesis draws it: any values, and valid messages with a fault."""

import math
from collections.abc import Iterator
from copy import deepcopy
from typing import Any, Final

import msgpack
from hypothesis import strategies as st

ODD: Final = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, -1, 2**31, 2**53 + 1, -(2**63), 2**64 - 1)
"""Numbers at the edges of what is representable, and beyond what is meant"""
LIES: Final = (
    *(head + b"\xff\xff\xff\xff" for head in (b"\xdd", b"\xdf", b"\xc6", b"\xdb", b"\xc9")),
    *(b"\x91" * 3000, b"\x81\xa0" * 3000, b"\x81\x80" * 3000, b"\xdc\xff\xff", b"\xc1"),
)
"""Lengths of lists, maps, bytes, texts and extensions that nothing follows; deep nesting; and no value at all"""
_HERE: Final = "\0here\0"
_LONG: Final = "\x1b" * 50_000

nested = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(max_size=8) | st.binary(),
    lambda inner: st.lists(inner, max_size=6) | st.dictionaries(st.text(max_size=4), inner, max_size=4),
    max_leaves=20,
)
"""Any content of a message"""
_values = nested | st.just(_LONG) | st.builds(msgpack.ExtType, st.integers(0, 127), st.binary(max_size=20))


def _places(content: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each list or map inside with each of its indices or keys."""
    for key in list(content) if isinstance(content, dict) else range(len(content)):
        yield content, key
        if isinstance(content[key], dict | list):
            yield from _places(content[key])


_FAULTS: Final = {
    **{"noise": object, "bytes": object, "value": object, "lie": object, "name": object, "gone": object},
    **{"number": int | float, "size": bytes | str | list},
}
"""Faults, and of what kind a field has to be for each"""


@st.composite
def spoiled(draw: st.DrawFn, valid: dict[str, Any]) -> bytes:
    """Return noise, or the message with one fault: of its bytes, or of a field or an item at any depth.

    valid: of maps and lists.
    """
    fault, content, lie = draw(st.sampled_from(list(_FAULTS))), deepcopy(valid), b""
    fitting = [(one, key) for one, key in _places(content) if isinstance(one[key], _FAULTS[fault])]
    inside, key = draw(st.sampled_from(fitting))
    was = inside[key]
    if fault == "noise":
        return draw(st.binary(max_size=300))
    if fault == "number":
        inside[key] = draw(st.sampled_from(ODD))
    elif fault == "value":
        inside[key] = draw(_values)
    elif fault == "lie":
        inside[key], lie = _HERE, draw(st.sampled_from(LIES))
    elif fault == "size":
        inside[key] = draw(st.sampled_from([was[:-1], was[1:], was * 2, was * 300]))
    elif fault == "gone" or (fault == "name" and isinstance(inside, list)):
        del inside[key]
    elif fault == "name":
        inside[draw(st.just(_LONG) | st.text(max_size=3) | st.integers(-3, 2**63))] = inside.pop(key)
    packed = bytearray(msgpack.packb(content).replace(msgpack.packb(_HERE), lie))
    if fault == "bytes":
        for _ in range(draw(st.integers(1, 3))):
            place = draw(st.integers(0, len(packed)))
            packed[place : place + draw(st.integers(0, 3))] = draw(st.binary(max_size=3))
    return bytes(packed)
