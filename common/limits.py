"""Check that the fields of a dataclass or struct are within the ranges that their type hints declare.

    @dataclass(frozen=True)
    class SafetySettings(Limited):
        gap_s: Annotated[float, Meta(gt=0.0, lt=60.0)] = 0.1

msgspec uses the same `Meta` to decode a message or a TOML file, so that a range is declared once. NaN is in no range.
`Finite` is any number but NaN and the infinities.
"""

import functools
import sys
from collections.abc import Callable, Mapping
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from msgspec import Meta

Finite = Annotated[float, Meta(ge=-sys.float_info.max, le=sys.float_info.max)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
"""Probability, or share of a whole: 0 to 1, both included."""

_Check = Callable[[str, Any], None]


def check_limits(record: Any) -> None:
    """Raise ValueError if a field of `record` is out of range; it names the field, its value and what is valid."""
    kind: Any = type(record)
    for name, check in _checks(kind):
        check(name, getattr(record, name))


class Limited:
    """Base of dataclasses whose fields' ranges are checked when an instance is made."""

    __slots__ = ()

    def __post_init__(self) -> None:
        check_limits(self)


def check_value(name: str, value: object, hint: object) -> None:
    """Raise ValueError, which names `name`, if `value` lies outside the range that the type hint declares."""
    check = _check_of(hint)
    if check is not None:
        check(name, value)


def range_in_words(meta: Meta) -> str:
    """Describe the values that a `Meta` allows, such as "above 0 and below 60"."""
    if meta.ge == -sys.float_info.max and meta.le == sys.float_info.max:
        return "a finite number"
    if meta.max_length is not None:
        return f"{meta.min_length or 0} to {meta.max_length} characters"
    if meta.ge is not None and meta.le is not None:
        return f"{_number(meta.ge)} to {_number(meta.le)}"
    words = {"above": meta.gt, "at least": meta.ge, "below": meta.lt, "at most": meta.le}
    return " and ".join(f"{word} {_number(bound)}" for word, bound in words.items() if bound is not None)


@functools.cache
def _checks(kind: Any) -> tuple[tuple[str, _Check], ...]:
    hints = get_type_hints(kind, include_extras=True)
    return tuple((name, check) for name, hint in hints.items() if (check := _check_of(hint)) is not None)


def _check_of(hint: Any) -> _Check | None:
    """Return a function that checks a value against one type hint; None if the hint declares no range."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        metas = [meta for meta in arguments[1:] if isinstance(meta, Meta)]
        return _range_check(metas[0], arguments[0]) if metas else _check_of(arguments[0])
    if origin in (Union, UnionType):
        checks = {get_origin(one) is tuple: check for one in arguments[::-1] if (check := _check_of(one)) is not None}
        return _optional_check(checks) if checks and type(None) in arguments else None
    if origin is tuple:
        check = _check_of(arguments[0])
        return None if check is None else _elements_check(check)
    return None


def _range_check(meta: Meta, kind: type) -> _Check:
    # No comparison with NaN is true.
    low = -sys.float_info.max if meta.ge is None else meta.ge
    high = sys.float_info.max if meta.le is None else meta.le
    above, below = meta.gt, meta.lt
    kinds = (int,) if kind is int else (int, float)

    def check(name: str, value: Any) -> None:
        if not (
            isinstance(value, kinds)
            and low <= value <= high
            and (above is None or value > above)
            and (below is None or value < below)
        ):
            whole = "a whole number " if kind is int and not isinstance(value, int) else ""
            raise ValueError(f"{name} = {value!r}; valid: {whole}{range_in_words(meta)}")

    def check_length(name: str, value: Any) -> None:
        if not isinstance(value, str) or not (meta.min_length or 0) <= len(value) <= (meta.max_length or sys.maxsize):
            raise ValueError(f"{name} = {value!r:.100}; valid: {range_in_words(meta)}")

    return check_length if kind is str else check


def _optional_check(checks: Mapping[bool, _Check]) -> _Check:
    """Return a check of an optional value. checks: of a tuple (True), and of a single value (False)."""

    def check_unless_none(name: str, value: Any) -> None:
        if value is not None:
            checks.get(isinstance(value, tuple), next(iter(checks.values())))(name, value)

    return check_unless_none


def _elements_check(check: _Check) -> _Check:
    def check_each(name: str, values: Any) -> None:
        try:
            for value in values:
                check(name, value)
        except ValueError:
            for place, value in enumerate(values):
                check(f"{name}[{place}]", value)

    return check_each


def _number(value: float) -> str:
    return f"{value:g}" if abs(value) < 1e6 or value != int(value) else f"{int(value)}"
