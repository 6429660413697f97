"""What is set otherwise, one thing at a time, and what the rest is compared with: the finest of each."""

from typing import Final

from feelahead.benchmarks.felt.turning import COVER_M, Turned
from robot_side.ahead.ask import NODES_PER_MARGIN
from robot_side.ahead.turns import FIELD_PERIOD_S

RATE: Final = "field rate"
LATE: Final = "a look is late"
COVER: Final = "spheres stand out"
NODES: Final = "nodes over the margin"
MESHES: Final = "objects of meshes"
_EVERY_TICK_S: Final = 0.0005
"""Both sides take turns unless one is overdue by a whole period."""


def ladders(*, quick: bool) -> dict[str, list[Turned]]:
    """By what is set: each setting, as it is among them, the finest last."""
    now_hz = round(1.0 / FIELD_PERIOD_S)
    rates = [Turned(RATE, f"{rate} Hz", period_s=1.0 / rate) for rate in (50, now_hz, 200, 500)]
    late = [Turned(LATE, f"by {ticks} ms", late_ticks=ticks) for ticks in (10, 4, 2, 1, 0)]
    covers = [
        Turned(COVER, f"{1e3 * cover_m:g} mm", cover_m=cover_m)
        for cover_m in (0.015, 0.008, 0.005, COVER_M, 0.0015, 0.001)
    ]
    nodes = [Turned(NODES, f"{count}", nodes=count) for count in (3, NODES_PER_MARGIN, 12, 24)]
    found = {
        RATE: [*rates, Turned(RATE, "1000 Hz", period_s=_EVERY_TICK_S)],
        LATE: late,
        COVER: covers,
        NODES: nodes,
        MESHES: [Turned(MESHES, "as hulls", hulls=True), Turned(MESHES, "as meshes")],
    }
    if quick:
        found[NODES] = [one for one in nodes if one.nodes in (3, NODES_PER_MARGIN, 12)]
    return found


def is_as_it_is(how: Turned) -> bool:
    """Whether nothing is set otherwise."""
    return Turned(how.knob, how.value) == how
