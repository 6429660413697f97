"""Value of one flag, found without a command-line parser, which takes long to import."""

from collections.abc import Sequence


def value_of(flag: str, arguments: Sequence[str]) -> str | None:
    """Return the last value of `flag`; None if it is absent, "" if the arguments end after it."""
    value = None
    for argument, following in zip(arguments, [*arguments, ""][1:], strict=True):
        if argument == flag:
            value = following
        elif argument.startswith(f"{flag}="):
            value = argument.removeprefix(f"{flag}=")
    return value


def with_value(flag: str, value: str, arguments: Sequence[str]) -> list[str]:
    """Return the arguments with `value` after each `flag` that has none."""
    found: list[str] = []
    for argument, following in zip(arguments, [*arguments, "--"][1:], strict=True):
        found += [argument, value] if argument == flag and following.startswith("--") else [argument]
    return found
