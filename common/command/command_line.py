"""Settings from flags, a TOML file and defaults (in this order of precedence), and errors in one line."""

import contextlib
import dataclasses
import errno
import io
import re
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

import msgspec
import tyro

from common.command.flag_value import value_of
from common.command.stop_signal import STOP_SIGNALS, ignore_broken_output, say_output_failed
from common.command.words import printable
from common.errors import ConfigurationError, FeelaheadError
from common.files.toml_complaint import explain
from common.files.toml_file import read_toml

Settings = TypeVar("Settings")

_LONGEST_COMPLAINT = 400
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of the system when standard output is a file that cannot grow."""
_LARGEST_CONFIG_BYTES = 1_000_000


def parse_settings(
    settings_type: type[Settings], program: str, arguments: Sequence[str], elsewhere: str = ""
) -> Settings:
    """Make the dataclass `settings_type` from its defaults, then `--config FILE.toml`, then the flags.

    Every field of the (nested) dataclass is a key of the file and a flag: `[camera] mean_m = 0.001` and
    `--camera.mean-m 0.001`. A field with `tyro.conf.Suppress` is only a key. `elsewhere` is appended to the error about
    an unknown key of the file. Raises ConfigurationError for unknown, malformed or out-of-range values; SystemExit
    after `--help`.
    """
    path = _config_path(arguments)
    _refuse_keys_as_flags(settings_type, arguments)
    try:
        default = settings_type() if path is None else load_toml(Path(path), settings_type, elsewhere)
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    complaint = io.StringIO()
    nested = any(dataclasses.is_dataclass(hint) for hint in get_type_hints(settings_type).values())
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.cli(
                settings_type,
                prog=program,
                args=list(arguments),
                default=default,
                config=(tyro.conf.AvoidSubcommands, *(() if nested else (tyro.conf.OmitArgPrefixes,))),
            )
    except SystemExit as stop:
        if stop.code:
            raise ConfigurationError(_one_line(complaint.getvalue(), program, settings_type)) from None
        raise
    except ValueError as error:
        raise ConfigurationError(str(error)) from error


def given_fields(arguments: Sequence[str], settings_type: type) -> frozenset[str]:
    """Return the top-level fields that were set by a flag or in the `--config` file."""
    hints = get_type_hints(settings_type)
    flags = {argument.partition("=")[0] for argument in arguments if argument.startswith("--")}
    said = {flag.removeprefix("--").partition(".")[0].replace("-", "_") for flag in flags}
    said |= {name.removeprefix("no_") for name in said}
    if (path := _config_path(arguments)) is not None:
        with contextlib.suppress(OSError, ValueError):  # parse_settings has reported the fault
            said |= set(read_toml(Path(path), _LARGEST_CONFIG_BYTES))
    return frozenset(said & set(hints))


def load_toml(path: Path, settings_type: type[Settings], elsewhere: str = "", flag: str = "--config") -> Settings:
    """Read `settings_type` from a TOML file; raises ConfigurationError, which names file, key and valid values."""
    try:
        content = read_toml(path, _LARGEST_CONFIG_BYTES)
    except OSError as error:
        raise ConfigurationError(f"{flag} {path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise ConfigurationError(f"{flag} {path}: {error}") from error
    return settings_of(content, settings_type, f"{flag} {path}", elsewhere)


def settings_of(content: Mapping[str, Any], settings_type: type[Settings], place: str, elsewhere: str = "") -> Settings:
    """Make settings from their fields by name; raises ConfigurationError, which names place, field and valid values.

    Nested settings may be mappings or instances.
    """
    content = _in_tables(content, settings_type, place)
    _refuse_unknown_keys(content, settings_type, place, "", elsewhere)
    try:
        return msgspec.convert(content, settings_type, dec_hook=_from_toml)
    except msgspec.ValidationError as error:
        raise ConfigurationError(f"{place}: {explain(str(error), content, settings_type)}") from error


def run_command(program: str, command: Callable[[Sequence[str]], int]) -> None:
    """Run `command(arguments)` and exit. Print a FeelaheadError as one line; exit code 2 for bad input, otherwise 1."""
    try:
        try:
            code = command(sys.argv[1:])
        except SystemExit as shown:  # after --help
            code = int(shown.code or 0)
        if sys.stdout is not None:
            sys.stdout.flush()
    except FeelaheadError as error:
        print(printable(f"{program}: {error}"), file=sys.stderr)
        code = 2 if isinstance(error, ConfigurationError) else 1
    except BrokenPipeError:
        # The reader of our output has ended, as `head` does.
        ignore_broken_output()
        code = 0
    except OSError as error:
        if error.filename is not None:
            # A file or folder that a person named is inaccessible.
            print(printable(f"{program}: {str(error.filename)[:200]}: {error.strerror}"), file=sys.stderr)
            code = 2
        elif error.errno in _NO_ROOM:
            code = say_output_failed(program, error)
        else:
            raise
    except KeyboardInterrupt:
        code = 0
    # All is written: a second Ctrl-C must not spoil a clean end.
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    sys.exit(code)


def _in_tables(content: Mapping[str, Any], settings_type: type, place: str) -> Mapping[str, Any]:
    """Return the content with the keys of a table `[name]` as fields `name_key`, if the field `name` is an address.

    So `[arm] address = "…"` is the field `arm`, and `[arm.limits]` is `arm_limits`. ConfigurationError for both.
    """
    hints, found = get_type_hints(settings_type), dict(content)
    for name, table in content.items():
        if isinstance(table, Mapping) and hints.get(name) == (str | None):
            del found[name]
            fields = {name if key == "address" else f"{name}_{key}": value for key, value in table.items()}
            for field in fields.keys() & found.keys():
                key = field.removeprefix(f"{name}_")
                raise ConfigurationError(f"{place}: {field} and {name}.{key} are both given; valid: one of them")
            found |= fields
    return found


def _from_toml(kind: type, value: object) -> object:
    """Convert a value to a type that TOML lacks."""
    if kind is Path and isinstance(value, str | Path):
        return Path(value)
    raise TypeError(f"Expected `{kind.__name__}`, got `{type(value).__name__}`")


def _config_path(arguments: Sequence[str]) -> str | None:
    """Return the value of --config; None without it. It is read before other flags, as the file has their defaults."""
    if (path := value_of("--config", arguments)) == "":
        raise ConfigurationError("--config: no file given; valid: the path of a TOML file")
    return path


def _refuse_keys_as_flags(settings_type: type, arguments: Sequence[str]) -> None:
    hints = get_type_hints(settings_type, include_extras=True)
    keys = {name for name, hint in hints.items() if tyro.conf.Suppress in getattr(hint, "__metadata__", ())}
    for flag in (argument.partition("=")[0] for argument in arguments if argument.startswith("--")):
        key = flag.removeprefix("--").replace("-", "_")
        if key.partition(".")[0] in keys:
            raise ConfigurationError(
                f"{_shortened(flag)}: is no flag; valid: {_shortened(key)} in the file of --config"
            )


def _refuse_unknown_keys(
    content: Mapping[str, Any], settings_type: Any, file: str, prefix: str, elsewhere: str
) -> None:
    # A file that a file names is not read.
    hints = {name: hint for name, hint in get_type_hints(settings_type).items() if name != "config"}
    for key, value in content.items():
        if key not in hints:
            raise ConfigurationError(
                f"{file}: unknown key {_shortened(prefix + key)!r}; valid: {', '.join(sorted(hints))}" + elsewhere
            )
        for place, table, kind in _tables(f"{prefix}{key}", value, hints[key]):
            _refuse_unknown_keys(table, kind, file, f"{place}.", elsewhere)


def _tables(place: str, value: Any, hint: Any) -> Iterator[tuple[str, Mapping[str, Any], Any]]:
    """Return each table of settings in the value of a key, with its place in the file and its class."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        for argument in arguments:
            yield from _tables(place, value, argument)
    elif origin is dict and isinstance(value, dict):
        for name, part in value.items():
            yield from _tables(f"{place}.{name}", part, arguments[1])
    elif origin is tuple and isinstance(value, list):
        for number, part in enumerate(value):
            yield from _tables(f"{place}[{number}]", part, arguments[0])
    elif isinstance(value, dict) and dataclasses.is_dataclass(hint):
        yield place, value, hint


