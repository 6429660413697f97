"""Reading of TOML files, with each fault described in one line."""

import tomllib
from pathlib import Path
from typing import Any, Final

from common.files.regular_file import read_regular_file

_LARGEST_INTEGER: Final = 2**63
"""Bound of TOML's integers, which have 64 bits; larger ones are refused, as later code cannot use them."""
_DEEPEST: Final = 50
"""Maximum number of nested levels: settings need a few, and later code may recurse into them."""
_LONGEST_COMPLAINT: Final = 400
_TOO_DEEP: Final = f"is nested too deeply; valid: {_DEEPEST} levels"
_TOO_LARGE: Final = "has a whole number of more than 64 bits, which is no valid TOML"


def read_toml(path: Path, largest_bytes: int) -> dict[str, Any]:
    """Return the content of the regular file `path`.

    Raises OSError if the system refuses; ValueError, in one line without the path, if the file is not regular (a pipe
    might never end), has more than `largest_bytes`, or is no valid TOML.
    """
    data = read_regular_file(path, largest_bytes)
    try:
        content = tomllib.loads(data.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"is no valid TOML: {' '.join(str(error).split())[:_LONGEST_COMPLAINT]}") from error
    except RecursionError as error:
        raise ValueError(_TOO_DEEP) from error
    except ValueError as error:
        # Python's limit on the digits of a number, whose text is for programmers.
        raise ValueError(_TOO_LARGE) from error
    _refuse_extremes(content)
    return content


def _refuse_extremes(content: dict[str, Any]) -> None:
    waiting: list[tuple[Any, int]] = [(content, 0)]
    while waiting:
        value, depth = waiting.pop()
        if depth > _DEEPEST:  # dotted keys pass the parser's limit
            raise ValueError(_TOO_DEEP)
        if isinstance(value, dict | list):
            waiting += [(part, depth + 1) for part in (value.values() if isinstance(value, dict) else value)]
        elif isinstance(value, int) and not -_LARGEST_INTEGER <= value < _LARGEST_INTEGER:
            raise ValueError(_TOO_LARGE)
