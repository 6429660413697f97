"""Sources of a kernel: the files of all functions that are compiled with it, and the constants that these read."""

import functools
import hashlib
import inspect
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, cast

import numpy as np

_OURS = frozenset({"common", "robot_side"})
_COMPILERS = ("kernel.py", "numba_inside.py")
"""Files beside this one that affect the compilation of all kernels"""


def sources(function: Callable[..., Any]) -> frozenset[Path]:
    """Return the source files of `function` and of every function of ours that it uses, directly or through others.

    The files may be in any folder. If a function names a whole module, all that this module names counts, too.
    """
    here = Path(__file__).parent
    return frozenset(here / name for name in _COMPILERS) | {
        Path(file) for part in _parts(function) if (file := _file(part)) is not None
    }


def digest(function: Callable[..., Any]) -> str:
    """Return a digest of `sources(function)` and of the values of the constants that its parts read by name.

    Constants are included by value, because a number does not tell from which file it was imported.
    """
    result = hashlib.sha256()
    for path in sorted(sources(function)):
        result.update("/".join(path.parts[-2:]).encode() + b"\0" + _content(path) + b"\0")
    for line in sorted(_constants(function)):
        result.update(line.encode() + b"\0")
    return result.hexdigest()


@functools.cache
def _content(path: Path) -> bytes:
    return path.read_bytes()


def _parts(function: Callable[..., Any]) -> set[Any]:
    """Return every function, class and module of ours that the compilation of `function` uses."""
    found: set[Any] = set()
    waiting: list[Any] = [inspect.unwrap(function)]
    while waiting:
        part = waiting.pop()
        if part not in found:
            found.add(part)
            if isinstance(part, FunctionType):
                waiting += [named for _, value in _named(part) if (named := _ours(value, part)) is not None]
            elif isinstance(part, ModuleType):
                named_there = (_ours(value, part) for value in vars(part).values())
                waiting += [named for named in named_there if named is not None]
    return found


def _ours(value: object, user: FunctionType | ModuleType) -> Any:
    """Return the function, class or module behind a value that `user` names, if it is ours; else None."""
    if isinstance(value, ModuleType):
        return value if value.__name__.partition(".")[0] in _OURS else None
    if hasattr(value, "__wrapped__"):
        # Numba's dispatchers and intrinsics wrap the function that they were made from.
        return inspect.unwrap(cast(Callable[..., Any], value))
    if not isinstance(value, FunctionType | type):
        return None
    of_user = user.__name__ if isinstance(user, ModuleType) else user.__module__
    return value if value.__module__ == of_user or value.__module__.partition(".")[0] in _OURS else None


def _named(function: FunctionType) -> Iterator[tuple[str, object]]:
    """Yield name and value of each global, and of each variable of an enclosing function, that `function` names."""
    for name in _names(function.__code__):
        if name in function.__globals__:
            yield name, function.__globals__[name]
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents


def _names(code: CodeType) -> set[str]:
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            names |= _names(constant)
    return names


def _constants(function: Callable[..., Any]) -> Iterator[str]:
    for part in _parts(function):
        if isinstance(part, FunctionType):
            for name, value in _named(part):
                text = _value(value)
                if text is not None:
                    yield f"{part.__module__}.{part.__qualname__}: {name} = {text}"


def _value(value: object) -> str | None:
    """Return the value as a text that is the same in every process; None if it is no constant."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, tuple):
        parts = [_value(part) for part in value]
        return None if None in parts else f"({', '.join(map(str, parts))})"
    return repr(value) if isinstance(value, bool | int | float | complex | str | np.generic | np.dtype) else None


def _file(part: Any) -> str | None:
    if isinstance(part, FunctionType):
        return part.__code__.co_filename
    name = part.__name__ if isinstance(part, ModuleType) else part.__module__
    return getattr(sys.modules.get(name), "__file__", None)
