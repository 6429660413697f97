"""Description of an invalid value in a TOML file, in one line: the key, the value, and what is valid."""

import dataclasses
import json
import re
import types
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta

from common.limits import range_in_words

_LONGEST_VALUE = 100


def explain(complaint: str, content: Mapping[str, Any], settings_type: type) -> str:
    """Return one line that explains msgspec's `complaint`, its error in converting `content` to `settings_type`."""
    said, _, path = complaint.partition(" - at `$.")
    place, value, hint = _followed(re.findall(r"\w+|\[.*?\]", path), content, settings_type)
    if not place:
        return complaint
    if not said.startswith(("Expected", "Invalid enum value")):
        # A dataclass's error about its fields, which names what is valid.
        return f"{place}: {said}"
    shown = json.dumps(value, default=str, ensure_ascii=False)
    if len(shown) > _LONGEST_VALUE:
        shown = f"{shown[:_LONGEST_VALUE]}..."
    return f"{place} = {shown}; valid: {_valid(hint)}"


def _followed(path: Sequence[str], value: Any, hint: Any) -> tuple[str, Any, Any]:
    """Return place, value and type of what a complaint's path leads to; of values that are no tables, all of them."""
    place = ""
    for step in path:
        if not step.startswith("["):
            value, hint = value[step], get_type_hints(_bare(hint), include_extras=True)[step]
            place = f"{place}.{step}" if place else step
            continue
        tables = [kind for kind in get_args(_bare(hint)) if dataclasses.is_dataclass(_bare(kind))]
        if not tables:
            break
        table = tables[0]
        # The complaint has the number of a list's table, but not the name of a table's.
        names = [name for name, part in value.items() if _fails(part, table)] if isinstance(value, Mapping) else []
        place += f".{names[0]}" if names else step
        value, hint = value[names[0] if names else int(step[1:-1])], table
    return place, value, hint


def _bare(hint: Any) -> Any:
    """Return a type without its notes, and without None."""
    if get_origin(hint) is Annotated:
        return _bare(get_args(hint)[0])
    if get_origin(hint) in (Union, types.UnionType):
        return _bare(next(argument for argument in get_args(hint) if argument is not type(None)))
    return hint


def _fails(value: object, kind: Any) -> bool:
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return True
    return False


def _valid(hint: Any) -> str:
    """Describe the valid values of the type `hint`."""
    words = {float: "a number", int: "a whole number", bool: "true or false", str: "a text", Path: "a path, as a text"}
    if hint in words:
        return words[hint]
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return next((range_in_words(note) for note in arguments[1:] if isinstance(note, Meta)), _valid(arguments[0]))
    if origin is Literal:
        return " or ".join(json.dumps(choice) for choice in arguments)
    if origin in (Union, types.UnionType):
        return " or ".join(_valid(argument) for argument in arguments if argument is not type(None))
    if origin in (tuple, dict):
        items = ["..." if argument is Ellipsis else _valid(argument) for argument in arguments]
        return f"[{', '.join(items)}]" if origin is tuple else f"a table of NAME = {items[1]}"
    if isinstance(hint, type) and issubclass(hint, Enum):
        return " or ".join(json.dumps(choice.value) for choice in hint)
    if dataclasses.is_dataclass(hint):
        return f"a table with {', '.join(sorted(get_type_hints(hint)))}"
    return getattr(hint, "__name__", str(hint))
