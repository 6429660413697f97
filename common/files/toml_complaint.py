"""Description of an invalid value in a TOML file, in one line: the key, the value, and what is valid."""

import dataclasses
import json
import re
import types
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from msgspec import Meta

from common.limits import range_in_words

_LONGEST_VALUE = 100


def explain(complaint: str, content: Mapping[str, Any], settings_type: type) -> str:
    """Return one line that explains msgspec's `complaint`, its error in converting `content` to `settings_type`."""
    said, _, path = complaint.partition(" - at `$.")
    keys = re.findall(r"\w+", path.partition("[")[0].rstrip("`"))
    if not keys:
        return complaint
    value: Any = content
    hint: Any = settings_type
    for key in keys:
        settings = get_args(hint)[0] if get_origin(hint) is Annotated else hint
        value, hint = value[key], get_type_hints(settings, include_extras=True)[key]
    if not said.startswith(("Expected", "Invalid enum value")):
        # A dataclass's error about its fields, which names what is valid.
        return f"{'.'.join(keys)}: {said}"
    shown = json.dumps(value, default=str, ensure_ascii=False)
    if len(shown) > _LONGEST_VALUE:
        shown = f"{shown[:_LONGEST_VALUE]}..."
    return f"{'.'.join(keys)} = {shown}; valid: {_valid(hint)}"


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
