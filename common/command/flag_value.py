"""Value of a flag, read before a parser is imported."""

from collections.abc import Sequence


def value_of(flag: str, arguments: Sequence[str]) -> str | None:
    """Return the last value of a flag; None without the flag, and "" if the arguments end after it."""
    value = None
    for argument, following in zip(arguments, [*arguments, ""][1:], strict=True):
        if argument == flag:
            value = following
        elif argument.startswith(f"{flag}="):
            value = argument.removeprefix(f"{flag}=")
    return value
