"""Shares of what a run left out, because nothing needed it: the summary's block `skipped`."""

from typing import NamedTuple


class Part(NamedTuple):
    """What was done, and the whole of which it is a part."""

    done: int
    of: int


def shares(**parts: Part) -> dict[str, dict[str, float]]:
    """Return `done`, `of` and `skipped`, the share that was left out, by name.

    A part without a whole is left out: nothing is known of it.
    """
    return {
        name: {"done": part.done, "of": part.of, "skipped": 1.0 - part.done / part.of}
        for name, part in parts.items()
        if part.of > 0
    }