def _one_line(box: str, program: str, settings_type: type) -> str:
    """Return the first paragraph of tyro's error as one line; its box may be drawn in ASCII, and in colours."""
    words: list[str] = []
    for line in _COLOURS.sub("", box).splitlines()[1:]:
        text = line.strip("│╭╮╰╯|+ \t")
        ruled = text.strip("─-") == ""
        if words and (ruled or text == "Got errors:"):
            break
        if not ruled:
            words += text.split()
    said = " ".join(words).removeprefix("Error parsing ")
    said = re.sub(r"^[A-Z]\w*: ", "", said)  # the class that checked
    said = re.sub(r"\(([^()]*'None'[^()]*)\)", _given_choices, said)
    if named := re.match(r"(?:([\w.]+): )?(\w+) = ", said):
        place = f"{named[1]}.{named[2]}" if named[1] else named[2]
        if place.partition(".")[0] in get_type_hints(settings_type):
            said = f"--{place.replace('_', '-')} = {said[named.end() :]}"
    if "; valid: " in said:
        return _shortened(said)
    unfit = re.search(r"no type matching \S*(FLOAT|INT)\S* could be instantiated from \[(.*)\]\.", said)
    if unfit:
        kind = "a number" if "FLOAT" in unfit[0] else "a whole number"
        return f"{_shortened(said[: unfit.start()] + unfit[2])}; valid: {kind}"
    # For an option with several values tyro does not name their kind.
    several = re.match(r"(--\S+): Could not find valid parse for arguments: \[(.*)\]$", said)
    if several:
        return (
            f"{several[1]} {_shortened(several[2])}: a value is no number or is missing; valid: a number for each value"
        )
    for kind, valid in (("float", "a number"), ("int()", "a whole number")):
        if kind in said:
            return f"{_shortened(said)}; valid: {valid}"
    return f"{_shortened(said)} (valid flags and values: {program} --help)"


def _given_choices(of: re.Match[str]) -> str:
    """Return the choices of an optional flag, in one order; tyro's order varies, and has what an unset flag has."""
    return f"({', '.join(sorted(set(of[1].split(', ')) - {repr('None')}))})"


def _shortened(text: str) -> str:
    """Cut a long text, such as a value of a thousand digits, in which the fault could not be seen."""
    return text if len(text) <= _LONGEST_COMPLAINT else f"{text[:_LONGEST_COMPLAINT]}..."
