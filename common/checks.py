"""What records and functions require of what they get: ValueError that names it, its value and what is valid.

A value that passes can be packed: a type hint does not keep a float out of a field for an integer.
"""

import math


def check_integer(name: str, value: object, lowest: int, highest: int) -> None:
    """An integer from `lowest` to `highest`."""
    if not isinstance(value, int) or not lowest <= value <= highest:
        raise ValueError(f"{name} = {value!r}; valid: an integer from {lowest} to {highest}")


def check_integers(name: str, values: object, count: int, lowest: int, highest: int) -> None:
    """A tuple of so many integers from `lowest` to `highest`."""
    if not isinstance(values, tuple) or len(values) != count:
        raise ValueError(f"{name} = {values!r}; valid: a tuple of {count} integers from {lowest} to {highest}")
    for index, value in enumerate(values):
        check_integer(f"{name}[{index}]", value, lowest, highest)


def check_number(name: str, value: object, lowest: float, highest: float) -> None:
    """A number from `lowest` to `highest`."""
    if not isinstance(value, int | float) or not lowest <= value <= highest:
        raise ValueError(f"{name} = {value!r}; valid: {lowest:g} to {highest:g}")


def check_numbers(name: str, values: object, count: int, lowest: float, highest: float) -> None:
    """A tuple of so many numbers from `lowest` to `highest`; without bounds (infinite ones) they are finite."""
    if isinstance(values, tuple) and len(values) == count:
        for value in values:
            if not (isinstance(value, int | float) and math.isfinite(value) and lowest <= value <= highest):
                break
        else:
            return
    bounds = "finite" if math.isinf(highest) else f"{lowest:g} to {highest:g}"
    raise ValueError(f"{name} = {values!r}; valid: a tuple of {count} numbers, each {bounds}")


def check_kind(name: str, value: object, kind: type) -> None:
    """An instance of a class."""
    if not isinstance(value, kind):
        raise ValueError(f"{name} = {value!r}; valid: a {kind.__name__}")
