"""What the pictures of experiments and benchmarks have in common."""

from typing import Final

PICTURES: Final = (".png", ".svg", ".pdf")
"""How the name of a picture may end."""
LAW_COLOURS: Final = {
    "swept": "#0072b2",
    "swept_robot": "#56b4e9",
    "paper": "#d55e00",
    "margin": "#cc79a7",
    "none": "#777777",
    "full": "#009e73",
}
