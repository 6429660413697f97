"""Draw figures with matplotlib without a screen, so that the same data give the same file to the byte."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from common.errors import ConfigurationError
from common.extras import require_packages

PICTURES: Final = (".png", ".svg", ".pdf")
"""Endings that a picture's file name may have."""
LAW_COLOURS: Final = {
    "swept": "#0072b2",
    "swept_robot": "#56b4e9",
    "paper": "#d55e00",
    "paper-isotropic": "#e69f00",
    "none": "#777777",
    "full": "#009e73",
}
_OTHER_COLOURS: Final = ("#cc79a7", "#000000", "#f0e442")


def colour_of(law: str, laws: Sequence[str]) -> str:
    """Return the colour of one of the `laws` that are drawn together."""
    others = [one for one in laws if one not in LAW_COLOURS]
    return LAW_COLOURS[law] if law in LAW_COLOURS else _OTHER_COLOURS[others.index(law) % len(_OTHER_COLOURS)]


@contextmanager
def figure(path: Path, rows: int = 1, columns: int = 1, title: str = "", **options: Any) -> Iterator[tuple[Any, Any]]:
    """Yield a figure and its axes, as `matplotlib.pyplot.subplots` makes them; afterwards write the figure to `path`.

    ConfigurationError if matplotlib is missing or the file cannot be written.
    """
    require_packages("--picture", "matplotlib", extra="experiments")
    import matplotlib as mpl  # noqa: PLC0415  # slow to load, and only for pictures

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    with mpl.rc_context({"svg.hashsalt": "feelahead"}):
        layout: dict[str, Any] = {"dpi": 110, "layout": "constrained"} | options
        drawn, axes = plt.subplots(rows, columns, **layout)
        try:
            yield drawn, axes
            if title:
                drawn.suptitle(title, fontsize=9)
            # No date and no version of the library in the file: the same data give the same bytes.
            dated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
            drawn.savefig(path, metadata=dated.get(path.suffix.lower(), {"Software": None}))
        except OSError as error:
            raise ConfigurationError(f"--picture {path}: cannot be written: {error.strerror}") from error
        finally:
            plt.close(drawn)
