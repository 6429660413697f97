"""Parts of others, found by name: built in, installed with an entry point, or in a file of one's own.

A kind is `law`, `controller`, `arm`, `perception`, `person` or `question`. A package registers a part in the entry
points' group `feelahead.laws` (`feelahead.controllers` and so on). A file defines it under the kind's name.
"""

import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from common.errors import ConfigurationError

PLURALS: Final[Mapping[str, str]] = {
    "law": "laws",
    "controller": "controllers",
    "arm": "arms",
    "perception": "perceptions",
    "person": "people",
    "question": "questions",
}
"""Names of the entry points' groups, after `feelahead.`, by kind"""
_LONGEST_FAULT: Final = 200
_OBJECT: Final = "object:"
_OURS: Final = Path(__file__).parents[2]


@dataclass(frozen=True)
class Installed:
    """Part that an installed package registers."""

    kind: str
    name: str
    package: str
    fault: str | None
    """Why it cannot be used, in one line; None if it can"""


def find(kind: str, name: str, built_in: Mapping[str, object]) -> object:
    """Return the part that `name` names; ConfigurationError for one that is unknown or cannot be loaded.

    A name that ends in .py is a file. Built-in names come before those of packages.
    """
    if name in built_in:
        return built_in[name]
    if name.endswith(".py"):
        return load_file(kind, Path(name))
    found = {point.name: point for point in _points(kind)}
    if name not in found:
        raise _unknown(kind, name, [*built_in, *found])
    try:
        part: object = found[name].load()
    except Exception as error:  # a package of somebody else's
        raise ConfigurationError(f"{kind} {name}, of {_package(found[name])}: {fault_in_words(error)}") from error
    return part


def known(kind: str) -> list[str]:
    """Return the names that installed packages register, without loading anything."""
    return [point.name for point in _points(kind)]


def object_name(part: object) -> str:
    """Return the name under which a part that was given as an object is recorded; nothing is found by it."""
    return f"{_OBJECT}{getattr(part, '__qualname__', type(part).__qualname__)}"


def is_elsewhere(name: str) -> bool:
    """Return whether a recorded name is that of a file or an object, neither of which belongs to this machine."""
    return name.endswith(".py") or name.startswith(_OBJECT)


def require_name(kind: str, name: str, built_in: Collection[str]) -> None:
    """Raise ConfigurationError unless `name` is known, or a file; no file is read, and nobody's code is run."""
    if name not in built_in and not is_elsewhere(name) and name not in (others := known(kind)):
        raise _unknown(kind, name, [*built_in, *others])


def load_file(kind: str, path: Path) -> object:
    """Return what the Python file defines as `kind`; ConfigurationError if it cannot be loaded or defines none.

    The file is run anew in each call, so that a change counts. It may import files beside it.
    """
    valid = f"a Python file that defines {kind}"
    if not path.is_file():
        raise ConfigurationError(f"{kind} {path}: there is no such file; valid: {valid}")
    folder = str(path.absolute().parent)
    if folder not in sys.path:
        sys.path.append(folder)  # behind all others: no file beside it hides a module of Python's or ours
    spec = spec_from_file_location(f"feelahead_{kind}_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ConfigurationError(f"{kind} {path}: cannot be loaded; valid: {valid}")
    module = sys.modules[spec.name] = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # anybody's code
        raise ConfigurationError(f"{kind} {path}: {fault_in_words(error)}") from error
    if not hasattr(module, kind):
        raise ConfigurationError(f"{kind} {path}: the file defines no {kind}; valid: {valid}")
    part: object = getattr(module, kind)
    return part


def made_of(kind: str, given: object, simulated: Any, methods: Mapping[str, str]) -> Any:
    """Return the part that `given`, a function, a name or a file, makes of the simulated one; that one if None.

    ConfigurationError if it makes none, or one that lacks a method.
    """
    if given is None:
        return simulated
    makes = find(kind, str(given), {}) if isinstance(given, str | Path) else given
    if not callable(makes):
        raise ConfigurationError(
            f"{kind}: is of type {type(makes).__name__}; valid: a function that takes the simulated one"
        )
    try:
        part = makes(simulated)
    except Exception as error:  # anybody's code
        raise ConfigurationError(f"{kind}: {fault_in_words(error)}") from error
    require_methods(kind, part, methods)
    return part


def installed(built_in: Mapping[str, Collection[str]] = MappingProxyType({})) -> list[Installed]:
    """Return the parts that installed packages register; each is loaded to find its fault.

    built_in: names of our own parts, by kind; each hides a part of the same name.
    """
    found = []
    for kind in PLURALS:
        for point in _points(kind):
            fault = f"the built-in {kind} {point.name} hides it" if point.name in built_in.get(kind, ()) else None
            try:
                point.load()
            except Exception as error:  # a package of somebody else's
                fault = fault_in_words(error)
            found.append(Installed(kind, point.name, _package(point), fault))
    return found


def require_methods(what: str, part: object, methods: Mapping[str, str]) -> None:
    """Raise ConfigurationError if `part` lacks one of the methods, which are given with their arguments in words."""
    lacking = [f"{name}({arguments})" for name, arguments in methods.items() if not callable(getattr(part, name, None))]
    if lacking:
        raise ConfigurationError(
            f"{what}: {type(part).__name__} lacks {', '.join(lacking)}; valid: an object with"
            f" {', '.join(f'{name}({arguments})' for name, arguments in methods.items())}"
        )


def _points(kind: str) -> list[EntryPoint]:
    return sorted(entry_points(group=f"feelahead.{PLURALS[kind]}"), key=lambda point: point.name)


def _unknown(kind: str, name: str, names: list[str]) -> ConfigurationError:
    valid = ", ".join([*names, "a file such as ./mine.py"])
    return ConfigurationError(f"{kind} {name!r}: there is no such {kind}; valid: {valid}")


def _package(point: EntryPoint) -> str:
    return "a package" if point.dist is None else f"{point.dist.name} {point.dist.version}"


def fault_in_words(error: BaseException) -> str:
    """Return an error of somebody's code in one line, with the last line of theirs that led to it."""
    if isinstance(error, SyntaxError):
        said, where = error.msg, f", {Path(error.filename or '').name} line {error.lineno}"
    else:
        said, where = str(error), _line_of(error)
    said = " ".join(said.split()) or "no reason given"
    return f"{type(error).__name__}{where}: {said}"[:_LONGEST_FAULT]


def _line_of(error: BaseException) -> str:
    frames, frame = list[tuple[Path, int]](), error.__traceback__
    while frame is not None:
        frames.append((Path(frame.tb_frame.f_code.co_filename), frame.tb_lineno))
        frame = frame.tb_next
    ours = [_OURS / package for package in ("common", "robot_side", "operator_side", "feelahead")]
    theirs = [
        (path, line)
        for path, line in frames
        if not any(path.is_relative_to(folder) for folder in ours) and "importlib" not in str(path)
    ]
    # Theirs, and not what theirs has called.
    own = [one for one in theirs if "site-packages" not in one[0].parts] or theirs
    return f", {own[-1][0].name} line {own[-1][1]}" if own else ""
