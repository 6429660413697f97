"""The value of a flag, before anything that could parse it is imported."""

from collections.abc import Sequence


def value_of(flag: str, arguments: Sequence[str]) -> str | None:
    """Find the last value of a flag; None without the flag, and "" where the arguments end behind it."""
    value = None
    for argument, following in zip(arguments, [*arguments, ""][1:], strict=True):
        if argument == flag:
            value = following
        elif argument.startswith(f"{flag}="):
            value = argument.removeprefix(f"{flag}=")
    return value
