"""Make the pictures of real runs in docs/ again: `python -m tests.console.pictures [PART...]`."""

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import pytest

from common.errors import FeelaheadError
from tests.console.pictures.film_of_compare import make_compare_film
from tests.console.pictures.page import SIZES, make_first_minute, make_states
from tests.console.pictures.terminal import make_picture_of_terminal
from tests.console.states import STATES
from tests.helpers.repository import ROOT

DOCS: Final = ROOT / "docs"
PARTS: Final[Mapping[str, tuple[Sequence[str], Callable[[Path, Sequence[Path]], None]]]] = {
    "first-minute": ([f"console/first-minute-{step}.png" for step in range(1, 6)], make_first_minute),
    "terminal": (["console/terminal.svg"], make_picture_of_terminal),
    "compare": (["console/compare.webp"], make_compare_film),
    "states": (
        [f"../console-pictures/{state}-{width}x{height}.png" for state in STATES for width, height in SIZES],
        make_states,
    ),
}
"""Files of each part, from docs/ on, and the function that makes them; `states` is for a look, and made if named"""


def main(names: Sequence[str]) -> int:
    """Make the parts `names`, or all parts; return 1 if one could not be made, 2 for a bad name, else 0.

    Without a browser nothing is made, and 0 returned.
    """
    if unknown := set(names) - set(PARTS):
        print(f"{', '.join(sorted(unknown))}: no such part; valid: {', '.join(PARTS)}")
        return 2
    for name in names or [part for part in PARTS if part != "states"]:
        files, make = PARTS[name]
        paths = [DOCS / file for file in files]
        for left in reversed(range(3)):
            try:
                with tempfile.TemporaryDirectory(prefix="feelahead-") as folder:
                    make(Path(folder), paths)
                break
            except (AssertionError, FeelaheadError) as error:
                # A run spoilt by a busy machine is repeated.
                print(f"{name}: {error}")
                if not left:
                    return 1
            except pytest.skip.Exception as reason:
                print(f"skipped: {reason}")
                return 0
        print(*(f"{path.name}: {path.stat().st_size / 1000:.0f} kB" for path in paths), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
